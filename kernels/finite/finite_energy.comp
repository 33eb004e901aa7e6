// FiniteBody::energy (finite_body.h), in double precision as there. CELLS: a work group a cell, a
// thread a point of its packs: the energy and each point's stress by F. NODES: a work group a node:
// its force from the points that reach it. Sums go by halves in a fixed order: the same bits every
// time. Fibres and relaxation stay the CPU's.
#include "kernels/finite/finite_energy.h"
#pragma passes CELLS NODES

uniform int groups;  // of this dispatch; the grid may hold more

uint group_index() {
  return gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
}

#ifdef CELLS
layout(local_size_x = kCellGroup) in;
layout(std140, binding = 0) uniform Pass { FiniteEnergyParameters pass; };
layout(std430, binding = 0) readonly buffer CellBegin { uint cell_begin[]; };
layout(std430, binding = 1) readonly buffer CellOrigin { uint cell_origin[]; };
layout(std430, binding = 2) readonly buffer PackBegin { uint pack_begin[]; };
layout(std430, binding = 3) readonly buffer EntryNodes { uint entry_nodes[]; };
layout(std430, binding = 4) readonly buffer Gradients { float gradients[]; };
layout(std430, binding = 5) readonly buffer Weights { double weights[]; };
layout(std430, binding = 6) readonly buffer Psi { double psi[]; };
layout(std430, binding = 7) readonly buffer Change { double change[]; };  // growth; factor
layout(std430, binding = 8) readonly buffer Before { double before[]; };  // strains
layout(std430, binding = 9) readonly buffer Displacements { double displacements[]; };
layout(std430, binding = 10) buffer Stress { double stress[]; };  // F before it is known
layout(std430, binding = 11) writeonly buffer Energies { double energies[]; };

// The energy and four moments of dilatation; what follows from these is summed elsewhere, since a
// device was seen to mix both up.
shared double sums[10][kCellGroup];

/// Five rows of `sums` are each summed into their first place.
void sum_up(uint first) {
  uint id = gl_LocalInvocationID.x;
  for (uint half_of = kCellGroup / 2u; half_of > 0u; half_of /= 2u) {
    barrier();
    if (id < half_of)
      for (uint k = first; k < first + 5u; ++k) sums[k][id] += sums[k][id + half_of];
  }
  barrier();
}

/// E = (F^T F - 1) / 2 as xx, yy, zz; xy, yz, zx; F by its columns.
void green_strain(dvec3 x, dvec3 y, dvec3 z, out dvec3 direct, out dvec3 shear) {
  direct = 0.5lf * (dvec3(dot(x, x), dot(y, y), dot(z, z)) - 1.0lf);
  shear = 0.5lf * dvec3(dot(x, y), dot(y, z), dot(z, x));
}

dvec3 node_place(uint node) {
  return dvec3(displacements[3u * node], displacements[3u * node + 1u],
               displacements[3u * node + 2u]);
}

/// Three numbers of a point that lie four apart.
dvec3 stress_at(uint at) {
  return dvec3(stress[at], stress[at + 12u], stress[at + 24u]);
}

void store_columns(uint at, dvec3 x, dvec3 y, dvec3 z) {
  for (uint k = 0u; k < 3u; ++k) {
    dvec3 column = k == 0u ? x : k == 1u ? y : z;
    stress[at + 4u * k] = column.x;
    stress[at + 12u + 4u * k] = column.y;
    stress[at + 24u + 4u * k] = column.z;
  }
}

double psi_of(uint pack, uint k, uint lane) {
  return psi[16u * pack + 4u * k + lane];
}

/// How strains have changed within the step.
void strain_since(uint pack, uint lane, dvec3 x, dvec3 y, dvec3 z, out dvec3 direct,
                  out dvec3 shear) {
  green_strain(x, y, z, direct, shear);
  uint at = 24u * pack + lane;
  direct -= dvec3(before[at], before[at + 4u], before[at + 8u]);
  shear -= dvec3(before[at + 12u], before[at + 16u], before[at + 20u]);
}

void main() {
  uint cell = group_index();
  if (cell >= uint(groups)) return;
  uint id = gl_LocalInvocationID.x, lane = id % 4u;
  uint first = cell_begin[cell] + id / 4u, last = cell_begin[cell + 1u];
  const uint step = kCellGroup / 4u;
  dvec3 origin = node_place(cell_origin[cell]);

  double energy = 0.0lf, theta[4];
  for (uint k = 0u; k < 4u; ++k) theta[k] = 0.0lf;
  for (uint p = first; p < last; p += step) {
    dvec3 x = dvec3(1.0lf, 0.0lf, 0.0lf), y = dvec3(0.0lf, 1.0lf, 0.0lf),
          z = dvec3(0.0lf, 0.0lf, 1.0lf);  // columns of F
    for (uint e = pack_begin[p]; e < pack_begin[p + 1u]; ++e) {
      dvec3 u = node_place(entry_nodes[e]) - origin;
      uint at = 12u * e + lane;
      x += double(gradients[at]) * u;
      y += double(gradients[at + 4u]) * u;
      z += double(gradients[at + 8u]) * u;
    }
    store_columns(36u * p + lane, x, y, z);
    double w = weights[4u * p + lane], cubed = 1.0lf, sound = w;
    if (pass.viscous > 0.0lf) {
      dvec3 direct, shear;
      strain_since(p, lane, x, y, z, direct, shear);
      energy += w * pass.viscous * (dot(direct, direct) + 2.0lf * dot(shear, shear));
    }
    if (pass.changed != 0u) {
      double growth = change[8u * p + lane];
      x *= growth;
      y *= growth;
      z *= growth;
      w *= change[8u * p + 4u + lane];
      cubed = growth * growth * growth;
    }
    double grown = dot(x, cross(y, z)) - 1.0lf;
    energy += w * (0.5lf * pass.mu * (dot(x, x) + dot(y, y) + dot(z, z) - 3.0lf) -
                   pass.mu * grown + 0.5lf * (pass.lambda + pass.mu) * grown * grown);
    if (pass.averages != 0u)
      for (uint k = 0u; k < 4u; ++k)
        theta[k] += sound * psi_of(p, k, lane) * ((1.0lf + grown) / cubed - 1.0lf);
  }
  sums[4][id] = energy;
  for (uint k = 0u; k < 4u; ++k) sums[k][id] = theta[k];
  sum_up(0u);
  energy = sums[4][0];
  double pull[4];
  for (uint k = 0u; k < 4u; ++k) {
    theta[k] = sums[k][0];
    pull[k] = pass.averaged * theta[k];
    if (pass.averages != 0u && pass.changed == 0u) energy += 0.5lf * pull[k] * theta[k];
  }
  if (pass.averages != 0u && pass.changed != 0u) {
    double more = 0.0lf, by[4];
    for (uint k = 0u; k < 4u; ++k) by[k] = 0.0lf;
    for (uint p = first; p < last; p += step) {
      double growth = change[8u * p + lane], cubed = growth * growth * growth, dilated = 0.0lf;
      for (uint k = 0u; k < 4u; ++k) dilated += theta[k] * psi_of(p, k, lane);
      double stiff = pass.averaged * weights[4u * p + lane] * change[8u * p + 4u + lane];
      dilated = cubed * (1.0lf + dilated) - 1.0lf;
      more += 0.5lf * stiff * dilated * dilated;
      for (uint k = 0u; k < 4u; ++k) by[k] += stiff * dilated * cubed * psi_of(p, k, lane);
    }
    sums[9][id] = more;
    for (uint k = 0u; k < 4u; ++k) sums[5u + k][id] = by[k];
    sum_up(5u);
    energy += sums[9][0];
    for (uint k = 0u; k < 4u; ++k) pull[k] = sums[5u + k][0];
  }
  if (id == 0u) energies[cell] = energy;

  for (uint p = first; p < last; p += step) {
    uint at = 36u * p + lane;
    dvec3 x = stress_at(at), y = stress_at(at + 4u), z = stress_at(at + 8u);
    dvec3 sx = dvec3(0.0lf), sy = sx, sz = sx;
    double w = weights[4u * p + lane], averaging = w;
    if (pass.viscous > 0.0lf) {
      dvec3 direct, shear;
      strain_since(p, lane, x, y, z, direct, shear);
      double rate = 2.0lf * pass.viscous * w;
      sx = rate * (direct.x * x + shear.x * y + shear.z * z);
      sy = rate * (shear.x * x + direct.y * y + shear.y * z);
      sz = rate * (shear.z * x + shear.y * y + direct.z * z);
    }
    if (pass.changed != 0u) {
      double growth = change[8u * p + lane];
      x *= growth;
      y *= growth;
      z *= growth;
      w *= change[8u * p + 4u + lane] * growth;
      averaging /= growth * growth;
    }
    dvec3 cx = cross(y, z), cy = cross(z, x), cz = cross(x, y);
    double pressure =
        w * ((pass.lambda + pass.mu) * (dot(x, cx) - 1.0lf) - pass.mu);
    if (pass.averages != 0u)
      for (uint k = 0u; k < 4u; ++k) pressure += averaging * pull[k] * psi_of(p, k, lane);
    double stiff = w * pass.mu;
    store_columns(at, sx + stiff * x + pressure * cx, sy + stiff * y + pressure * cy,
                  sz + stiff * z + pressure * cz);
  }
}
#endif

#ifdef NODES
layout(local_size_x = kNodeGroup) in;
layout(std430, binding = 0) readonly buffer NodeBegin { uint node_begin[]; };
layout(std430, binding = 1) readonly buffer NodeEntries { uvec2 node_entries[]; };  // entry, pack
layout(std430, binding = 2) readonly buffer Gradients { float gradients[]; };
layout(std430, binding = 3) readonly buffer Stress { double stress[]; };
layout(std430, binding = 4) writeonly buffer Forces { double forces[]; };

shared double parts[3][kNodeGroup];

void main() {
  uint node = group_index();
  if (node >= uint(groups)) return;
  uint id = gl_LocalInvocationID.x;
  dvec3 force = dvec3(0.0lf);
  for (uint i = node_begin[node] + id; i < node_begin[node + 1u]; i += kNodeGroup) {
    uvec2 entry = node_entries[i];
    for (uint lane = 0u; lane < 4u; ++lane) {
      uint g = 12u * entry.x + lane, at = 36u * entry.y + lane;
      for (uint k = 0u; k < 3u; ++k)
        force += double(gradients[g + 4u * k]) *
                 dvec3(stress[at + 4u * k], stress[at + 12u + 4u * k], stress[at + 24u + 4u * k]);
    }
  }
  parts[0][id] = force.x;
  parts[1][id] = force.y;
  parts[2][id] = force.z;
  for (uint half_of = kNodeGroup / 2u; half_of > 0u; half_of /= 2u) {
    barrier();
    if (id < half_of)
      for (uint k = 0u; k < 3u; ++k) parts[k][id] += parts[k][id + half_of];
  }
  if (id == 0u)
    for (uint k = 0u; k < 3u; ++k) forces[3u * node + k] = parts[k][0];
}
#endif
