// Tissue: colour and relief from the place in the body at rest, so that they stick to it; light from
// the deformed surface.
in vec3 world;
in vec3 organ_normal;
in vec3 rest;
in vec3 rest_normal;
out vec4 radiance;

uniform mat3 rotation;             // organ frame to world
uniform sampler2D open_map;        // ambient occlusion, half resolution
uniform vec3 colour;
uniform vec3 mottle_colour;
uniform vec3 vessel_colour;
uniform vec3 seed_offset;          // tells two organs of one tissue apart
uniform float mottle_scale;
uniform float mottle_amount;
uniform float vessel_scale;
uniform float vessel_amount;
uniform float bump_height;
uniform float bump_scale;
uniform float wetness;
uniform float translucency;

#ifdef BURNT
uniform usampler3D brick_map;      // 0: no brick, else 1 + tile
uniform sampler3D damage_atlas;    // tiles of (kEdge + 2 kBorder)^3
uniform ivec3 first_brick;
uniform ivec3 atlas_tiles;
uniform float voxel;               // [m]

const int kEdge = 8;
const int kBorder = 2;

// Cubic B-spline weights folded into two linear fetches an axis [Sigg2005].
float damage_at(vec3 place) {
  vec3 voxels = place / voxel;
  ivec3 brick = ivec3(floor(voxels / float(kEdge)));
  ivec3 cell = brick - first_brick;
  ivec3 size = textureSize(brick_map, 0);
  bool outside = any(lessThan(cell, ivec3(0))) || any(greaterThanEqual(cell, size));
  int tile = outside ? 0 : int(texelFetch(brick_map, clamp(cell, ivec3(0), size - 1), 0).r);
  int index = max(tile - 1, 0);
  ivec3 corner = ivec3(index % atlas_tiles.x, (index / atlas_tiles.x) % atlas_tiles.y,
                       index / (atlas_tiles.x * atlas_tiles.y)) * (kEdge + 2 * kBorder);
  vec3 inside = voxels - vec3(brick * kEdge) + float(kBorder) - 0.5;
  vec3 base = floor(inside);
  vec3 f = inside - base;
  vec3 f2 = f * f, f3 = f2 * f;
  vec3 w0 = (1.0 - 3.0 * f + 3.0 * f2 - f3) / 6.0;
  vec3 w1 = (4.0 - 6.0 * f2 + 3.0 * f3) / 6.0;
  vec3 w3 = f3 / 6.0;
  vec3 g0 = w0 + w1;
  vec3 g1 = 1.0 - g0;
  vec3 scale = 1.0 / vec3(textureSize(damage_atlas, 0));
  vec3 low = (vec3(corner) + base - 0.5 + w1 / g0) * scale;
  vec3 high = (vec3(corner) + base + 1.5 + w3 / g1) * scale;
  vec4 near = vec4(textureLod(damage_atlas, low, 0.0).r,
                   textureLod(damage_atlas, vec3(high.x, low.yz), 0.0).r,
                   textureLod(damage_atlas, vec3(low.x, high.y, low.z), 0.0).r,
                   textureLod(damage_atlas, vec3(high.xy, low.z), 0.0).r);
  vec4 far = vec4(textureLod(damage_atlas, vec3(low.xy, high.z), 0.0).r,
                  textureLod(damage_atlas, vec3(high.x, low.y, high.z), 0.0).r,
                  textureLod(damage_atlas, vec3(low.x, high.yz), 0.0).r,
                  textureLod(damage_atlas, high, 0.0).r);
  vec4 z = near * g0.z + far * g1.z;
  vec2 y = z.xy * g0.y + z.zw * g1.y;
  return tile == 0 ? 0.0 : y.x * g0.x + y.y * g1.x;
}
#endif

// A direction of the body at rest, turned the shortest way from the rest normal to the deformed one.
vec3 to_deformed(vec3 v, vec3 from, vec3 to) {
  vec3 axis = cross(from, to);
  float c = dot(from, to);
  return v * c + cross(axis, v) + axis * (dot(axis, v) / (1.0 + max(c, -0.95)));
}

// How much of a pattern of this wavelength survives pixels this wide.
float kept(float wavelength, float pixel) {
  return 1.0 - smoothstep(0.22, 0.55, pixel / wavelength);
}

// 1 on thin lines where the noise crosses zero; `width` in noise units, kept wider than a pixel.
float line(vec4 n, float width) {
  float steep = max(length(n.yzw), 0.35);
  return 1.0 - smoothstep(0.0, width, abs(n.x) / steep);
}

void main() {
  vec3 to_lens = eye.xyz - world;
  float distance_to_lens = length(to_lens);
  vec3 v = to_lens / distance_to_lens;
  float axial = -(view * vec4(world, 1.0)).z;
  float pixel = 2.0 * lens.y * axial / picture.y;
  vec3 n_organ = normalize(organ_normal);
  vec3 n_rest = normalize(rest_normal);
  vec3 p = rest + seed_offset;

  // Colour: broad tone, mottling with soft edges, fine grain.
  vec4 broad = noise(p / (4.5 * mottle_scale));
  vec4 spots = noise(p / mottle_scale + 0.5 * broad.yzw);
  vec4 fine_spots = noise(p / (0.36 * mottle_scale) + 0.4 * spots.yzw);
  float mottle = smoothstep(-0.45, 0.75, spots.x + 0.45 * fine_spots.x + 0.3 * broad.x);
  vec3 albedo = mix(colour, mottle_colour, mottle_amount * mottle);
  albedo *= 1.0 + 0.16 * broad.x;

  float grain_wave = 0.9 * bump_scale;
  vec4 grain = noise(p / grain_wave);
  float grain_kept = kept(grain_wave, pixel);
  albedo *= 1.0 + 0.14 * grain.x * grain_kept;

  // Vessels: a few branching lines that fade in and out along their way, under the capsule.
  vec3 q = p / vessel_scale + 0.22 * fine_spots.yzw * (mottle_scale * 0.36 / vessel_scale);
  vec4 trunk = noise(q + 0.25 * broad.yzw);
  vec4 twig = noise(2.7 * q + 17.0 + 0.25 * spots.yzw);
  float caliber = smoothstep(-0.35, 0.65, 0.8 * spots.x + broad.x);
  float trunk_line = line(trunk, 0.012 + 0.028 * caliber) * (0.12 + 0.88 * caliber);
  float twig_line = line(twig, 0.045) * smoothstep(-0.2, 0.5, fine_spots.x + trunk.y * 0.5) *
                    kept(0.25 * vessel_scale, pixel);
  float vessel = vessel_amount * clamp(trunk_line + 0.55 * twig_line, 0.0, 1.0);
  albedo = mix(albedo, vessel_colour, vessel);

  // Relief: [m] of height per octave; its slope is height / wavelength times the noise's gradient.
  vec4 swell = noise(p / (5.3 * bump_scale) + 31.0);
  vec4 ripple = noise(p / (2.1 * bump_scale) + 7.0);
  float swell_kept = kept(5.3 * bump_scale, pixel);
  float ripple_kept = kept(2.1 * bump_scale, pixel);
  vec3 slope = swell.yzw * (1.7 * swell_kept) + ripple.yzw * (1.0 * ripple_kept);
  // The film lies flatter than the tissue under it.
  vec3 film_slope = slope * 0.8 + grain.yzw * (0.35 * grain_kept);
  slope += grain.yzw * (0.75 * grain_kept);
  float steepness = bump_height / bump_scale;
  slope *= steepness;
  film_slope *= steepness;

  float wet = wetness;
  float char_amount = 0.0;
  vec3 burn_bend = vec3(0.0);
#ifdef BURNT
  float raw = damage_at(rest);
  // A trace of grain on the edge: dried tissue isn't cut by a compass, but it stays round.
  float damage = clamp(raw + 0.05 * raw * (1.0 - raw) * 4.0 * (0.6 * grain.x + 0.4 * ripple.x),
                       0.0, 1.0);
  vec3 pale = mix(vec3(0.32, 0.20, 0.135), albedo, 0.4);
  vec3 brown = vec3(0.115, 0.052, 0.024);
  vec3 black = vec3(0.012, 0.010, 0.009) * (1.0 + 0.8 * grain.x);
  albedo = mix(albedo, pale, smoothstep(0.0, 0.62, sqrt(damage)));
  albedo = mix(albedo, brown, smoothstep(0.26, 0.58, damage));
  char_amount = smoothstep(0.52, 0.92, damage);
  albedo = mix(albedo, black, char_amount);
  wet *= 1.0 - smoothstep(0.12, 0.55, damage);
  slope += 0.55 * char_amount * (grain.yzw + 0.5 * ripple.yzw);
  // Dried tissue shrinks: the surface sinks with the damage. The height's slope on the screen,
  // turned into a normal [Mikkelsen2010].
  float sunk = -3.5e-4 * smoothstep(0.15, 0.85, damage);
  vec3 along_x = dFdx(world), along_y = dFdy(world);
  vec3 n_flat = rotation * n_organ;
  vec3 r1 = cross(along_y, n_flat), r2 = cross(n_flat, along_x);
  float det = dot(along_x, r1);
  burn_bend = (dFdx(sunk) * r1 + dFdy(sunk) * r2) * (sign(det) / max(abs(det), 1e-14));
#endif

  vec3 tangent_slope = slope - n_rest * dot(slope, n_rest);
  vec3 tangent_film = film_slope - n_rest * dot(film_slope, n_rest);
  vec3 n_smooth = rotation * n_organ;
  // Seen from inside (a lens within an open wall), the near side is the inside.
  float side = gl_FrontFacing ? 1.0 : -1.0;
  vec3 n = normalize(n_smooth - rotation * to_deformed(tangent_slope, n_rest, n_organ) - burn_bend);
  vec3 film = normalize(n_smooth - rotation * to_deformed(tangent_film, n_rest, n_organ) - burn_bend);
  n *= side;
  film *= side;

  float cosine = dot(n, v);
  float film_cosine = max(dot(film, v), 0.0);
  vec3 incoming = lens_light(distance_to_lens, axial / distance_to_lens);
  float open = texture(open_map, gl_FragCoord.xy / picture.xy).r;

  // Red light travels furthest under the surface: it wraps round the terminator.
  vec3 wrap = translucency * (1.0 - char_amount) * vec3(0.42, 0.12, 0.09);
  vec3 lit = clamp((cosine + wrap) / ((1.0 + wrap) * (1.0 + wrap)), 0.0, 1.0);
  // Crevices are lit by what bounces between red walls: darker and redder, not grey.
  vec3 crevice = pow(vec3(open), vec3(0.75, 1.15, 1.2));
  vec3 diffuse = albedo * lit * incoming * mix(vec3(1.0), crevice, 0.75);
  vec3 bounce = light.rgb * vec3(0.120, 0.074, 0.060);
  diffuse += albedo * bounce * crevice;

  // Tissue lobe, broad; film lobe, sharp; both widened where the normal turns within a pixel.
  float broad_roughness = filtered_roughness(n, mix(0.62, 0.42, wet) + 0.25 * char_amount);
  float film_roughness = filtered_roughness(film, mix(0.34, 0.14, wet));
  float pooled = smoothstep(-0.5, 0.5, swell.x + 0.5 * spots.x);
  float gloss = 0.022 * retro_lobe(max(cosine, 0.0), broad_roughness) * (1.0 - 0.85 * char_amount);
  float glint = 0.022 * wet * wet * mix(0.35, 1.0, pooled) * retro_lobe(film_cosine, film_roughness);
  vec3 specular = incoming * min(gloss + glint, 10.0) * open;
  // At grazing angles the wet film mirrors the lit cavity.
  float grazing = pow(1.0 - min(film_cosine, 1.0), 5.0);
  specular += (0.02 + 0.5 * grazing) * wet * light.rgb * vec3(0.10, 0.062, 0.052) * open;

  radiance = vec4(diffuse + specular, 1.0);
}
