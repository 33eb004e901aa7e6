// prepare_brick (PREPARE) and find_rates (RATES) of bioheat_passes.h.
layout(std430, binding = 1) readonly buffer Excess { float excess[]; };
layout(std430, binding = 2) readonly buffer Geometry { float geometry[]; };

#ifdef PREPARE
layout(std430, binding = 3) readonly buffer Water { float water[]; };
layout(std430, binding = 4) readonly buffer Damage { float damage[]; };
layout(std430, binding = 5) readonly buffer Charred { float charred[]; };
layout(std430, binding = 6) writeonly buffer Conductivity { float conductivity[]; };
layout(std430, binding = 7) writeonly buffer InverseCapacity { float inverse_capacity[]; };
layout(std430, binding = 8) writeonly buffer Living { float living[]; };

void main() {
  uint group = group_index();
  if (group >= uint(groups)) return;
  uint lane = gl_LocalInvocationID.x;
  uint i = uint(table[group].slot) * VOXELS + lane;
  float fraction = geometry[uint(table[group].geometry) * GEOMETRY + lane];
  float w = water[i], t = excess[i];
  float conducts =
      (pass.dry_conductivity + (pass.wet_conductivity - pass.dry_conductivity) * w) *
      (1.0 + pass.conductivity_slope * clamp(t, 0.0, pass.boiling));
  // Where the front of drying is, the sign says so.
  bool front = w > 0.0 && w < 1.0 && t >= AT_BOILING * pass.boiling;
  conductivity[i] = front ? -conducts : conducts;
  float capacity = fraction * (pass.solids_capacity * (1.0 - pass.lost_solids * charred[i]) +
                               pass.water_capacity * w);
  inverse_capacity[i] = capacity > 0.0 ? 1.0 / capacity : 0.0;
  living[i] = fraction * exponential(-damage[i]);
}
#endif

#ifdef RATES
layout(std430, binding = 3) readonly buffer Source { float source[]; };
layout(std430, binding = 4) readonly buffer Conductivity { float conductivity[]; };
layout(std430, binding = 5) readonly buffer InverseCapacity { float inverse_capacity[]; };
layout(std430, binding = 6) readonly buffer Living { float living[]; };
layout(std430, binding = 7) readonly buffer Sums { HeatSums sums[]; };
layout(std430, binding = 8) writeonly buffer Rate { float rate[]; };
layout(std430, binding = 9) writeonly buffer Flows { vec4 flows[]; };  // by slot: HeatFlows of a brick

shared vec4 parts[VOXELS];

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
  uint slot = uint(brick.slot), i = slot * VOXELS + lane;
  uint x = lane % EDGE, y = lane / EDGE % EDGE, z = lane / LAYER;
  uint place = uint(brick.geometry) * GEOMETRY;
  uint open_x = place + OPEN_X + x + 9u * (y + EDGE * z);
  uint open_y = place + OPEN_Y + x + EDGE * (y + 9u * z);
  uint open_z = place + OPEN_Z + lane;
  uint open[6] = uint[6](open_x, open_x + 1u, open_y, open_y + EDGE, open_z, open_z + LAYER);
  bool inside[6] = bool[6](x > 0u, x < 7u, y > 0u, y < 7u, z > 0u, z < 7u);
  uint stride[6] = uint[6](1u, 1u, EDGE, EDGE, LAYER, LAYER);
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
      uint across = 7u * stride[side];
      uint at = uint(brick.beside[side]) * VOXELS + (up ? lane - across : lane + across);
      other_t = excess[at];
      other_k = conductivity[at];
    } else if (sums[slot].border[side] > pass.followed) {
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
  rate[i] = (pass.inverse_square * flow + q - pass.drain * felt) * inverse;
  parts[lane] = vec4(felt, leak, q, (pass.inverse_square * links + pass.drain * alive) * inverse);
  for (uint half_way = VOXELS / 2u; half_way > 0u; half_way /= 2u) {
    barrier();
    if (lane < half_way) {
      vec4 a = parts[lane], b = parts[lane + half_way];
      parts[lane] = vec4(a.xyz + b.xyz, max(a.w, b.w));
    }
  }
  if (lane == 0u) flows[slot] = parts[0];
}
#endif
