// Linear light to what the camera head would show: the lens's distortion, smoke over the organs, spill,
// exposure, the film's curve, the round field of view, sRGB. Alpha is what show.frag looks for
// edges in.
uniform sampler2D radiance_map;
uniform sampler2D spill_map;
uniform sampler2D exposure_map;
#ifdef SMOKE
uniform sampler2D depth_map;
uniform sampler2D smoke_map;
uniform sampler2D distance_map;
#endif
in vec2 uv;
out vec4 developed;

#ifdef SMOKE
// Half-resolution smoke at a full-resolution pixel: four neighbours, those at the pixel's distance.
vec4 smoke_at(vec2 place, float distance_here) {
  vec2 half_size = vec2(textureSize(smoke_map, 0));
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
      float weight = (near.x * near.y + 1e-3) / (1e-2 + apart * apart * 40.0);
      sum += weight * texelFetch(smoke_map, there, 0);
      weights += weight;
    }
  }
  return sum / weights;
}
#endif

// A curve fitted to the ACES film response [Narkowicz2015].
vec3 film_curve(vec3 x) {
  return clamp(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 0.0, 1.0);
}

// The sensor's colour filters overlap: what is bright and red isn't pure red.
vec3 overlapped(vec3 x) {
  return mix(x, vec3(dot(x, vec3(0.30, 0.55, 0.15))), 0.09);
}

vec3 to_srgb(vec3 x) {
  return mix(12.92 * x, 1.055 * pow(max(x, 1e-5), vec3(1.0 / 2.4)) - 0.055,
             step(vec3(0.0031308), x));
}

void main() {
  vec2 aspect = vec2(shown.x / shown.y, 1.0);
  vec2 from_centre = (uv - 0.5) * aspect;
  float square = dot(from_centre, from_centre);
  // The rim of the field of view, or the corners, stay where they are; and there a wide field with
  // corners is bent less.
  bool round_field = picture.w < 1.0;
  float barrel = round_field ? eye.w : 0.3 * eye.w;
  float rim = round_field ? 0.25 : 0.25 * dot(aspect, aspect);
  vec2 place = 0.5 + (uv - 0.5) * (1.0 + barrel * square) / (1.0 + barrel * rim);
  float exposure = texelFetch(exposure_map, ivec2(0), 0).r;
  exposure *= 1.0 - 0.42 * smoothstep(0.05, 0.33, square);
  vec3 spill = 0.16 * textureLod(spill_map, place, 0.0).rgb;
  vec3 film = vec3(0.0);
#ifdef SUPERSAMPLED
  // Each sample passes the curve before the mean is taken, so that highlights have smooth edges too.
  const int kSamples = 4;
#else
  const int kSamples = 1;
#endif
  for (int i = 0; i < kSamples; ++i) {
    vec2 aside = kSamples == 1 ? vec2(0.0) : vec2(i & 1, i >> 1) - 0.5;
    vec2 there = place + 0.5 * aside / shown.xy;
    vec3 seen = textureLod(radiance_map, there, 0.0).rgb;
#ifdef SMOKE
    ivec2 pixel = ivec2(clamp(there, 0.0, 0.9999) * vec2(textureSize(depth_map, 0)));
    vec4 smoke = smoke_at(there, axial_distance(texelFetch(depth_map, pixel, 0).r));
    seen = seen * smoke.a + light.rgb * (smoke.r + smoke.g * vec3(0.085, 0.062, 0.056));
#endif
    film += film_curve(overlapped(exposure * seen + spill));
  }
  film /= float(kSamples);
  float radius = sqrt(square), pixel = 1.0 / shown.y;
  film *= 1.0 - smoothstep(picture.w - 5.0 * pixel, picture.w - 0.5 * pixel, radius);
  developed.rgb = to_srgb(film);
  // All tissue is red: what tells one from another, and its edge, is green.
  developed.a = dot(developed.rgb, vec3(0.16, 0.66, 0.18));
}
