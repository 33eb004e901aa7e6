// What the compute kernels of smoke share: smoke_passes.h and cell_of (bin.h) as GLSL sees them, and
// how threads are numbered. Padding at a struct's end is left out.
struct BinParameters {
  vec4 origin;
  ivec4 size;
  float inverse_cell;
  uint particles;
};

struct ViscosityParameters {
  float inverse_square;
  float viscosity;
  float crowding;
  float fill;
  float most_excess;
  float gas_drag;
  uint fewest_neighbours;
  uint laplacian;
  float step;
  uint particles;
};

struct SwirlWave {
  vec4 amplitude;
  vec4 wave_number;
};

struct IntegrateParameters {
  vec4 extent;
  float step;
  float white;
  float lift;
  float plume_turbulence;
  float cooling;
  float parcel_mass;
  uint seed;
  uint substep;
  uint open_sides;
  uint waves;
  uint particles;
  float entrainment;
};

struct SurfaceTriangle {
  vec4 corners[3];
  vec4 motion[3];
  vec4 normals[7];
};

struct SmokeCapsule {
  vec4 from;
  vec4 to;
  vec4 from_motion;
  vec4 to_motion;
};

struct CollideParameters {
  vec4 origin;
  ivec4 size;
  float inverse_cell;
  float gap;
  float friction;
  float touch;
  float kept;
  uint capsules;
  uint particles;
  uint rounds;
  vec4 extent;
  uint open_sides;
};

struct SplatParameters {
  ivec4 size;
  float inverse_voxel;
  float first_square;
  float growth;
  float widest_square;
  float mass_scale;
  float heat_scale;
  float momentum_scale;
  uint particles;
};

layout(local_size_x = GROUP) in;
uniform int groups;  // of this dispatch; the grid may hold more

uint group_index() {
  return gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
}
/// The particle or cell of a thread.
uint thread_index() {
  return group_index() * GROUP + gl_LocalInvocationID.x;
}

/// `precise` here and elsewhere: what decides, where a particle belongs or whether it is in reach,
/// is rounded as on the CPU, without contraction to fused operations.
int cell_along(float x, float origin, float inverse_cell, int size) {
  precise float cell = (x - origin) * inverse_cell;
  return int(min(max(1.0, cell), float(size) - 1.5));
}

uint cell_number(vec3 at, vec3 origin, float inverse_cell, ivec3 size) {
  int x = cell_along(at.x, origin.x, inverse_cell, size.x);
  int y = cell_along(at.y, origin.y, inverse_cell, size.y);
  int z = cell_along(at.z, origin.z, inverse_cell, size.z);
  return uint(x + size.x * (y + size.y * z));
}
