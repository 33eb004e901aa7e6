// bin (bin.h): a counting sort of the particles by cell, in the order of the CPU's. COUNT numbers
// the particles of each cell as they come, scan.comp finds where each cell begins, SCATTER writes
// the particles' numbers there, and GATHER, which finds each one's rank among the numbers of its
// cell, moves the particles: whatever came first, the outcome is the stable order.
#include "kernels/smoke/smoke_passes.glsl"
#pragma passes COUNT MARK SCATTER GATHER

layout(std140, binding = 0) uniform Pass { BinParameters grid; };

#ifdef COUNT
layout(std430, binding = 0) readonly buffer Positions { vec4 positions[]; };
layout(std430, binding = 1) writeonly buffer Places { uvec2 places[]; };  // cell, number in it
layout(std430, binding = 2) buffer Counts { uint counts[]; };             // of each cell

void main() {
  uint i = thread_index();
  if (i >= grid.particles) return;
  uint cell = cell_number(positions[i].xyz, grid.origin.xyz, grid.inverse_cell, grid.size.xyz);
  places[i] = uvec2(cell, atomicAdd(counts[cell], 1u));
}
#endif

#ifdef MARK
// Which cells hold particles, a bit each, one pace (surface_cells.h) after another.
layout(std430, binding = 0) readonly buffer Positions { vec4 positions[]; };
layout(std430, binding = 1) buffer Occupied { uint occupied[]; };
layout(std430, binding = 2) readonly buffer Velocities { vec4 velocities[]; };

uniform float fastest_square;  // [m2/s2]

uint pace_of(float square) {
  uint pace = 0u;
  for (float limit = fastest_square / (kPaceRatio * kPaceRatio);
       pace + 1u < kPaces && square <= limit; limit /= kPaceRatio * kPaceRatio)
    ++pace;
  return pace;
}

void main() {
  uint i = thread_index();
  if (i >= grid.particles) return;
  uint cell = cell_number(positions[i].xyz, grid.origin.xyz, grid.inverse_cell, grid.size.xyz);
  uint words = (uint(grid.size.w) + 31u) / 32u;
  uint word = pace_of(dot(velocities[i].xyz, velocities[i].xyz)) * words + (cell >> 5);
  uint bit = 1u << (cell & 31u);
  if ((occupied[word] & bit) == 0u) atomicOr(occupied[word], bit);
}
#endif

#ifdef SCATTER
layout(std430, binding = 0) readonly buffer Places { uvec2 places[]; };
layout(std430, binding = 1) readonly buffer CellBegin { uint cell_begin[]; };
layout(std430, binding = 2) writeonly buffer Slots { uint slots[]; };

void main() {
  uint i = thread_index();
  if (i >= grid.particles) return;
  slots[cell_begin[places[i].x] + places[i].y] = i;
}
#endif

#ifdef GATHER
layout(std430, binding = 0) readonly buffer Places { uvec2 places[]; };
layout(std430, binding = 1) readonly buffer CellBegin { uint cell_begin[]; };
layout(std430, binding = 2) readonly buffer Slots { uint slots[]; };
layout(std430, binding = 3) readonly buffer Positions { vec4 positions[]; };
layout(std430, binding = 4) readonly buffer Velocities { vec4 velocities[]; };
layout(std430, binding = 5) readonly buffer Masses { float masses[]; };
layout(std430, binding = 6) readonly buffer Ids { uint ids[]; };
layout(std430, binding = 7) writeonly buffer SortedPositions { vec4 sorted_positions[]; };
layout(std430, binding = 8) writeonly buffer SortedVelocities { vec4 sorted_velocities[]; };
layout(std430, binding = 9) writeonly buffer SortedMasses { float sorted_masses[]; };
layout(std430, binding = 10) writeonly buffer SortedIds { uint sorted_ids[]; };

void main() {
  uint slot = thread_index();
  if (slot >= grid.particles) return;
  uint i = slots[slot];
  uint cell = places[i].x;
  uint to = cell_begin[cell], last = cell_begin[cell + 1u];
  for (uint k = cell_begin[cell]; k < last; ++k) to += slots[k] < i ? 1u : 0u;
  sorted_positions[to] = positions[i];
  sorted_velocities[to] = velocities[i];
  sorted_masses[to] = masses[i];
  sorted_ids[to] = ids[i];
}
#endif
