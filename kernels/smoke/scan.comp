// Where each cell's particles begin: the exclusive prefix sum of the cells' counts, in three
// dispatches. BLOCKS does blocks of kScanBlock cells, TOTALS (one group) their totals, ADD adds
// those to the blocks.
#include "kernels/smoke/smoke_passes.glsl"
#pragma passes BLOCKS TOTALS ADD

uniform int count;  // cells; TOTALS: blocks

#ifdef ADD
layout(std430, binding = 0) readonly buffer Totals { uint totals[]; };
layout(std430, binding = 1) buffer Begin { uint begin[]; };

void main() {
  uint cell = thread_index();
  if (cell > uint(count)) return;  // one past the last cell: the end
  if (cell < uint(count)) {
    begin[cell] += totals[cell / kScanBlock];
  } else {
    begin[cell] = totals[(uint(count) + kScanBlock - 1u) / kScanBlock];
  }
}

#else

shared uint sums[kSmokeGroup];

/// The sum over the threads before this one.
uint sum_before(uint value, out uint total) {
  uint lane = gl_LocalInvocationID.x;
  sums[lane] = value;
  barrier();
  for (uint reach = 1u; reach < kSmokeGroup; reach *= 2u) {
    uint below = lane >= reach ? sums[lane - reach] : 0u;
    barrier();
    sums[lane] += below;
    barrier();
  }
  uint before = sums[lane] - value;
  total = sums[kSmokeGroup - 1u];
  barrier();
  return before;
}

#ifdef BLOCKS
layout(std430, binding = 0) readonly buffer Counts { uint counts[]; };
layout(std430, binding = 1) writeonly buffer Begin { uint begin[]; };
layout(std430, binding = 2) writeonly buffer Totals { uint totals[]; };

void main() {
  uint group = group_index();
  if (group >= uint(groups)) return;
  uint first = (group * kSmokeGroup + gl_LocalInvocationID.x) * kScanEach;
  uint before[kScanEach];
  uint own = 0u;
  for (uint k = 0u; k < kScanEach; ++k) {
    before[k] = own;
    own += first + k < uint(count) ? counts[first + k] : 0u;
  }
  uint total;
  uint start = sum_before(own, total);
  for (uint k = 0u; k < kScanEach; ++k) {
    if (first + k < uint(count)) begin[first + k] = start + before[k];
  }
  if (gl_LocalInvocationID.x == 0u) totals[group] = total;
}
#endif

#ifdef TOTALS
layout(std430, binding = 0) buffer Totals { uint totals[]; };  // one more than there are blocks

void main() {
  if (group_index() > 0u) return;
  uint carry = 0u;
  for (uint base = 0u; base < uint(count); base += kSmokeGroup) {
    uint at = base + gl_LocalInvocationID.x;
    uint own = at < uint(count) ? totals[at] : 0u;
    uint total;
    uint start = carry + sum_before(own, total);
    if (at < uint(count)) totals[at] = start;
    carry += total;
  }
  if (gl_LocalInvocationID.x == 0u) totals[count] = carry;
}
#endif
#endif
