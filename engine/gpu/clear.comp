// Words of zero at a buffer's start: a dispatch like others, so that barriers know of it.
#include "engine/gpu/device_kernels.h"

layout(local_size_x = kClearGroup) in;
layout(std430, binding = 0) writeonly buffer Words { uint words[]; };

uniform int groups;
uniform int count;

void main() {
  uint i = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * kClearGroup +
           gl_LocalInvocationID.x;
  if (i < uint(count)) words[i] = 0u;
}
