// Reads a buffer once, or copies it: what the memory of this device can give. Each thread reads
// vectors a whole dispatch apart, so that neighbours read neighbours, and sums them: a sum that is
// written nowhere would not be read either.
#include "engine/gpu/device_kernels.h"
#pragma passes READ COPY

layout(local_size_x = kBandwidthGroup) in;

layout(std430, binding = 0) readonly buffer Source { vec4 source[]; };
layout(std430, binding = 1) writeonly buffer Target { vec4 target[]; };

uniform int groups;
uniform int first;   // [vec4]
uniform int count;   // [vec4]

void main() {
  uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
  if (group >= uint(groups)) return;
  uint thread = group * kBandwidthGroup + gl_LocalInvocationID.x;
  uint threads = uint(groups) * kBandwidthGroup;
#ifdef COPY
  for (uint i = thread; i < uint(count); i += threads) target[i] = source[uint(first) + i];
#else
  vec4 a = vec4(0.0), b = vec4(0.0), c = vec4(0.0), d = vec4(0.0);
  uint i = uint(first) + thread, end = uint(first) + uint(count);
  for (; i + 3u * threads < end; i += 4u * threads) {
    a += source[i];
    b += source[i + threads];
    c += source[i + 2u * threads];
    d += source[i + 3u * threads];
  }
  for (; i < end; i += threads) a += source[i];
  target[thread] = (a + b) + (c + d);
#endif
}
