// How deep in smoke every point lies as the light guide sees it: the guide sits beside the lens, so a
// point's way to it is another one than that to the lens. r: optical depth; g: the same without what
// is scattered forward, which still arrives: (1 - albedo g) of it.
layout(local_size_x = kMarchGroup, local_size_y = kMarchGroup) in;
layout(binding = 0, rg32f) uniform writeonly image3D light_depths;
uniform vec2 light_tangents;       // half the width and height of the guide's grid at unit distance

void main() {
  ivec3 size = imageSize(light_depths);
  ivec2 column = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(column, size.xy))) return;
  vec2 uv = (vec2(column) + 0.5) / vec2(size.xy);
  vec3 ray = vec3((2.0 * uv - 1.0) * light_tangents, -1.0);
  vec3 from = frame.eye.xyz + view_to_world * vec3(kGuide, 0.0);
  vec3 direction = view_to_world * ray;
  int count = size.z - 1;
  float step_length = (slices.y - slices.x) / float(count);
  float metres = step_length * length(ray);
  vec2 spans[VOLUMES];
  for (int v = 0; v < VOLUMES; ++v) spans[v] = span_of(v, from, direction);
  vec2 depths = vec2(0.0);
  imageStore(light_depths, ivec3(column, 0), vec4(0.0));
  for (int k = 0; k < count; ++k) {
    float z = slices.x + (float(k) + 0.5) * step_length;
    vec2 extinction = vec2(background.x, background.x - background.z);
    for (int v = 0; v < VOLUMES; ++v) {
      float first = max(z - 0.5 * step_length, spans[v].x), last = min(z + 0.5 * step_length, spans[v].y);
      if (last <= first) continue;
      vec3 at = (from + direction * (0.5 * (first + last)) - volumes[v].low) / volumes[v].size;
      float density = textureLod(density_maps[v], at, 0.0).r * (last - first) / step_length;
      extinction += density * vec2(volumes[v].optics.x, volumes[v].optics.x - volumes[v].optics.z);
    }
    depths += extinction * metres;
    imageStore(light_depths, ivec3(column, k + 1), vec4(depths, 0.0, 0.0));
  }
}
