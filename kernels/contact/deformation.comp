// deform_drawn_surface (deformation.h) for all touched organs at once, in three passes: CARRY takes
// displacements from places to vertices, NEAR adds the near field, which the CPU computes, to the
// few vertices that feel it, NORMALS makes normals from the deformed triangles.
//
// Rows of different length (a vertex's carriers, its triangles) lie in slices of kSlice vertices:
// first entry of all of them, second entry of all ..., padded to the longest with entries that add
// nothing, so that neighbouring threads read neighbouring words.
#include "kernels/contact/organ_table.glsl"
#pragma passes CARRY NEAR NORMALS

#ifdef NEAR

layout(local_size_x = kSurfaceGroup) in;
layout(std430, binding = 1) readonly buffer Near { uvec4 near_field[]; };  // vertex; x, y, z [m]
layout(std430, binding = 2) buffer Positions { float positions[]; };

void main() {
  uint at = group_index() * kSurfaceGroup + gl_LocalInvocationID.x;
  if (at >= uint(entries)) return;
  vec3 moved = uintBitsToFloat(near_field[at].yzw);
  uint place = 3u * near_field[at].x;
  positions[place] += moved.x;
  positions[place + 1u] += moved.y;
  positions[place + 2u] += moved.z;
}

#else

layout(local_size_x = kSurfaceGroup) in;
layout(std430, binding = 1) readonly buffer SliceBegin { uint slice_begin[]; };
layout(std430, binding = 2) readonly buffer Entries { uvec2 row_entries[]; };

#ifdef CARRY
layout(std430, binding = 3) readonly buffer Displacements { float displacements[]; };
layout(std430, binding = 4) readonly buffer Rest { float rest[]; };
layout(std430, binding = 5) writeonly buffer Positions { float positions[]; };

/// An entry: place, weight.
void work(OrganEntry organ, uint vertex, uint slice, uint lane) {
  vec3 moved = vec3(0.0);
  for (uint e = slice_begin[slice] + lane; e < slice_begin[slice + 1u]; e += kSlice) {
    uint place = organ.displacement + 3u * row_entries[e].x;
    moved += uintBitsToFloat(row_entries[e].y) *
             vec3(displacements[place], displacements[place + 1u], displacements[place + 2u]);
  }
  uint from = 3u * (slice * kSlice + lane), to = 3u * (organ.first_vertex + vertex);
  positions[to] = rest[from] + moved.x;
  positions[to + 1u] = rest[from + 1u] + moved.y;
  positions[to + 2u] = rest[from + 2u] + moved.z;
}

#else  // NORMALS
layout(std430, binding = 3) readonly buffer Positions { float positions[]; };
layout(std430, binding = 4) writeonly buffer Normals { float normals[]; };

/// acos(cosine) to 7e-5: [Abramowitz1964] 4.4.45, as in deformation.cpp.
float angle_of(float cosine) {
  float x = min(abs(cosine), 1.0);
  float angle =
      sqrt(1.0 - x) * (1.5707288 + x * (-0.2121144 + x * (0.0742610 - x * 0.0187293)));
  return cosine >= 0.0 ? angle : 3.14159265358979 - angle;
}

vec3 position_of(uint vertex) {
  return vec3(positions[3u * vertex], positions[3u * vertex + 1u], positions[3u * vertex + 2u]);
}

/// An entry: the other two corners of a triangle. Padding repeats the vertex: no area, no share.
void work(OrganEntry organ, uint vertex, uint slice, uint lane) {
  vec3 here = position_of(organ.first_vertex + vertex);
  vec3 sum = vec3(0.0);
  for (uint e = slice_begin[slice] + lane; e < slice_begin[slice + 1u]; e += kSlice) {
    vec3 u = position_of(organ.first_vertex + row_entries[e].x) - here;
    vec3 v = position_of(organ.first_vertex + row_entries[e].y) - here;
    vec3 area_vector = cross(u, v);
    float twice_area = length(area_vector);
    if (twice_area > 0.0) {
      sum += area_vector * (angle_of(dot(u, v) / sqrt(dot(u, u) * dot(v, v))) / twice_area);
    }
  }
  float size = length(sum);
  vec3 normal = size > 0.0 ? sum / size : vec3(0.0, 0.0, 1.0);
  uint to = 3u * (organ.first_vertex + vertex);
  normals[to] = normal.x;
  normals[to + 1u] = normal.y;
  normals[to + 2u] = normal.z;
}
#endif

void main() {
  uint group = group_index();
  if (group >= uint(groups)) return;
  OrganEntry organ = organ_of(group);
  uint vertex = (group - organ.first_group) * kSurfaceGroup + gl_LocalInvocationID.x;
  if (vertex >= organ.vertices) return;
  work(organ, vertex, organ.first_slice + vertex / kSlice, vertex % kSlice);
}

#endif
