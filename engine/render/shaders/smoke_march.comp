// Marches light through smoke along one ray from the lens for every column of the grid. What has
// gathered up to a slice's far side goes to `marched`: r optical depth to the lens; light that was
// scattered to the lens, g from the guide, b from the cavity's walls. A pixel reads it at its own distance, so nothing bleeds over edges.
layout(local_size_x = kMarchGroup, local_size_y = kMarchGroup) in;
layout(binding = 0, rgba32f) uniform writeonly image3D marched;
#ifdef TEMPERATURE
layout(binding = 1, rg32f) uniform writeonly image3D heated;  // smoke on the way [kg/m2], times its excess [K]
#endif
uniform sampler3D light_map;
uniform vec2 light_tangents;

uniform int samples;               // of the density in a slice: closer together than cells, against bands and grain

// Henyey-Greenstein phase function [Henyey1941] [1/sr], times pi to match lens_light.
float phase(float g, float cosine) {
  float s = 1.0 + g * g - 2.0 * g * cosine;
  return 0.25 * (1.0 - g * g) * inversesqrt(s) / s;
}

// The mean of exp(-y t) over t from 0 to 1, from y and exp(-y).
float mean_of_decay(float y, float decayed) { return y > 1e-2 ? (1.0 - decayed) / y : 1.0 - 0.5 * y; }

void main() {
  ivec3 size = imageSize(marched);
  ivec2 column = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(column, size.xy))) return;
  vec2 uv = (vec2(column) + 0.5) / vec2(size.xy);
  // Columns that no pixel of a round picture reads.
  vec2 aside_uv = (uv - 0.5) * vec2(frame.picture.x / frame.picture.y, 1.0);
  if (length(aside_uv) > frame.picture.w + 2.5 / float(size.y)) return;
  vec3 ray = view_ray(uv);
  float stretch = length(ray);     // metres along the ray per metre of axial distance
  vec3 along = ray / stretch;
  vec3 direction = view_to_world * ray;
  int count = size.z - 1;
  float step_length = (slices.y - slices.x) / float(count);
  float metres = step_length * stretch;
  vec2 spans[VOLUMES];
  vec2 met = vec2(1e9, -1e9);      // where there is any volume
  for (int v = 0; v < VOLUMES; ++v) {
    spans[v] = span_of(v, frame.eye.xyz, direction);
    if (spans[v].x <= spans[v].y) met = vec2(min(met.x, spans[v].x), max(met.y, spans[v].y));
  }
  // The guide's nearest point of the ray, and its distance: 1 / distance^2 is integrated exactly
  // over a slice of even smoke [Kulla2012].
  vec3 guide = vec3(kGuide, 0.0);
  float nearest = dot(guide, along);
  float aside = length(guide - nearest * along);
  // Samples stray from the middles of their steps, so that no shells of equal distance show; every
  // second one to the other side: else all would shift what is summed up to a surface by what the
  // smoke is there times that way, which was seen as hatching. Another turn of the same dither every
  // picture keeps what is left from standing still in a film.
  float turn = 0.61803399 * mod(frame.picture.z, 64.0);
  float jitter = 0.5 * fract(interleaved_noise(vec2(column)) + turn) - 0.25;
  float share = 1.0 / float(samples), pace = step_length * share;
  float depth = background.x * slices.x * stretch;
  float angle = atan((slices.x * stretch - nearest) / aside);
  float light_before = 0.0;
  vec2 scattered = vec2(0.0);
  vec2 heat = vec2(0.0);
  for (int k = 0; k <= count; ++k) {
    float z = slices.x + float(k) * step_length;
    vec2 towards = 0.5 + 0.5 * (ray.xy - kGuide / max(z, 1e-3)) / light_tangents;
    float light_here = textureLod(light_map, vec3(towards, (float(k) + 0.5) / float(count + 1)), 0.0).r;
    if (k > 0) {
      vec3 medium = background;
      bool inside = z > met.x && z - step_length < met.y && depth < 12.0;
      for (int i = 0; i < samples && inside; ++i) {
        float middle = z - (float(i) + 0.5) * pace;
        float astray = ((k * samples + i) & 1) == 0 ? jitter : -jitter;
        for (int v = 0; v < VOLUMES; ++v) {
          // A sample stands for the part of its step that lies in the volume: else the volume's
          // sides would grain.
          float first = max(middle - 0.5 * pace, spans[v].x), last = min(middle + 0.5 * pace, spans[v].y);
          if (last <= first) continue;
          float there = mix(first, last, 0.5 + astray);
          vec3 at = (frame.eye.xyz + direction * there - volumes[v].low) / volumes[v].size;
          vec2 found = textureLod(density_maps[v], at, 0.0).rg * vec2((last - first) / pace, 1.0);
          medium += found.r * volumes[v].optics * share;
          heat += metres * share * vec2(found.r, found.r * found.g);
        }
      }
      float end_angle = atan((z * stretch - nearest) / aside);
      float thin = medium.x * metres;
      if (thin > 0.0 && depth < 12.0) {
        vec3 from_guide = (z - 0.5 * step_length) * ray - guide;
        float far = length(from_guide);
        float axis = -from_guide.z / far;
        float cosine = -dot(from_guide, along) / far;
        float g = medium.z / max(medium.y, 1e-9);
        // Light scattered more than once dies away more slowly and comes back more evenly: two
        // orders after [Wrenninge2013], as far as there is smoke on the way to scatter it again.
        float there_and_back = depth + light_before;
        float in_slice = thin + max(light_here - light_before, 0.0);
        float d3 = exp(-0.25 * there_and_back), d2 = d3 * d3, d1 = d2 * d2;
        float s3 = exp(-0.25 * in_slice), s2 = s3 * s3, s1 = s2 * s2;
        float again = 1.0 - d1 * s1;
        float arriving = phase(g, cosine) * d1 * mean_of_decay(in_slice, s1) +
                         again * 0.6 * phase(0.5 * g, cosine) * d2 * mean_of_decay(0.5 * in_slice, s2) +
                         again * again * 0.36 * 0.25 * d3 * mean_of_decay(0.25 * in_slice, s3);
        // The guide shines forward alone.
        float lit = guide_spot(axis) * smoothstep(0.0, 0.5, axis);
        scattered.x += medium.y * arriving * lit * 0.01 * (end_angle - angle) / aside;
        scattered.y += medium.y / medium.x * exp(-depth) * (1.0 - exp(-thin));
      }
      depth += thin;
      angle = end_angle;
    }
    light_before = light_here;
    imageStore(marched, ivec3(column, k), vec4(depth, scattered, 0.0));
#ifdef TEMPERATURE
    imageStore(heated, ivec3(column, k), vec4(heat, 0.0, 0.0));
#endif
  }
}
