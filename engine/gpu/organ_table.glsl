// Where each touched organ's work begins in a dispatch over all of them; OrganEntry in
// engine/gpu/gpu_deformation.cpp.
struct OrganEntry {
  uint first_group;   // of this dispatch
  uint first_tile;    // its columns: where its first tile begins, in fours of rows
  uint tile_stride;   // from tile to tile, likewise
  uint displacement;  // its first displacement component
  uint first_load;
  uint loads;
  uint vertices;
  uint first_slice;   // its carriers and its neighbours, in slices of SLICE vertices
  uint first_vertex;  // its positions and normals
  uint unused[3];
};
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
