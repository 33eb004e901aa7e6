// Ambient occlusion at half resolution from the depth buffer: the share of points around the surface
// that lie behind what is seen.
uniform sampler2D distance_map;
in vec2 uv;
out float open_out;

const float kRadius = 0.009;   // [m]: folds and contacts, not whole organs
const int kSamples = 10;

void main() {
  ivec2 size = textureSize(distance_map, 0);
  ivec2 here = ivec2(gl_FragCoord.xy);
  float centre = texelFetch(distance_map, here, 0).r;
  float left = texelFetch(distance_map, max(here - ivec2(1, 0), ivec2(0)), 0).r;
  float right = texelFetch(distance_map, min(here + ivec2(1, 0), size - 1), 0).r;
  float down = texelFetch(distance_map, max(here - ivec2(0, 1), ivec2(0)), 0).r;
  float up = texelFetch(distance_map, min(here + ivec2(0, 1), size - 1), 0).r;
  // The smaller of the one-sided differences: edges of things in front don't bend the plane.
  float slope_x = abs(right - centre) < abs(centre - left) ? right - centre : centre - left;
  float slope_y = abs(up - centre) < abs(centre - down) ? up - centre : centre - down;
  float reach = kRadius / (max(centre, 1e-3) * 2.0 * lens.y) * float(size.y);   // [pixels]
  float angle = 6.2831853 * interleaved_noise(gl_FragCoord.xy);
  float blocked = 0.0;
  for (int i = 0; i < kSamples; ++i) {
    float radius = sqrt((float(i) + 0.5) / float(kSamples));
    float turn = angle + 2.39996323 * float(i);
    vec2 step_pixels = min(reach, 60.0) * radius * vec2(cos(turn), sin(turn));
    ivec2 there = clamp(here + ivec2(round(step_pixels)), ivec2(0), size - 1);
    float seen = texelFetch(distance_map, there, 0).r;
    vec2 moved = vec2(there - here);
    float plane = centre + slope_x * moved.x + slope_y * moved.y;
    float in_front = plane - seen;
    float height = in_front / kRadius;
    blocked += smoothstep(0.02, 0.45, height) * (1.0 - smoothstep(1.0, 3.0, height)) *
               step(0.0, seen);
  }
  open_out = 1.0 - 0.85 * blocked / float(kSamples);
}
