// Averages the march's dither out: 3 x 3 neighbours at about the same distance, the period of the
// interleaved noise.
uniform sampler2D smoke_map;
uniform sampler2D distance_map;
out vec4 smoothed;

void main() {
  ivec2 last = textureSize(smoke_map, 0) - 1;
  ivec2 here = ivec2(gl_FragCoord.xy);
  float centre = texelFetch(distance_map, here, 0).r;
  vec4 sum = vec4(0.0);
  float weights = 0.0;
  for (int y = -1; y < 2; ++y) {
    for (int x = -1; x < 2; ++x) {
      ivec2 there = clamp(here + ivec2(x, y), ivec2(0), last);
      float apart = (texelFetch(distance_map, there, 0).r - centre) / centre;
      float weight = 1.0 / (1e-2 + apart * apart * 40.0);
      sum += weight * texelFetch(smoke_map, there, 0);
      weights += weight;
    }
  }
  smoothed = sum / weights;
}
