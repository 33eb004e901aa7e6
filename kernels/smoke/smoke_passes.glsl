// What the compute kernels of smoke share: cell_of (bin.h) as GLSL sees it, and how threads are
// numbered.
#include "kernels/smoke/smoke_device.h"
#include "kernels/smoke/smoke_passes.h"

layout(local_size_x = kSmokeGroup) in;
uniform int groups;  // of this dispatch; the grid may hold more

uint group_index() {
  return gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
}
/// The particle or cell of a thread.
uint thread_index() {
  return group_index() * kSmokeGroup + gl_LocalInvocationID.x;
}

/// `precise` here and elsewhere: what decides, where a particle belongs or whether it is in reach,
/// is rounded as on the CPU, without contraction to fused operations.
int cell_along(float x, float origin, float inverse_cell, int size) {
  precise float cell = (x - origin) * inverse_cell;
  return int(min(max(1.0, cell), float(size) - 1.5));
}

uint cell_number(vec3 at, vec3 origin, float inverse_cell, ivec3 size) {
  int x = cell_along(at.x, origin.x, inverse_cell, size.x);
  int y = cell_along(at.y, origin.y, inverse_cell, size.y);
  int z = cell_along(at.z, origin.z, inverse_cell, size.z);
  return uint(x + size.x * (y + size.y * z));
}
