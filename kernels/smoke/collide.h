// Particles against surfaces, instruments and what they leave on them.
#pragma once

#include <cstdint>
#include <span>

#include "kernels/smoke/surface_cells.h"

namespace viscera {

struct CollideCounts {
  std::uint64_t tested = 0;    ///< particles in cells near a surface: only they are looked at
  std::uint64_t touching = 0;  ///< nearer than `touch`
  std::uint64_t trapped = 0;   ///< between overlapping surfaces: all of their smoke deposits
  double deposited = 0.0;      ///< mass that touching particles left [kg]
};

/// Each particle in a cell of `cells` looks for the nearest point of every surface and capsule
/// there, outside or inside by pseudo-normals [Baerentzen2005]. One nearer than the gap is put on
/// the outside at that distance, whatever the depth, and loses its inward velocity relative to the
/// surface. One that touches loses a share of its tangential velocity and of its smoke. One that is
/// still inside something after so many rounds has no room left: its fate is `deposited`.
CollideCounts collide(std::span<Float4> positions, std::span<Float4> velocities,
                      std::span<float> masses, const SurfaceCells& cells,
                      std::span<const SmokeCapsule> capsules, const CollideParameters& parameters,
                      std::span<SmokeFate> fates);

}  // namespace viscera
