// Smooths the dithered occlusion over 4 x 4 pixels of about the same distance.
uniform sampler2D distance_map;
uniform sampler2D open_map;
out vec2 open_out;

void main() {
  ivec2 last = textureSize(open_map, 0) - 1;
  ivec2 here = ivec2(gl_FragCoord.xy);
  float centre = texelFetch(distance_map, here, 0).r;
  vec2 sum = vec2(0.0);
  float weights = 0.0;
  for (int y = -2; y < 2; ++y) {
    for (int x = -2; x < 2; ++x) {
      ivec2 there = clamp(here + ivec2(x, y), ivec2(0), last);
      float far = abs(texelFetch(distance_map, there, 0).r - centre);
      float weight = 1.0 / (1e-4 + far * far * 1e2);
      sum += weight * texelFetch(open_map, there, 0).rg;
      weights += weight;
    }
  }
  open_out = sum / weights;
}
