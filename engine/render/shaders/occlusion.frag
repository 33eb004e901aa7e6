// At half resolution, from the depth alone: how much of the surroundings' light gets to a point (r) and
// whether the lens light does (g).
uniform sampler2D distance_map;
in vec2 uv;
out vec2 open_out;

const float kRadius = 0.026;                 // [m]: from folds to neighbouring organs
const float kLightRadius = 0.002;            // [m]

float distance_at(ivec2 pixel, ivec2 size) {
  return texelFetch(distance_map, clamp(pixel, ivec2(0), size - 1), 0).r;
}

void main() {
  ivec2 size = textureSize(distance_map, 0);
  ivec2 here = ivec2(gl_FragCoord.xy);
  float centre = texelFetch(distance_map, here, 0).r;
  float left = distance_at(here - ivec2(1, 0), size), right = distance_at(here + ivec2(1, 0), size);
  float down = distance_at(here - ivec2(0, 1), size), up = distance_at(here + ivec2(0, 1), size);
  // The smaller of the one-sided differences: edges of things in front don't bend the plane.
  float slope_x = abs(right - centre) < abs(centre - left) ? right - centre : centre - left;
  float slope_y = abs(up - centre) < abs(centre - down) ? up - centre : centre - down;
  float dither = interleaved_noise(gl_FragCoord.xy);

  float pixels_per_metre = float(size.y) / (max(centre, 1e-3) * 2.0 * frame.lens.y);
  float reach = min(kRadius * pixels_per_metre, 0.25 * float(size.y));
  float blocked = 0.0;
  for (int i = 0; i < SAMPLES; ++i) {
    // Closer together near the middle, where contacts darken most.
    float radius = pow((float(i) + 0.5) / float(SAMPLES), 1.6);
    float turn = 6.2831853 * dither + 2.39996323 * float(i);
    ivec2 there = here + ivec2(round(reach * radius * vec2(cos(turn), sin(turn))));
    float seen = distance_at(there, size);
    vec2 moved = vec2(clamp(there, ivec2(0), size - 1) - here);
    float in_front = centre + slope_x * moved.x + slope_y * moved.y - seen;
    float aside = length(moved) / pixels_per_metre;
    float sine = in_front * inversesqrt(in_front * in_front + aside * aside + 1e-8);
    blocked += smoothstep(0.10, 0.95, sine) * (1.0 - smoothstep(1.0, 2.5, in_front / kRadius)) *
               step(0.0, seen);
  }
  open_out.r = 1.0 - blocked / float(SAMPLES);

  // Towards the light the picture moves as between two eyes: a shadow is what the other eye can't see.
  float other = interleaved_noise(gl_FragCoord.xy + vec2(47.0, 17.0));
  vec2 from = kGuide + kLightRadius * (2.0 * other - 1.0) * vec2(0.6, 0.8);
  vec2 parallax = from * pixels_per_metre;
  float shade = 0.0;
  for (int i = 0; i < SHADOW_STEPS; ++i) {
    float share = (float(i) + fract(dither + 0.37)) / float(SHADOW_STEPS);
    float s = 0.42 * share * share + 0.008;
    float seen = distance_at(here + ivec2(round(parallax * s / (1.0 - s))), size);
    float in_front = centre * (1.0 - s) - seen;
    shade = max(shade, step(6e-4, in_front) * (1.0 - smoothstep(0.02, 0.04, in_front)) *
                           step(0.0, seen));
  }
  open_out.g = 1.0 - shade;
}
