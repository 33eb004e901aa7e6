// Blocks that blades have cut, against finite elements: from the blade's way to the force.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numeric>
#include <stdexcept>

#include "kernels/parting/blade_sweep.h"
#include "kernels/parting/carve.h"
#include "kernels/parting/simplify.h"
#include "kernels/parting/void_surface.h"
#include "tests/kernels/paff/elastic_bodies.h"
#include "tests/support/blocks.h"

namespace viscera {
namespace {

using test::lines;

const Vec3 kPulledSize(60e-3, 40e-3, 20e-3);  // [m]
constexpr double kPulled = 3e-3;              // each end, along x [m]
const IsotropicMaterial kTissue{5e3, 0.45};
constexpr double kSpacing = 3e-3, kKerfVoxel = 0.25e-3, kBlade = 0.5e-3;  // [m]
constexpr double kBeyond = 25e-3, kAbove = 15e-3;                         // half way and height [m]

TriangleSurface pulled_block() {
  return test::bricks(lines(-0.5 * kPulledSize.x(), 0.5 * kPulledSize.x(), 0.5 * kSpacing),
                      lines(-0.5 * kPulledSize.y(), 0.5 * kPulledSize.y(), 0.5 * kSpacing),
                      lines(-0.5 * kPulledSize.z(), 0.5 * kPulledSize.z(), 0.5 * kSpacing),
                      [](const Vec3&) { return true; });
}

/// A blade along y goes from one place of the plane of x and z to another. Its kerf's end is round,
/// half a blade ahead.
void cut_across(TissueShare& tissue, const Vec3& from, const Vec3& to) {
  const Vec3 y(0.0, kBeyond, 0.0);
  sweep({{Vec3(from - y), Vec3(from + y)}, {Vec3(to - y), Vec3(to + y)}, kBlade}, tissue);
}

void straight(TissueShare& tissue) {
  cut_across(tissue, {0.0, 0.0, kAbove}, {0.0, 0.0, 0.5 * kBlade});
}

void oblique(TissueShare& tissue) {
  const Vec3 down = Vec3(1.0, 0.0, 1.0).normalized();
  cut_across(tissue, 28e-3 * down, 0.5 * kBlade * down);
}

/// A straight one, and from its middle one along x to 20 mm.
void tee(TissueShare& tissue) {
  straight(tissue);
  const double end = 20e-3 - 0.5 * kBlade;
  sweep({{Vec3(0.0, 0.0, kAbove), Vec3(end, 0.0, kAbove)},
         {Vec3(0.0, 0.0, 0.5 * kBlade), Vec3(end, 0.0, 0.5 * kBlade)},
         kBlade},
        tissue);
}

/// On an arc of 14 mm, upright at the top.
void curved(TissueShare& tissue) {
  const double radius = 14e-3, step = std::asin(10e-3 / radius) / 40.0;
  const auto at = [&](int k) {
    return Vec3(radius - radius * std::cos(k * step), 0.0, 10e-3 - radius * std::sin(k * step));
  };
  for (int k = -7; k <= 40; ++k) cut_across(tissue, at(k - 1), at(k));
}

struct CutBlock {
  TriangleSurface surface;
  PointCloud cloud;  // of the block before it was cut

  ElasticProblem problem() const {
    return {&surface, &cloud, kTissue,
            [](const Vec3& x) { return std::abs(x.x()) > 0.5 * kPulledSize.x() - 1e-9; }};
  }
};

CutBlock cut_block(const std::function<void(TissueShare&)>& cut, std::uint64_t seed) {
  CutBlock made;
  made.surface = pulled_block();
  NodePlacement placement;
  placement.seed = seed;
  made.cloud = place_nodes(
                   made.surface, SurfaceTree(made.surface), [](const Vec3&) { return kSpacing; },
                   placement, no_progress())
                   .value();
  if (!cut) return made;
  TissueShare tissue(kKerfVoxel);
  cut(tissue);
  const TriangleSurface gone = simplified(void_surface(tissue), {0.1 * kKerfVoxel, kSpacing});
  const auto left = carve(made.surface, gone);
  if (!left) throw std::runtime_error(left.error().text());
  made.surface = left->surface;
  return made;
}

double work_of(const SymmetricBlockMatrix& stiffness, const std::vector<double>& moved) {
  std::vector<double> forces(moved.size());
  stiffness.multiply(moved, forces);
  return std::inner_product(forces.begin(), forces.end(), moved.begin(), 0.0);
}

/// At each end of a block whose ends are held flat and pulled apart [N].
double force_of(const CutBlock& body) {
  auto assembled = GalerkinSystem::assemble(body.problem(), 1.8, no_progress());
  if (!assembled) throw std::runtime_error(assembled.error().text());
  const GalerkinSystem& system = *assembled;
  StaticLoads loads;
  loads.held_displacement = [](const Vec3& x) {
    return Vec3(std::copysign(kPulled, x.x()), 0.0, 0.0);
  };
  const auto solved = system.solve(loads);
  if (!solved) throw std::runtime_error(solved.error().text());
  const std::vector<double>& moved = *solved;
  return (work_of(system.stiffness(), moved) - work_of(system.hold().value(), moved)) /
         (2.0 * kPulled);
}

/// The same blocks by CalculiX 2.20, meshed by gmsh 4.8 around the same kerfs with square ends:
/// ten-node tetrahedra of 91,000 to 96,000 nodes, finer about the fronts; with 55,000 to 58,000 the
/// forces are .2 % greater. The whole block: a quarter in C3D20R, 13,133 nodes.
constexpr double kWhole = 0.4311;  // [N]
struct Kerf {
  const char* name;
  void (*cut)(TissueShare&);
  double force;  // [N]
};
class KerfBody : public testing::TestWithParam<Kerf> {};
constexpr Kerf kKerfs[] = {{"Straight", straight, 0.2943},
                           {"Oblique", oblique, 0.2917},
                           {"Tee", tee, 0.2935},
                           {"Curved", curved, 0.2977}};
INSTANTIATE_TEST_SUITE_P(Kerfs, KerfBody, testing::ValuesIn(kKerfs),
                         [](const auto& info) { return info.param.name; });

TEST_P(KerfBody, IsSofterByWhatFiniteElementsSay) {
  const double expected = 1.0 / GetParam().force - 1.0 / kWhole;
  double mean = 0.0;
  for (const std::uint64_t seed : {11, 12}) {
    const double added =
        1.0 / force_of(cut_block(GetParam().cut, seed)) - 1.0 / force_of(cut_block({}, seed));
    EXPECT_NEAR(added, expected, 0.08 * expected) << seed;
    mean += 0.5 * (added / expected - 1.0);
  }
  RecordProperty("added_compliance_error", std::to_string(mean));
}

}  // namespace
}  // namespace viscera
