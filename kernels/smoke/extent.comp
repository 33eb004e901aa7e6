// What the CPU must know of the particles before the next pass: BOX their bounding box and greatest
// speed, AMOUNTS what the greatest one carries (splat.h). All as words whose greatest is sought, so
// that cleared words begin it: of a number the bits, which ascend for positive ones and are turned
// about for others; for the least, their complement.
#include "kernels/smoke/smoke_passes.glsl"
#pragma passes BOX AMOUNTS

uniform int count;  // particles

layout(std430, binding = 0) readonly buffer Positions { vec4 positions[]; };
layout(std430, binding = 1) readonly buffer Velocities { vec4 velocities[]; };

#ifdef BOX
const uint kWords = kBoxWords;
layout(std430, binding = 2) buffer Extent { uint extent[]; };  // low, high, speed^2

uint ascending(float x) {
  uint bits = floatBitsToUint(x);
  return (bits & 0x80000000u) != 0u ? ~bits : bits | 0x80000000u;
}
#else
const uint kWords = kAmountWords;
layout(std430, binding = 2) readonly buffer Masses { float masses[]; };
layout(std430, binding = 3) buffer Extent { uint extent[]; };  // mass, heat, momentum
#endif

shared uint most[kWords];

void main() {
  uint group = group_index();
  if (group >= uint(groups)) return;
  uint lane = gl_LocalInvocationID.x;
  if (lane < kWords) most[lane] = 0u;
  barrier();
  uint own[kWords];
  for (uint w = 0u; w < kWords; ++w) own[w] = 0u;
  for (uint i = group * kSmokeGroup + lane; i < uint(count); i += uint(groups) * kSmokeGroup) {
    vec4 at = positions[i], v = velocities[i];
#ifdef BOX
    own[0] = max(own[0], ~ascending(at.x));
    own[1] = max(own[1], ~ascending(at.y));
    own[2] = max(own[2], ~ascending(at.z));
    own[3] = max(own[3], ascending(at.x));
    own[4] = max(own[4], ascending(at.y));
    own[5] = max(own[5], ascending(at.z));
    own[6] = max(own[6], floatBitsToUint(dot(v.xyz, v.xyz)));
#else
    vec3 size = abs(v.xyz);
    own[0] = max(own[0], floatBitsToUint(masses[i]));
    own[1] = max(own[1], floatBitsToUint(masses[i] * abs(at.w)));
    own[2] = max(own[2], floatBitsToUint(masses[i] * max(max(size.x, size.y), size.z)));
#endif
  }
  for (uint w = 0u; w < kWords; ++w) atomicMax(most[w], own[w]);
  barrier();
  if (lane < kWords) atomicMax(extent[lane], most[lane]);
}
