// One axis of a Gaussian of about three pixels.
uniform sampler2D source_map;
uniform vec2 axis;
in vec2 uv;
out vec4 blurred;

void main() {
  vec2 texel = axis / vec2(textureSize(source_map, 0));
  vec3 sum = 0.1964 * textureLod(source_map, uv, 0.0).rgb;
  sum += 0.2969 * (textureLod(source_map, uv + 1.4117 * texel, 0.0).rgb +
                   textureLod(source_map, uv - 1.4117 * texel, 0.0).rgb);
  sum += 0.0945 * (textureLod(source_map, uv + 3.2941 * texel, 0.0).rgb +
                   textureLod(source_map, uv - 3.2941 * texel, 0.0).rgb);
  sum += 0.0104 * (textureLod(source_map, uv + 5.1765 * texel, 0.0).rgb +
                   textureLod(source_map, uv - 5.1765 * texel, 0.0).rgb);
  blurred = vec4(sum, 1.0);
}
