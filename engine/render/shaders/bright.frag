// What is brighter than the sensor takes spills over in the lens.
uniform sampler2D small_map;
uniform sampler2D exposure_map;
in vec2 uv;
out vec4 spill;

void main() {
  vec3 seen = textureLod(small_map, uv, 0.0).rgb * texelFetch(exposure_map, ivec2(0), 0).r;
  float level = max(seen.r, max(seen.g, seen.b));
  spill = vec4(seen * max(level - 1.0, 0.0) / max(level, 1e-3), 1.0);
}
