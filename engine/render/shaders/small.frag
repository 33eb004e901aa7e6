// The picture at a quarter of its size, smoke included: what the exposure and the spill of light are
// found from. Alpha: 1 within the field of view.
uniform sampler2D radiance_map;
in vec2 uv;
out vec4 small;

void main() {
  vec2 quarter = 0.25 / vec2(textureSize(radiance_map, 0)) * frame.picture.x / (0.25 * frame.shown.x);
  vec3 sum = vec3(0.0);
  for (int y = -1; y < 2; y += 2) {
    for (int x = -1; x < 2; x += 2) {
      sum += min(textureLod(radiance_map, uv + vec2(x, y) * quarter, 0.0).rgb, vec3(8.0));
    }
  }
  sum *= 0.25;
  small = vec4(sum, 1.0);
}
