// Tissue: colour and relief from the place in the body at rest, so that they stick to it; light from
// the deformed surface: a rough base under a film of water.
in vec3 world;
in vec3 organ_normal;
in vec3 rest;
in vec3 rest_normal;
in float depth;  // of a cut's wall below the skin that the organ had [m]
out vec4 radiance;

uniform mat3 rotation;             // organ frame to world
uniform vec3 colour;
uniform vec3 mottle_colour;
uniform vec3 artery_colour;
uniform vec3 vein_colour;
uniform vec3 seed_offset;          // tells two organs of one tissue apart
uniform float mottle_scale;
uniform float mottle_amount;
uniform float vessel_amount;
uniform float fat_amount;
uniform float bump_height;
uniform float bump_scale;
uniform float roughness;
uniform float wetness;
uniform float translucency;

const float kWater = 0.021;        // reflectance of water, face on
const vec3 kFat = vec3(0.53, 0.32, 0.17);

void main() {
  vec3 to_lens = frame.eye.xyz - world;
  float distance_to_lens = length(to_lens);
  vec3 v = to_lens / distance_to_lens;
  float axial = -(frame.view * vec4(world, 1.0)).z;
  // Tissue under a pixel, more where it is seen aslant.
  float pixel = 2.0 * frame.lens.y * axial / frame.picture.y;
  pixel = clamp(max(length(dFdx(rest)), length(dFdy(rest))), 0.5 * pixel, 6.0 * pixel);
  vec3 n_organ = normalize(organ_normal);
  vec3 n_rest = normalize(rest_normal);
  vec3 p = rest + seed_offset;

  // Relief: slopes of a height [m] in waves about five, two and one times its width.
  float steepness = bump_height / bump_scale;
  vec4 swell = noise(p / (5.3 * bump_scale) + 31.0);
  vec4 ripple = noise(p / (2.1 * bump_scale) + 7.0);
  vec3 slope = steepness * (2.6 * kept(5.3 * bump_scale, pixel) * swell.yzw +
                            1.0 * kept(2.1 * bump_scale, pixel) * ripple.yzw);
  // The film lies flatter than the tissue under it.
  vec3 film_slope = slope;
#ifdef FINE_RELIEF
  float grain_wave = 0.9 * bump_scale;
  vec4 grain = noise(p / grain_wave) * kept(grain_wave, pixel);
  slope += steepness * 0.75 * grain.yzw;
  film_slope += steepness * 0.45 * kept(grain_wave, 1.7 * pixel) * grain.yzw;
#else
  vec4 grain = vec4(0.0);
#endif

  // Colour: broad tone, then the tissue's own pattern.
  vec4 broad = noise(p / (4.5 * mottle_scale));
#ifdef LOBULES
  Lobule lobule = lobule_at((p + 0.35 * mottle_scale * broad.yzw) / mottle_scale);
  vec4 spots = vec4(2.0 * lobule.inside - 1.0, vec3(0.0));
  vec3 domes = (4.0 * bump_height / mottle_scale) * kept(mottle_scale, pixel) * lobule.slope;
  slope += domes;
  film_slope += 0.8 * domes;
  float mottle = 1.0 - smoothstep(0.48, 0.85, lobule.inside);
  mottle = clamp(0.6 * mottle + 0.5 * broad.x, 0.0, 1.0);
  float tone = 0.13 * lobule.tone + 0.12 * broad.x;
#elif defined(FIBRES)
  const vec3 kAlong = vec3(0.10, 1.0, 1.0);
  vec4 spots = noise(kAlong * (p / mottle_scale + 0.6 * broad.yzw));
  vec4 strands = noise(vec3(0.07, 1.0, 1.0) * (3.7 / mottle_scale) * p + 0.8 * spots.x);
  float strands_kept = kept(mottle_scale / 3.7, pixel);
  vec3 bundles = 1.2 * steepness * (kAlong * spots.yzw * kept(mottle_scale, pixel) +
                                    vec3(0.07, 1.0, 1.0) * strands.yzw * strands_kept);
  slope += bundles;
  // Strands are as fine as pixels: in the film they would only sparkle.
  film_slope += 0.5 * steepness * kept(mottle_scale, 2.0 * pixel) * kAlong * spots.yzw;
  float mottle = smoothstep(-0.25, 0.65, spots.x + 0.55 * strands.x * strands_kept);
  float tone = 0.14 * broad.x + 0.10 * strands.x * strands_kept;
#else
  vec4 spots = noise(p / mottle_scale + 0.2 * broad.yzw);
#ifdef FINE_RELIEF
  vec4 fine_spots = noise(p / (0.30 * mottle_scale) + 0.15 * spots.yzw) *
                    kept(0.45 * mottle_scale, 1.6 * pixel);
#else
  vec4 fine_spots = vec4(0.0);
#endif
  float mottle = smoothstep(-0.45, 0.75, spots.x + 0.5 * fine_spots.x + 0.35 * broad.x);
  float tone = 0.14 * broad.x + 0.08 * fine_spots.x;
#endif
  vec3 albedo = mix(colour, mottle_colour, mottle_amount * mottle);
  albedo *= 1.0 + tone + 0.12 * grain.x;

#ifdef VESSELS
  // They come up to the surface and dive under it again.
  vec2 vessel = vessels_at(p + 0.04 * vessel_scale * broad.yzw + 0.008 * vessel_scale * spots.yzw,
                           n_rest);
  float risen = vessel_amount * smoothstep(-0.55, 0.35, broad.x + 0.4 * spots.x);
  vessel *= vec2(1.0, 0.75) * mix(0.35 * vessel_amount, vessel_amount, risen);
  albedo = mix(albedo, albedo * (vein_colour / max(colour, 0.02)), clamp(1.2 * vessel.y, 0.0, 1.0));
  albedo = mix(albedo, artery_colour, clamp(1.1 * vessel.x, 0.0, 1.0));
#endif

#ifdef FAT
  // A veil of fat clings to the capsule, thick here, torn to strands there.
  float level = mix(0.55, -0.55, fat_amount);
  float thick = smoothstep(level - 0.30, level + 0.45, broad.x + 0.30 * spots.x + 0.16 * ripple.x);
  float strand = smoothstep(-0.35, 0.45, spots.x - 0.5 * fine_spots.x + 0.5 * swell.x);
  float fat = thick * mix(0.30, 0.75, strand);
  albedo = mix(albedo, kFat * (1.0 + 0.25 * ripple.x + tone), fat);
  vec3 heap = fat * (0.10 * swell.yzw + 0.16 * ripple.yzw);
  slope += heap;
  film_slope += 0.7 * heap;
#endif

  float wet = wetness;
  if (depth > 0.0) {
    // What a cut has opened: bare tissue, grained as its lobules, under blood that runs together in
    // places. Chosen by eye.
    vec4 lobules = noise(p / 1.3e-3 + 5.0) * kept(1.3e-3, pixel);
    float blood = smoothstep(-0.2, 0.5, broad.x + 0.8 * swell.x);
    vec3 bare = mottle_colour * vec3(0.80, 0.58, 0.50) * (1.0 + 0.22 * lobules.x);
    bare = mix(bare, vec3(0.16, 0.006, 0.005), 0.55 * blood);
    float opened = smoothstep(0.05e-3, 0.35e-3, depth);
    albedo = mix(albedo, bare, opened);
    slope = mix(slope, slope + 0.30 * lobules.yzw, opened);
    wet = mix(wet, 1.0, opened);
  }
  float char_amount = 0.0;
  vec3 burn_bend = vec3(0.0), glow = vec3(0.0);
#ifdef BURNT
  // Tissue doesn't dry evenly: a groove wanders and is now wider, now narrower; a spot stays round.
  Burn burn = burn_at(rest + 3e-4 * swell.yzw);
  vec4 crust = noise(p / 0.7e-3 + 13.0);
  float crust_kept = kept(0.7e-3, pixel);
  float flake = crust_kept * crust.x + 0.7 * ripple.x;
  albedo = burnt_colour(albedo, burn, flake);
  char_amount = char_of(burn, flake);
  glow = glow_of(burn.excess);
  wet *= 1.0 - smoothstep(0.05, 0.6, burn.dried);
  float dry = smoothstep(0.25, 0.9, burn.dried);
  slope += dry * (0.5 * crust_kept * crust.yzw + 0.35 * ripple.yzw);
  // Coagulated tissue shrinks, dried tissue sinks. The height's slope on the screen, turned into a
  // normal [Mikkelsen2010].
  float sunk = -0.8e-4 * smoothstep(0.2, 0.9, burn.coagulated) - 2.5e-4 * burn.dried -
               1.2e-4 * burn.charred + 1.2e-4 * crust_kept * flake * dry;
  vec3 along_x = dFdx(world), along_y = dFdy(world);
  vec3 n_flat = rotation * n_organ;
  vec3 r1 = cross(along_y, n_flat), r2 = cross(n_flat, along_x);
  float det = dot(along_x, r1);
  burn_bend = (dFdx(sunk) * r1 + dFdy(sunk) * r2) * (sign(det) / max(abs(det), 1e-14));
#endif

  vec3 tangent_slope = slope - n_rest * dot(slope, n_rest);
  vec3 tangent_film = film_slope - n_rest * dot(film_slope, n_rest);
  vec3 n_smooth = rotation * n_organ - burn_bend;
  // Seen from inside (a lens within an open wall), the near side is the inside.
  float side = gl_FrontFacing ? 1.0 : -1.0;
  vec3 n = side * normalize(n_smooth - rotation * to_deformed(tangent_slope, n_rest, n_organ));
  vec3 film = side * normalize(n_smooth - rotation * to_deformed(tangent_film, n_rest, n_organ));

  float cosine = dot(n, v);
  float film_cosine = max(dot(film, v), 0.0);
  vec3 incoming = lens_light(distance_to_lens, axial / distance_to_lens);
  vec3 around = cavity_light(distance_to_lens);
  vec2 open = open_at(axial);
  // A shadow's edge is lit by the guide's far side, and by the tissue beside it.
  incoming *= mix(0.30, 1.0, open.y);

  vec3 diffuse = diffuse_tissue(albedo, translucency * (1.0 - char_amount), cosine, incoming, around,
                                open.x);

  // The base's broad lobe and the film's sharp one, widened where the normal turns within a pixel.
  float base_roughness = filtered_roughness(n, mix(roughness, 0.9, char_amount));
  float film_roughness = filtered_roughness(film, mix(0.34, 0.13, wet));
  float pooled = smoothstep(-0.6, 0.4, swell.x + 0.5 * spots.x);
  float gloss = 0.013 * retro_lobe(max(cosine, 0.0), base_roughness) * (1.0 - 0.85 * char_amount);
  float glint = kWater * wet * wet * mix(0.4, 1.0, pooled) * retro_lobe(film_cosine, film_roughness);
  vec3 specular = incoming * min(gloss + glint, 12.0) * open.x;
  // At grazing angles the film mirrors the lit cavity.
  float grazing = pow(1.0 - min(film_cosine, 1.0), 5.0);
  specular += (kWater + 0.25 * grazing) * wet * around * open.x;

  radiance = vec4(diffuse + specular + glow, 1.0);
}
