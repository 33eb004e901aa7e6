// A block whose ends are held flat and pulled apart by a tenth, cut in some way after its nodes
// were placed: what it is softer by is known from finite elements.
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "kernels/paff/galerkin.h"
#include "kernels/parting/tissue_share.h"
#include "kernels/points/cloud.h"

namespace viscera {

struct CutBlock {
  static constexpr double kLength = 60e-3, kWidth = 40e-3, kHeight = 20e-3;  // x, y, z [m]
  static constexpr double kEachEnd = 3e-3;                                   // along x [m]
  static constexpr IsotropicMaterial kTissue{5e3, 0.45};
  static constexpr double kKerfVoxel = 0.25e-3, kBlade = 0.5e-3;  // [m]

  TriangleSurface surface;  // as it is cut
  PointCloud cloud;         // of the whole block

  /// Whole, with nodes so far apart. Fails where they can't be placed.
  static Result<CutBlock> whole(double spacing, std::uint64_t seed);

  /// Parted in the middle of its length, this wide, from the top down to a height [m].
  void slit_down_to(double height, double spacing, double width = 0.02e-3);
  /// Parted in the middle of its length, half through from the top, along the width from its end at
  /// -kWidth / 2 to a place `front` on it [m].
  void slit_along_to(double front, double spacing, double width = 0.02e-3);
  /// Less what is gone. Fails as carve.
  Result<void> take(const TissueShare& gone, double spacing);

  /// Held where `is_fixed` says; pieces may be free.
  Result<GalerkinSystem> assemble(std::function<bool(const Vec3&)> is_fixed) const;
  static bool is_end(const Vec3& x);
};

/// What a block does that was assembled with its ends held.
struct PulledBlock {
  std::vector<double> moved;  // nodal unknowns [m]
  double force = 0.0;         // at each end [N]
};
Result<PulledBlock> pull(const GalerkinSystem& block);

/// How far the edges of a slit at the block's top gape, in the middle plane [m].
double mouth_of(const GalerkinSystem& block, const PulledBlock& pulled, double width = 0.02e-3);

/// Of a block in two pieces of which one isn't held: the greatest energy of that one's six rigid
/// motions, by a spacing h or as if turned by a radian, over E h^3. Fails where it isn't in two.
Result<double> energy_of_free_piece(const GalerkinSystem& block, double spacing);

/// A slit half through, a quarter of the block in C3D20R by CalculiX 2.20, finer towards its front,
/// 13,133 nodes; with 5,121 nodes the force is .16 % greater.
inline constexpr double kSlitForce = 0.2960;    // [N]
inline constexpr double kSlitMouth = 5.826e-3;  // [m]
/// The whole block, likewise.
inline constexpr double kWholeForce = 0.4311;  // [N]

/// Kerfs of a blade kBlade thick, whose fronts lie in the middle of the height.
struct Kerf {
  const char* name;
  void (*cut)(TissueShare&);
  double force;  // [N]
};
/// By CalculiX 2.20, meshed by gmsh 4.8 around the same kerfs with square ends: ten-node tetrahedra
/// of 91,000 to 96,000 nodes, finer about the fronts; with 55,000 to 58,000 the forces are .2 %
/// greater.
extern const std::array<Kerf, 4> kKerfs;
/// Through all of it: straight, at a slant, and by an arc.
extern const std::array<Kerf, 3> kSeveringKerfs;

/// Slits from the top, this deep [m], with the force [N]: a quarter in C3D20R by CalculiX 2.20,
/// 18,700 to 19,400 nodes, .05 mm about the front; with .2 mm there what the energy falls by from
/// one to the next is up to .8 % different.
struct SlitForce {
  double depth, force;
};
inline constexpr std::array<SlitForce, 6> kSlitForces{{{4e-3, 0.40959},
                                                       {6e-3, 0.38140},
                                                       {8e-3, 0.34251},
                                                       {10e-3, 0.29630},
                                                       {12e-3, 0.24677},
                                                       {14e-3, 0.19767}}};

}  // namespace viscera
