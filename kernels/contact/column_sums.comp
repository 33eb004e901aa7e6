// sum_column_triples (column_sums.h) for all touched organs at once.
//
// Columns lie in tiles of 4 kTileLanes rows, column after column: what a group reads of a triple of
// columns is one stretch of memory, and a compliance can be split between tiles. A group sums one
// tile: each lane four rows, each of kLoadParts threads a lane its share of the loads, so that
// there are enough reads under way to fill the memory's pipe. The parts are added in a fixed order:
// the same bits every time. HALF: columns in half precision, the twin of half_columns.h; their scale
// is in the loads.
#include "kernels/contact/organ_table.glsl"
#pragma passes SINGLE HALF

layout(local_size_x = kTileLanes, local_size_y = kLoadParts) in;

#ifdef HALF
layout(std430, binding = 1) readonly buffer Columns { uvec2 columns[]; };
vec4 four_rows(uint at) {
  uvec2 packed_rows = columns[at];
  return vec4(unpackHalf2x16(packed_rows.x), unpackHalf2x16(packed_rows.y));
}
#else
layout(std430, binding = 1) readonly buffer Columns { vec4 columns[]; };
vec4 four_rows(uint at) {
  return columns[at];
}
#endif
layout(std430, binding = 2) readonly buffer Loads { uvec4 loads[]; };  // x, y, z [N], triple
layout(std430, binding = 3) writeonly buffer Displacements { vec4 displacements[]; };

shared vec4 sums[kLoadParts][kTileLanes];

vec4 under_load(uint tile, uvec4 load) {
  uint at = tile + load.w * (3u * kTileLanes);
  vec3 force = uintBitsToFloat(load.xyz);
  return four_rows(at) * force.x + four_rows(at + kTileLanes) * force.y +
         four_rows(at + 2u * kTileLanes) * force.z;
}

void main() {
  uint group = group_index();
  if (group >= uint(groups)) return;
  OrganEntry organ = organ_of(group);
  uint lane = gl_LocalInvocationID.x, part = gl_LocalInvocationID.y;
  uint tile = organ.first_tile + (group - organ.first_group) * organ.tile_stride + lane;

  vec4 sum = vec4(0.0);
  uint j = organ.first_load + part, end = organ.first_load + organ.loads;
  for (; j + kLoadParts < end; j += 2u * kLoadParts) {
    sum += under_load(tile, loads[j]) + under_load(tile, loads[j + kLoadParts]);
  }
  if (j < end) sum += under_load(tile, loads[j]);
  sums[part][lane] = sum;
  barrier();

  if (part > 0u) return;
  for (uint p = 1u; p < kLoadParts; ++p) sum += sums[p][lane];
  displacements[organ.displacement / 4u + (group - organ.first_group) * kTileLanes + lane] = sum;
}
