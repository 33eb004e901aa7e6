// The picture as the camera head puts it out: stair-steps along edges smoothed (STAIRS, the short form
// of [Lottes2009]), edges sharpened, the sensor's noise. Writes the rows from the top.
uniform sampler2D developed_map;
out vec4 colour;

// Three values in [0, 1) for a pixel of a picture, by an integer hash: the same on every device.
vec3 sensor_noise(uvec3 x) {
  x = x * 1664525u + 1013904223u;
  x.x += x.y * x.z; x.y += x.z * x.x; x.z += x.x * x.y;
  x ^= x >> 16u;
  x.x += x.y * x.z; x.y += x.z * x.x; x.z += x.x * x.y;
  return vec3(x >> 8u) * (1.0 / 16777216.0);
}

void main() {
  ivec2 last = textureSize(developed_map, 0) - 1;
  vec2 texel = 1.0 / frame.shown.xy;
  vec2 pixel = vec2(gl_FragCoord.x, frame.shown.y - gl_FragCoord.y);
  ivec2 here = ivec2(pixel);
  vec4 middle = texelFetch(developed_map, here, 0);
  vec4 nw = texelFetch(developed_map, clamp(here + ivec2(-1, 1), ivec2(0), last), 0);
  vec4 ne = texelFetch(developed_map, clamp(here + ivec2(1, 1), ivec2(0), last), 0);
  vec4 sw = texelFetch(developed_map, clamp(here + ivec2(-1, -1), ivec2(0), last), 0);
  vec4 se = texelFetch(developed_map, clamp(here + ivec2(1, -1), ivec2(0), last), 0);
  float lowest = min(middle.a, min(min(nw.a, ne.a), min(sw.a, se.a)));
  float highest = max(middle.a, max(max(nw.a, ne.a), max(sw.a, se.a)));
  float sharpening = 0.22 * (4.0 * middle.a - nw.a - ne.a - sw.a - se.a);
  vec3 seen = middle.rgb;
#ifdef STAIRS
  vec2 along = vec2(sw.a + se.a - nw.a - ne.a, nw.a + sw.a - ne.a - se.a);
  float damp = max((nw.a + ne.a + sw.a + se.a) * 0.03125, 0.0078125);
  along /= min(abs(along.x), abs(along.y)) + damp;
  along = clamp(along, -6.0, 6.0) * texel;
  vec2 place = pixel * texel;
  vec3 narrow = 0.5 * (textureLod(developed_map, place - along / 6.0, 0.0).rgb +
                       textureLod(developed_map, place + along / 6.0, 0.0).rgb);
  vec3 wide = 0.5 * narrow + 0.25 * (textureLod(developed_map, place - 0.5 * along, 0.0).rgb +
                                     textureLod(developed_map, place + 0.5 * along, 0.0).rgb);
  float wide_luma = dot(wide, vec3(0.16, 0.66, 0.18));
  vec3 smoothed = wide_luma < lowest || wide_luma > highest ? narrow : wide;
  bool edge = highest - lowest > max(0.03, 0.09 * highest);
  seen = edge ? smoothed : seen;
  sharpening *= edge ? 0.3 : 1.0;
#endif
  seen += clamp(sharpening, -0.035, 0.035);
  // Nearly normal, from the sum of two; more of it where the picture is dark, as amplifiers have it.
  uvec3 key = uvec3(uvec2(here), uint(frame.picture.z));
  vec3 grain = sensor_noise(key) + sensor_noise(key + uvec3(0u, 0u, 4099u)) - 1.0;
  grain = mix(vec3(grain.g), grain, 0.35);
  vec2 aside = (pixel * texel - 0.5) * vec2(frame.shown.x / frame.shown.y, 1.0);
  float rim = frame.picture.w;
  float inside = 1.0 - smoothstep(rim - 4.0 * texel.y, rim - 2.0 * texel.y, length(aside));
  seen += inside * grain * mix(0.016, 0.006, clamp(middle.a * 1.6, 0.0, 1.0));
  colour = vec4(seen * step(1e-6, inside + middle.a), 1.0);
}
