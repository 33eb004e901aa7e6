// integrate (integrate.h) with sum_swirl (swirl.h), a thread a particle.
#include "kernels/smoke/smoke_passes.glsl"

layout(std140, binding = 0) uniform Pass { IntegrateParameters pass; };
uniform int with_gas;  // else it rests

layout(std430, binding = 0) buffer Positions { vec4 positions[]; };
layout(std430, binding = 1) buffer Velocities { vec4 velocities[]; };
layout(std430, binding = 2) readonly buffer Ids { uint ids[]; };
layout(std430, binding = 3) readonly buffer Accelerations { vec4 accelerations[]; };
layout(std430, binding = 4) readonly buffer Waves { SwirlWave waves[]; };
layout(std430, binding = 5) readonly buffer Gas { vec4 gas[]; };  // u; speed of eddies

uvec3 random_words(uint x, uint y, uint z) {
  uvec3 v = uvec3(x, y, z) * 1664525u + 1013904223u;
  v.x += v.y * v.z;
  v.y += v.z * v.x;
  v.z += v.x * v.y;
  v ^= v >> 16u;
  v.x += v.y * v.z;
  v.y += v.z * v.x;
  v.z += v.x * v.y;
  return v;
}

float nearly_normal(uint word) {
  uint bytes =
      (word & 0xffu) + (word >> 8 & 0xffu) + (word >> 16 & 0xffu) + (word >> 24);
  return (float(bytes) - 510.0) * (1.0 / 147.8005);
}

vec3 swirl_at(vec3 at) {
  vec3 sum = vec3(0.0);
  for (uint m = 0u; m < pass.waves; ++m) {
    vec4 k = waves[m].wave_number;
    // Tens of turns: another rounding would show in the sine.
    precise float phase = k.x * at.x + k.y * at.y + k.z * at.z + k.w;
    phase -= roundEven(phase);
    float parabola = phase * (8.0 - 16.0 * abs(phase));
    sum += waves[m].amplitude.xyz * (parabola * (0.775 + 0.225 * abs(parabola)));
  }
  return sum;
}

/// One axis against the domain's sides: `low`, `high` are bits of open_sides.
void keep_inside(inout float position, inout float velocity, float extent, uint low, uint high) {
  float restitution = pass.extent.w;
  if (position < 0.0 && (pass.open_sides & low) == 0u) {
    position = min(-restitution * position, extent);
    velocity = -restitution * velocity;
  } else if (position > extent && (pass.open_sides & high) == 0u) {
    position = max(extent - restitution * (position - extent), 0.0);
    velocity = -restitution * velocity;
  }
}

void main() {
  uint i = thread_index();
  if (i >= pass.particles) return;
  vec4 position = positions[i], velocity = velocities[i], neighbours = accelerations[i];
  vec3 v = velocity.xyz;
  vec4 around =
      with_gas != 0 ? gas[i] : vec4(0.0, 0.0, 0.0, pass.turbulence * length(v));
  uvec3 words = random_words(ids[i], pass.substep, pass.seed);
  vec3 noise = vec3(nearly_normal(words.x), nearly_normal(words.y), nearly_normal(words.z));
  vec3 flow = around.xyz + around.w * (swirl_at(position.xyz) + pass.white * noise);
  vec3 acceleration = neighbours.xyz;
  acceleration.z += pass.gravity * (position.w / (pass.gas_temperature + position.w));
  float rate = neighbours.w + pass.entrainment * length(v - around.xyz);
  v = (v + pass.step * (acceleration + rate * flow)) / (1.0 + pass.step * rate);
  vec3 at = position.xyz + pass.step * v;
  keep_inside(at.x, v.x, pass.extent.x, kOpenLowX, kOpenHighX);
  keep_inside(at.y, v.y, pass.extent.y, kOpenLowY, kOpenHighY);
  keep_inside(at.z, v.z, pass.extent.z, kOpenLowZ, kOpenHighZ);
  positions[i] = vec4(at, position.w / (1.0 + pass.step * pass.cooling * rate));
  velocities[i] = vec4(v, velocity.w + pass.step);
}
