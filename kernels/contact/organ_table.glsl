// What the compute kernels of contact share: the table of touched organs, and how groups are
// numbered.
#include "kernels/contact/organ_table.h"

layout(std430, binding = 0) readonly buffer Table { OrganEntry table[]; };

uniform int groups;       // of this dispatch; the grid may hold more
uniform int first_entry;  // the dispatch's part of the table
uniform int entries;

uint group_index() {
  return gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
}

/// The organ that a group works on: the last one that begins at it or before.
OrganEntry organ_of(uint group) {
  uint low = uint(first_entry), high = low + uint(entries) - 1u;
  while (low < high) {
    uint middle = (low + high + 1u) / 2u;
    if (table[middle].first_group <= group) low = middle;
    else high = middle - 1u;
  }
  return table[low];
}
