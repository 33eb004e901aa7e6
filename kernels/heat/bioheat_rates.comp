// prepare_brick (PREPARE) and find_rates (RATES) of bioheat_passes.h.
#include "kernels/heat/heat_passes.glsl"
#pragma passes PREPARE RATES

layout(std430, binding = 1) readonly buffer Excess { float excess[]; };
layout(std430, binding = 2) readonly buffer Geometry { float geometry[]; };

#ifdef PREPARE
layout(std430, binding = 3) readonly buffer Water { float water[]; };
layout(std430, binding = 4) readonly buffer Coagulation { float coagulation[]; };
layout(std430, binding = 5) readonly buffer Charred { float charred[]; };
layout(std430, binding = 6) writeonly buffer Conductivity { float conductivity[]; };
layout(std430, binding = 7) writeonly buffer InverseCapacity { float inverse_capacity[]; };
layout(std430, binding = 8) writeonly buffer Living { float living[]; };

void main() {
  uint group = group_index();
  if (group >= uint(groups)) return;
  uint lane = gl_LocalInvocationID.x;
  uint i = uint(table[group].slot) * kBrickVoxels + lane;
  uint place = uint(table[group].geometry) * kGeometryWords;
  float fraction = geometry[place + lane];
  float w = water[i], t = excess[i];
  float conducts =
      (pass.numbers.dry_conductivity +
       (pass.numbers.wet_conductivity - pass.numbers.dry_conductivity) * w) *
      (1.0 + pass.numbers.conductivity_slope * clamp(t, 0.0, pass.numbers.boiling));
  // Where the front of drying is, the sign says so.
  bool front = w > 0.0 && w < 1.0 && t >= kAtBoiling * pass.numbers.boiling;
  conductivity[i] = front ? -conducts : conducts;
  float capacity =
      fraction * (pass.numbers.solids_capacity * (1.0 - pass.numbers.lost_solids * charred[i]) +
                  pass.numbers.water_capacity * w);
  inverse_capacity[i] = capacity > 0.0 ? 1.0 / capacity : 0.0;
  living[i] = fraction * exponential(-coagulation[i]) * geometry[place + kPerfused + lane];
}
#endif

#ifdef RATES
layout(std430, binding = 3) readonly buffer Source { float source[]; };
layout(std430, binding = 4) readonly buffer Conductivity { float conductivity[]; };
layout(std430, binding = 5) readonly buffer InverseCapacity { float inverse_capacity[]; };
layout(std430, binding = 6) readonly buffer Living { float living[]; };
layout(std430, binding = 7) readonly buffer Sums { HeatSums sums[]; };
layout(std430, binding = 8) writeonly buffer Rate { float rate[]; };
layout(std430, binding = 9) writeonly buffer Flows { BrickFlows flows[]; };  // by slot

shared vec4 parts[kBrickVoxels];

/// As the two voxels lie on either side of a front of drying or not; see rate_rows.
float conductance(float own, float other) {
  float size = abs(own), other_size = abs(other);
  float series = 2.0 * (size * other_size) / (size + other_size);
  if (own < 0.0) return other < 0.0 ? series : other_size;
  return other < 0.0 ? size : series;
}

void main() {
  uint group = group_index();
  if (group >= uint(groups)) return;
  uint lane = gl_LocalInvocationID.x;
  HeatEntry brick = table[group];
  uint slot = uint(brick.slot), i = slot * kBrickVoxels + lane;
  uint x = lane % kBrickEdge, y = lane / kBrickEdge % kBrickEdge, z = lane / kBrickLayer;
  uint place = uint(brick.geometry) * kGeometryWords;
  uint open_x = place + kOpenX + x + kBrickRow * (y + kBrickEdge * z);
  uint open_y = place + kOpenY + x + kBrickEdge * (y + kBrickRow * z);
  uint open_z = place + kOpenZ + lane;
  uint open[6] =
      uint[6](open_x, open_x + 1u, open_y, open_y + kBrickEdge, open_z, open_z + kBrickLayer);
  const uint last = kBrickEdge - 1u;
  bool inside[6] = bool[6](x > 0u, x < last, y > 0u, y < last, z > 0u, z < last);
  uint stride[6] = uint[6](1u, 1u, kBrickEdge, kBrickEdge, kBrickLayer, kBrickLayer);
  float t = excess[i], k = conductivity[i];
  float flow = 0.0, links = 0.0, leak = 0.0;
  for (int side = 0; side < 6; ++side) {
    bool up = (side & 1) == 1;
    float share = geometry[open[side]], other_t = t, other_k = k;
    if (inside[side]) {
      uint at = up ? i + stride[side] : i - stride[side];
      other_t = excess[at];
      other_k = conductivity[at];
    } else if (brick.beside[side] >= 0) {
      // The same place along the side, in the opposite layer.
      uint across = last * stride[side];
      uint at = uint(brick.beside[side]) * kBrickVoxels + (up ? lane - across : lane + across);
      other_t = excess[at];
      other_k = conductivity[at];
    } else if (sums[slot].border[side] > pass.numbers.followed) {
      other_t = 0.0;
      leak += share * abs(k) * t;
    }
    float link = share * conductance(k, other_k);
    flow += link * (other_t - t);
    links += link;
  }
  float q = brick.heated != 0 ? source[i] : 0.0;
  float inverse = inverse_capacity[i], alive = living[i];
  float felt = alive * t;
  rate[i] = (pass.numbers.inverse_square * flow + q - pass.numbers.drain * felt) * inverse;
  parts[lane] =
      vec4(felt, leak, q,
           (pass.numbers.inverse_square * links + pass.numbers.drain * alive) * inverse);
  for (uint half_way = kBrickVoxels / 2u; half_way > 0u; half_way /= 2u) {
    barrier();
    if (lane < half_way) {
      vec4 a = parts[lane], b = parts[lane + half_way];
      parts[lane] = vec4(a.xyz + b.xyz, max(a.w, b.w));
    }
  }
  if (lane == 0u) flows[slot] = BrickFlows(parts[0].x, parts[0].y, parts[0].z, parts[0].w);
}
#endif
