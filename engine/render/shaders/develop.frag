// Linear light to what the camera head would show: the lens's distortion, spill, exposure,
// the film's curve, the round field of view, sRGB. Alpha is what show.frag looks for
// edges in.
uniform sampler2D radiance_map;
uniform sampler2D spill_map;
uniform sampler2D exposure_map;
in vec2 uv;
out vec4 developed;


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
  vec2 aspect = vec2(frame.shown.x / frame.shown.y, 1.0);
  vec2 from_centre = (uv - 0.5) * aspect;
  float square = dot(from_centre, from_centre);
  // The rim of the field of view, or the corners, stay where they are; and there a wide field with
  // corners is bent less.
  bool round_field = frame.picture.w < 1.0;
  float barrel = round_field ? frame.eye.w : 0.3 * frame.eye.w;
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
    vec2 there = place + 0.5 * aside / frame.shown.xy;
    vec3 seen = textureLod(radiance_map, there, 0.0).rgb;
    film += film_curve(overlapped(exposure * seen + spill));
  }
  film /= float(kSamples);
  float radius = sqrt(square), pixel = 1.0 / frame.shown.y;
  film *= 1.0 - smoothstep(frame.picture.w - 5.0 * pixel, frame.picture.w - 0.5 * pixel, radius);
  developed.rgb = to_srgb(film);
  // All tissue is red: what tells one from another, and its edge, is green.
  developed.a = dot(developed.rgb, vec3(0.16, 0.66, 0.18));
}
