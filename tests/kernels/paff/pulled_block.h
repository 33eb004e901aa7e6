// A block whose ends are held flat and pulled apart by a tenth, cut in some way: what it is softer
// by is known from finite elements.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "kernels/paff/galerkin.h"
#include "kernels/points/node_placement.h"
#include "kernels/points/surface_tree.h"
#include "tests/support/blocks.h"

namespace viscera::test {

struct PulledBlock {
  static constexpr double kLength = 60e-3, kWidth = 40e-3, kHeight = 20e-3;  // x, y, z [m]
  static constexpr double kEachEnd = 3e-3;                                   // along x [m]
  static constexpr IsotropicMaterial kTissue{5e3, 0.45};

  TriangleSurface surface;  // as it is cut
  PointCloud cloud;         // of the whole block

  /// Whole, with nodes so far apart.
  static PulledBlock whole(double spacing, std::uint64_t seed) {
    PulledBlock made;
    made.surface = bricks_along(across(kLength, spacing), across(kHeight, spacing), spacing,
                                [](const Vec3&) { return true; });
    NodePlacement placement;
    placement.seed = seed;
    made.cloud = place_nodes(
                     made.surface, SurfaceTree(made.surface), [&](const Vec3&) { return spacing; },
                     placement, no_progress())
                     .value();
    return made;
  }

  static std::vector<double> across(double size, double spacing) {
    return lines(-0.5 * size, 0.5 * size, 0.5 * spacing);
  }
  /// Of bricks between these lines along x and z.
  static TriangleSurface bricks_along(const std::vector<double>& x, const std::vector<double>& z,
                                      double spacing,
                                      const std::function<bool(const Vec3&)>& filled) {
    return bricks(x, across(kWidth, spacing), z, filled);
  }

  /// Held where `is_fixed` says.
  Result<GalerkinSystem> assemble(std::function<bool(const Vec3&)> is_fixed) const {
    ElasticProblem problem{&surface, &cloud, kTissue, std::move(is_fixed)};
    problem.may_have_free_pieces = true;
    return GalerkinSystem::assemble(problem, 1.8, no_progress());
  }
  static bool is_end(const Vec3& x) { return std::abs(x.x()) > 0.5 * kLength - 1e-9; }
};

/// x K x.
inline double quadratic_form(const SymmetricBlockMatrix& stiffness, const std::vector<double>& x) {
  std::vector<double> forces(x.size());
  stiffness.multiply(x, forces);
  return std::inner_product(forces.begin(), forces.end(), x.begin(), 0.0);
}

/// What a block does that was assembled with its ends held.
struct Pulled {
  std::vector<double> moved;  // nodal unknowns [m]
  double force = 0.0;         // at each end [N]
};

inline Result<Pulled> pull(const GalerkinSystem& block) {
  StaticLoads loads;
  loads.held_displacement = [](const Vec3& x) {
    return Vec3(std::copysign(PulledBlock::kEachEnd, x.x()), 0.0, 0.0);
  };
  auto moved = block.solve(loads);
  if (!moved) return std::unexpected(moved.error());
  const auto hold = block.hold();
  if (!hold) return std::unexpected(hold.error());
  // The work of the ends is twice the energy of the tissue, which the hold has no part in.
  const double work = quadratic_form(block.stiffness(), *moved) - quadratic_form(*hold, *moved);
  return Pulled{*std::move(moved), work / (2.0 * PulledBlock::kEachEnd)};
}

/// Of a block in two pieces, one of which isn't held: the energy of that one's six rigid motions,
/// by a spacing or as if turned by a radian.
inline void expect_free_piece_to_move_without_force(const GalerkinSystem& block, double spacing) {
  const std::vector<TissuePiece>& pieces = block.pieces();
  ASSERT_EQ(pieces.size(), 2u);
  const TissuePiece& off = pieces[0].held ? pieces[1] : pieces[0];
  EXPECT_FALSE(off.held);
  const PointCloud& nodes = block.fields().cloud();
  for (int motion = 0; motion < 6; ++motion) {
    std::vector<double> moved(3 * nodes.size(), 0.0);
    for (const int node : off.nodes) {
      const auto n = static_cast<std::size_t>(node);
      const Vec3 axis = Vec3::Unit(motion % 3);
      Vec3::Map(moved.data() + 3 * n) =
          motion < 3 ? Vec3(spacing * axis) : Vec3(axis.cross(nodes.positions[n]));
    }
    const double energy = 0.5 * quadratic_form(block.stiffness(), moved);
    EXPECT_LT(std::abs(energy),
              1e-10 * PulledBlock::kTissue.youngs_modulus * spacing * spacing * spacing)
        << motion;
  }
}

}  // namespace viscera::test
