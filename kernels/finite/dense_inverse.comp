// y = A x for a dense, symmetric A in half precision, as a factor that preconditions (CompactFactor)
// answers: a row by 32 threads. A triangular solve goes from front to front, and a GPU waits for each;
// a product with the inverse reads more and waits for nothing.
#include "kernels/finite/finite_energy.h"

layout(local_size_x = 32, local_size_y = kRowsAtOnce) in;
layout(std430, binding = 0) readonly buffer Matrix { uvec4 matrix[]; };  // eight columns each
layout(std430, binding = 1) readonly buffer Vector { vec4 vector[]; };
layout(std430, binding = 2) writeonly buffer Product { float product[]; };

uniform int groups;  // of this dispatch; the grid may hold more
uniform int eights;  // of columns

shared float parts[kRowsAtOnce][32];

float of_four(uint low, uint high, vec4 x) {
  return dot(vec4(unpackHalf2x16(low), unpackHalf2x16(high)), x);
}

void main() {
  uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
  if (group >= uint(groups)) return;
  uint id = gl_LocalInvocationID.x, y = gl_LocalInvocationID.y;
  uint row = group * kRowsAtOnce + y, begin = row * uint(eights);
  float sum = 0.0;
  for (uint c = id; c < uint(eights); c += 32u) {
    uvec4 entries = matrix[begin + c];
    sum += of_four(entries.x, entries.y, vector[2u * c]) +
           of_four(entries.z, entries.w, vector[2u * c + 1u]);
  }
  parts[y][id] = sum;
  for (uint half_of = 16u; half_of > 0u; half_of /= 2u) {
    barrier();
    if (id < half_of) parts[y][id] += parts[y][id + half_of];
  }
  if (id == 0u) product[row] = parts[y][0];
}
