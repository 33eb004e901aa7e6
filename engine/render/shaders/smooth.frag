// Smooths stair-steps along edges, the short form of [Lottes2009]; writes the rows from the top.
uniform sampler2D developed_map;
out vec4 colour;

void main() {
  ivec2 size = textureSize(developed_map, 0);
  vec2 texel = 1.0 / vec2(size);
  vec2 pixel = vec2(gl_FragCoord.x, float(size.y) - gl_FragCoord.y);
  ivec2 here = ivec2(pixel);
  ivec2 last = size - 1;
  vec4 middle = texelFetch(developed_map, here, 0);
  float nw = texelFetch(developed_map, clamp(here + ivec2(-1, 1), ivec2(0), last), 0).a;
  float ne = texelFetch(developed_map, clamp(here + ivec2(1, 1), ivec2(0), last), 0).a;
  float sw = texelFetch(developed_map, clamp(here + ivec2(-1, -1), ivec2(0), last), 0).a;
  float se = texelFetch(developed_map, clamp(here + ivec2(1, -1), ivec2(0), last), 0).a;
  float lowest = min(middle.a, min(min(nw, ne), min(sw, se)));
  float highest = max(middle.a, max(max(nw, ne), max(sw, se)));
  vec2 along = vec2(sw + se - nw - ne, nw + sw - ne - se);
  float damp = max((nw + ne + sw + se) * 0.03125, 0.0078125);
  along /= min(abs(along.x), abs(along.y)) + damp;
  along = clamp(along, -6.0, 6.0) * texel;
  vec2 place = pixel * texel;
  vec3 narrow = 0.5 * (textureLod(developed_map, place - along / 6.0, 0.0).rgb +
                       textureLod(developed_map, place + along / 6.0, 0.0).rgb);
  vec3 wide = 0.5 * narrow + 0.25 * (textureLod(developed_map, place - 0.5 * along, 0.0).rgb +
                                     textureLod(developed_map, place + 0.5 * along, 0.0).rgb);
  float wide_luma = dot(wide, vec3(0.299, 0.587, 0.114));
  vec3 smoothed = wide_luma < lowest || wide_luma > highest ? narrow : wide;
  bool edge = highest - lowest > max(0.018, 0.06 * highest);
  colour = vec4(edge ? smoothed : middle.rgb, 1.0);
}
