// Smoke before what the lens sees, at each pixel's own distance: what is left of the surface's light
// after both ways through smoke, and what the smoke scatters to the lens. Blended over the picture,
// or, with PASSES, written out.
uniform sampler2D depth_map;
#ifdef MARCHED
uniform sampler3D marched_map;     // of smoke_march.comp
uniform sampler3D light_map;       // of smoke_light.comp
uniform sampler3D heated_map;
uniform vec2 light_tangents;
uniform vec2 slices;               // axial [m]
uniform vec3 background;           // extinction, scattering, scattering times g [1/m]
#endif
#ifdef SPRITES
uniform sampler2D sprite_map;      // of smoke_sprite.frag, at half resolution
uniform sampler2D distance_map;
uniform float forward;             // albedo times g
#endif
uniform float gas_temperature;     // [K]
in vec2 uv;
#ifdef PASSES
layout(location = 0) out vec4 kept;       // transmittance to the lens, to the guide, axial distance [m], smoke [K]
layout(location = 1) out vec4 scattered;
#else
out vec4 seen;                     // rgb: scattered; a: share that is left of what lies behind
#endif

const vec3 kCavityLight = vec3(0.085, 0.062, 0.056);  // that comes to smoke from all sides

#ifdef SPRITES
// Half-resolution sprites at a full-resolution pixel: four neighbours, those at the pixel's distance.
vec4 sprites_at(vec2 place, float distance_here) {
  vec2 half_size = vec2(textureSize(sprite_map, 0));
  vec2 at = place * half_size - 0.5;
  ivec2 base = ivec2(floor(at));
  vec2 f = at - vec2(base);
  vec4 sum = vec4(0.0);
  float weights = 0.0;
  for (int y = 0; y < 2; ++y) {
    for (int x = 0; x < 2; ++x) {
      ivec2 there = clamp(base + ivec2(x, y), ivec2(0), ivec2(half_size) - 1);
      vec2 near = mix(1.0 - f, f, vec2(x, y));
      float apart = (texelFetch(distance_map, there, 0).r - distance_here) / distance_here;
      float weight = (near.x * near.y + 1e-3) / (1e-3 + apart * apart * 40.0);
      sum += weight * texelFetch(sprite_map, there, 0);
      weights += weight;
    }
  }
  return sum / weights;
}
#endif

void main() {
  float depth = texelFetch(depth_map, ivec2(gl_FragCoord.xy), 0).r;
  float z = axial_distance(depth);
  vec2 transmitted = vec2(1.0);    // to the lens, to the guide
  vec2 gathered = vec2(0.0);       // from the guide, from the cavity
  float temperature = gas_temperature;
#ifdef MARCHED
  vec3 size = vec3(textureSize(marched_map, 0));
  float slice = clamp((z - slices.x) / (slices.y - slices.x), 0.0, 1.0);
  vec3 at = vec3(uv, (slice * (size.z - 1.0) + 0.5) / size.z);
  vec3 smoke = textureLod(marched_map, at, 0.0).rgb;
  // The guide's way to the surface is its own, also before the first and beyond the last slice.
  vec2 towards = 0.5 + 0.5 * (view_ray(uv).xy - kGuide / max(z, 1e-3)) / light_tangents;
  float to_guide = textureLod(light_map, vec3(towards, at.z), 0.0).g;
  // Beyond the last slice there is the even background alone.
  float beyond = max(z - slices.y, 0.0) * length(view_ray(uv));
  vec2 depths = vec2(smoke.x, to_guide) + beyond * vec2(background.x, background.x - background.z);
  transmitted = exp(-depths);
  gathered = smoke.yz;
#if defined(PASSES) && defined(TEMPERATURE)
  vec2 heat = textureLod(heated_map, at, 0.0).rg;
  temperature += heat.x > 1e-9 ? heat.y / heat.x : 0.0;
#endif
#endif
#ifdef SPRITES
  vec4 sprites = sprites_at(uv, z);
  transmitted *= vec2(sprites.a, pow(sprites.a, 1.0 - forward));
  gathered = gathered * sprites.a + sprites.rg;
#endif
  vec3 light_scattered = frame.light.rgb * (gathered.x + gathered.y * kCavityLight);
#ifdef PASSES
  float seen_at = depth < 1.0 && depth > 0.0 ? z : uintBitsToFloat(0x7f800000u);
  kept = vec4(transmitted, seen_at, temperature);
  scattered = vec4(light_scattered, 1.0);
#else
  seen = vec4(light_scattered, transmitted.x * transmitted.y);
#endif
}
