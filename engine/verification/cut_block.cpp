#include "engine/verification/cut_block.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <numeric>

#include "engine/verification/brick_surface.h"
#include "kernels/parting/blade_sweep.h"
#include "kernels/parting/carve.h"
#include "kernels/parting/void_surface.h"
#include "kernels/points/node_placement.h"
#include "kernels/points/surface_tree.h"

namespace viscera {
namespace {

constexpr double kSupport = 1.8;                   // of the fields, in spacings
constexpr double kBeyond = 25e-3, kAbove = 15e-3;  // half way and height of blades [m]

/// Ascending ones, those that coincide once.
std::vector<double> joined(std::initializer_list<std::vector<double>> parts) {
  std::vector<double> all;
  for (const std::vector<double>& part : parts)
    for (const double line : part)
      if (all.empty() || line > all.back() + 1e-9) all.push_back(line);
  return all;
}

std::vector<double> across(double size, double spacing) {
  return lines(-0.5 * size, 0.5 * size, 0.5 * spacing);
}

/// x K x.
double quadratic_form(const SymmetricBlockMatrix& stiffness, const std::vector<double>& x) {
  std::vector<double> forces(x.size());
  stiffness.multiply(x, forces);
  return std::inner_product(forces.begin(), forces.end(), x.begin(), 0.0);
}

/// A blade along y goes through the block from one place of the plane of x and z to another. Its
/// kerf's end is round, half a blade ahead.
void cut_across(TissueShare& tissue, const Vec3& from, const Vec3& to) {
  const Vec3 y(0.0, kBeyond, 0.0);
  sweep({{Vec3(from - y), Vec3(from + y)}, {Vec3(to - y), Vec3(to + y)}, CutBlock::kBlade}, tissue);
}

void straight(TissueShare& tissue) {
  cut_across(tissue, {0.0, 0.0, kAbove}, {0.0, 0.0, 0.5 * CutBlock::kBlade});
}

void oblique(TissueShare& tissue) {
  const Vec3 down = Vec3(1.0, 0.0, 1.0).normalized();
  cut_across(tissue, 28e-3 * down, 0.5 * CutBlock::kBlade * down);
}

/// A straight one, and from its middle one along x to 20 mm.
void tee(TissueShare& tissue) {
  straight(tissue);
  const double blade = CutBlock::kBlade, end = 20e-3 - 0.5 * blade;
  sweep({{Vec3(0.0, 0.0, kAbove), Vec3(end, 0.0, kAbove)},
         {Vec3(0.0, 0.0, 0.5 * blade), Vec3(end, 0.0, 0.5 * blade)},
         blade},
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

void straight_through(TissueShare& tissue) {
  cut_across(tissue, {1e-3, 0.0, kAbove}, {1e-3, 0.0, -kAbove});
}

void oblique_through(TissueShare& tissue) {
  cut_across(tissue, {12e-3, 0.0, kAbove}, {-12e-3, 0.0, -kAbove});
}

void curved_through(TissueShare& tissue) {
  const auto at = [](int k) { return Vec3(4e-3 * std::sin(0.1 * k), 0.0, kAbove - 1e-3 * k); };
  for (int k = 1; k <= 30; ++k) cut_across(tissue, at(k - 1), at(k));
}

}  // namespace

const std::array<Kerf, 4> kKerfs{{{"Straight", straight, 0.2943},
                                  {"Oblique", oblique, 0.2917},
                                  {"Tee", tee, 0.2935},
                                  {"Curved", curved, 0.2977}}};
const std::array<Kerf, 3> kSeveringKerfs{{{"Straight", straight_through, 0.0},
                                          {"Oblique", oblique_through, 0.0},
                                          {"Curved", curved_through, 0.0}}};

Result<CutBlock> CutBlock::whole(double spacing, std::uint64_t seed) {
  CutBlock made;
  made.surface = bricks(across(kLength, spacing), across(kWidth, spacing), across(kHeight, spacing),
                        [](const Vec3&) { return true; });
  NodePlacement placement;
  placement.seed = seed;
  auto cloud = place_nodes(
      made.surface, SurfaceTree(made.surface), [&](const Vec3&) { return spacing; }, placement,
      no_progress());
  if (!cloud) return std::unexpected(cloud.error());
  made.cloud = *std::move(cloud);
  return made;
}

void CutBlock::slit_down_to(double height, double spacing, double width) {
  const double end = 0.5 * kLength, top = 0.5 * kHeight, side = 0.5 * width, step = 0.5 * spacing;
  surface =
      bricks(joined({lines(-end, -side, step), {side}, lines(side, end, step)}),
             across(kWidth, spacing), joined({lines(-top, height, step), lines(height, top, step)}),
             [&](const Vec3& x) { return std::abs(x.x()) > side || x.z() < height; });
}

void CutBlock::slit_along_to(double front, double spacing, double width) {
  const double end = 0.5 * kLength, across_end = 0.5 * kWidth, side = 0.5 * width,
               step = 0.5 * spacing;
  surface = bricks(joined({lines(-end, -side, step), {side}, lines(side, end, step)}),
                   joined({lines(-across_end, front, step), lines(front, across_end, step)}),
                   across(kHeight, spacing), [&](const Vec3& x) {
                     return std::abs(x.x()) > side || x.z() < 0.0 || x.y() > front;
                   });
}

Result<void> CutBlock::take(const TissueShare& gone, double spacing) {
  auto carved = carve(surface, plain_void_surface(gone, spacing));
  if (!carved) return std::unexpected(carved.error());
  surface = std::move(carved->surface);
  return {};
}

Result<GalerkinSystem> CutBlock::assemble(std::function<bool(const Vec3&)> is_fixed) const {
  ElasticProblem problem{&surface, &cloud, kTissue, std::move(is_fixed)};
  problem.may_have_free_pieces = true;
  return GalerkinSystem::assemble(problem, kSupport, no_progress());
}

bool CutBlock::is_end(const Vec3& x) {
  return std::abs(x.x()) > 0.5 * kLength - 1e-9;
}

Result<PulledBlock> pull(const GalerkinSystem& block) {
  StaticLoads loads;
  loads.held_displacement = [](const Vec3& x) {
    return Vec3(std::copysign(CutBlock::kEachEnd, x.x()), 0.0, 0.0);
  };
  auto moved = block.solve(loads);
  if (!moved) return std::unexpected(moved.error());
  const auto hold = block.hold();
  if (!hold) return std::unexpected(hold.error());
  // The work of the ends is twice the energy of the tissue, which the hold has no part in.
  const double work = quadratic_form(block.stiffness(), *moved) - quadratic_form(*hold, *moved);
  return PulledBlock{*std::move(moved), work / (2.0 * CutBlock::kEachEnd)};
}

double mouth_of(const GalerkinSystem& block, const PulledBlock& pulled, double width) {
  const double beside = 0.5 * width + 1e-6, top = 0.5 * CutBlock::kHeight - 1e-6;
  return (block.displacement(pulled.moved, {beside, 0.0, top}) -
          block.displacement(pulled.moved, {-beside, 0.0, top}))
      .x();
}

Result<double> energy_of_free_piece(const GalerkinSystem& block, double spacing) {
  const std::vector<TissuePiece>& pieces = block.pieces();
  if (pieces.size() != 2 || pieces[0].held == pieces[1].held)
    return failure("the block isn't in two pieces of which one is held");
  const TissuePiece& off = pieces[0].held ? pieces[1] : pieces[0];
  const PointCloud& nodes = block.fields().cloud();
  double greatest = 0.0;
  for (int motion = 0; motion < 6; ++motion) {
    std::vector<double> moved(3 * nodes.size(), 0.0);
    for (const int node : off.nodes) {
      const auto n = static_cast<std::size_t>(node);
      const Vec3 axis = Vec3::Unit(motion % 3);
      Vec3::Map(moved.data() + 3 * n) =
          motion < 3 ? Vec3(spacing * axis) : Vec3(axis.cross(nodes.positions[n]));
    }
    greatest = std::max(greatest, 0.5 * std::abs(quadratic_form(block.stiffness(), moved)));
  }
  return greatest / (CutBlock::kTissue.youngs_modulus * spacing * spacing * spacing);
}

}  // namespace viscera
