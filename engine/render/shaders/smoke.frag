// Marches a smoke volume at half resolution, front to back. Writes what the smoke scatters to the
// lens: r from the lens light, g from light that bounces about the cavity; a: what is left of light
// that goes to what lies behind and comes back.
uniform sampler3D density_map;     // smoke mass per volume [kg/m3]
uniform sampler2D distance_map;    // axial distance of what the smoke lies before [m]
uniform vec3 domain_low;           // of the texture [m]
uniform vec3 domain_size;
uniform vec3 filled_low;           // where there is any smoke
uniform vec3 filled_high;
uniform mat3 view_to_world;
uniform float mass_extinction;     // [m2/kg]
uniform float albedo;
uniform float asymmetry;
in vec2 uv;
out vec4 scattered;

const int kSteps = STEPS;

// Henyey-Greenstein phase function [Henyey1941] straight back [1/sr], times pi to match lens_light.
float back_scatter(float g) {
  float s = 1.0 + g;
  return 0.25 * (1.0 - g * g) / (s * s * s);
}

void main() {
  scattered = vec4(0.0, 0.0, 0.0, 1.0);
  vec3 ray = view_ray(uv);
  float stretch = length(ray);             // metres along the ray per metre of axial distance
  vec3 direction = view_to_world * (ray / stretch);
  float surface = texelFetch(distance_map, ivec2(gl_FragCoord.xy), 0).r;
  vec3 inverse = 1.0 / (direction + vec3(equal(direction, vec3(0.0))) * 1e-9);
  vec3 a = (filled_low - eye.xyz) * inverse, b = (filled_high - eye.xyz) * inverse;
  vec3 low = min(a, b), high = max(a, b);
  float enter = max(max(low.x, max(low.y, low.z)), lens.z);
  float leave = min(min(high.x, min(high.y, high.z)), surface * stretch);
  // A second turn of the same dither per picture keeps the grain from standing still in a film.
  float jitter = fract(interleaved_noise(gl_FragCoord.xy) + 0.61803399 * mod(picture.z, 64.0));
  float span = max(leave - enter, 0.0);
  float dt = span / float(kSteps);
  vec3 place = (eye.xyz + direction * (enter + jitter * dt) - domain_low) / domain_size;
  vec3 pace = direction * dt / domain_size;
  float t = enter + jitter * dt;
  float axis = 1.0 / stretch;
  float single = back_scatter(asymmetry);
  float second = back_scatter(asymmetry * 0.5);
  float depth = 0.0;                       // optical
  float from_lens = 0.0, from_cavity = 0.0;
  for (int i = 0; i < kSteps; ++i) {
    if (span <= 0.0 || depth > 6.0) break;
    float sigma = mass_extinction * textureLod(density_map, place, 0.0).r;
    float thin = sigma * dt;
    float middle = depth + 0.5 * thin;
    float share = 1.0 - exp(-thin);
    float d = max(t, 0.02);
    // Light scattered more than once dies away more slowly and comes back more evenly: two orders
    // after [Wrenninge2013]. The transmittance from the lens is that to the lens: the light sits
    // there.
    float arriving = single * exp(-2.0 * middle) + 0.6 * second * exp(-1.0 * middle) +
                     0.36 * 0.25 * exp(-0.5 * middle);
    from_lens += share * albedo * arriving * (0.01 / (d * d));
    from_cavity += share * albedo * exp(-middle);
    depth += thin;
    place += pace;
    t += dt;
  }
  from_lens *= mix(0.45, 1.0, smoothstep(0.70, 1.0, axis));
  // Light that scatters forward still reaches the surface: only the rest is lost on the way there.
  scattered = vec4(from_lens, from_cavity, 0.0, exp(-depth * (2.0 - albedo * asymmetry)));
}
