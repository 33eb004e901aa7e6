// What the kernels of heat share: the numbers of an organ, the table of its warm bricks, and how
// threads are numbered: a work group is a brick, a thread a voxel.
#include "kernels/heat/brick_layout.h"
#include "kernels/heat/heat_device.h"
#include "kernels/heat/heat_parameters.h"

layout(std140, binding = 0) uniform Pass { HeatParameters pass; };

layout(std430, binding = 0) readonly buffer Table { HeatEntry table[]; };

layout(local_size_x = kBrickVoxels) in;
uniform int groups;  // of this dispatch; the grid may hold more

uint group_index() {
  return gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
}

/// e^x as lanes_math.h has it.
float exponential(float x) {
  x = clamp(x, -87.0, 88.0);
  float halves = roundEven(x * 1.44269504);
  precise float high = x - halves * 0.693359375;
  float r = high - halves * -2.12194440e-4;
  float p = r * 1.9875691500e-4 + 1.3981999507e-3;
  p = p * r + 8.3334519073e-3;
  p = p * r + 4.1665795894e-2;
  p = p * r + 1.6666665459e-1;
  p = p * r + 5.0000001201e-1;
  p = p * (r * r) + r + 1.0;
  return p * intBitsToFloat((int(halves) + 127) << 23);
}

/// e^x - 1, without the cancellation near 0.
float exponential_less_one(float x) {
  if (abs(x) > 0.4) return exponential(x) - 1.0;
  return x * (1.0 + x / 2.0 * (1.0 + x / 3.0 * (1.0 + x / 4.0 * (1.0 + x / 5.0 *
         (1.0 + x / 6.0 * (1.0 + x / 7.0))))));
}
