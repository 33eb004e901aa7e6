// What is brighter than the sensor takes spills over in the lens: quarter resolution.
uniform sampler2D radiance_map;
in vec2 uv;
out vec4 spill;

void main() {
  vec2 texel = 1.0 / vec2(textureSize(radiance_map, 0));
  vec3 sum = vec3(0.0);
  for (int y = -1; y < 2; y += 2) {
    for (int x = -1; x < 2; x += 2) {
      sum += min(textureLod(radiance_map, uv + vec2(x, y) * texel, 0.0).rgb, vec3(6.0));
    }
  }
  sum *= 0.25;
  float level = max(sum.r, max(sum.g, sum.b));
  spill = vec4(sum * max(level - 0.9, 0.0) / max(level, 1e-3), 1.0);
}
