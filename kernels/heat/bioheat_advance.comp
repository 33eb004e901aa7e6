// advance_brick (ADVANCE) and advance_stage (STAGE) of bioheat_passes.h.
#include "kernels/heat/heat_passes.glsl"
#pragma passes ADVANCE STAGE

layout(std430, binding = 1) readonly buffer Rate { float rate[]; };
layout(std430, binding = 2) buffer Excess { float excess[]; };
layout(std430, binding = 3) buffer Before { float before[]; };

#ifdef ADVANCE
uniform float dt;

void main() {
  uint group = group_index();
  if (group >= uint(groups)) return;
  uint i = uint(table[group].slot) * kBrickVoxels + gl_LocalInvocationID.x;
  float t = excess[i];
  before[i] = t;
  excess[i] = t + dt * rate[i];
}
#endif

#ifdef STAGE
layout(std430, binding = 4) buffer FirstRate { float first_rate[]; };
layout(std430, binding = 5) buffer Older { float older[]; };

uniform int begins;  // this is the first stage
uniform float newest_share, older_share, first_share, slope, first_slope;

void main() {
  uint group = group_index();
  if (group >= uint(groups)) return;
  uint i = uint(table[group].slot) * kBrickVoxels + gl_LocalInvocationID.x;
  float t = excess[i], now = rate[i];
  if (begins != 0) {
    before[i] = t;
    first_rate[i] = now;
    older[i] = t;
  }
  float next = newest_share * t + older_share * older[i] + first_share * before[i] + slope * now +
               first_slope * first_rate[i];
  older[i] = t;
  excess[i] = next;
}
#endif
