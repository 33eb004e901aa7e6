#include "kernels/paff/preparation_cost.h"

#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "kernels/paff/two_levels.h"
#include "kernels/points/neighbours.h"

namespace viscera {
namespace {

/// Two fields meet at a point of the quadrature where their nodes are no farther apart than this
/// share of the sum of their radii: two balls that only just touch share no point. Fitted to the
/// entries of balls of 600 to 1,900 nodes, for both bases.
constexpr double kMeeting = 0.955;
/// A cell of averaged dilatation brings together nodes this much farther apart, in spacings: cells
/// are some two spacings wide. Fitted likewise.
constexpr double kCellReach = 0.75;
/// Quadrature points, the fields at them and what makes their gradients consistent [bytes a node];
/// measured with the linear basis. It goes with the nodes that a point sees.
constexpr double kQuadratureBytes = 66e3;
constexpr double kLinearSupport = 1.8;

/// Coarse nodes of two levels are coupled where they are no farther apart than this share of the
/// sum of their least distances. By the reach of two of their fields and of what couples the nodes
/// between; a few hundred of them are all coupled.
constexpr double kCoarseReach = 2.5;
/// What makes gradients consistent is factored by MUMPS, in an order of its own and with room to
/// work in: so many times what our order would take. From the peaks of whole preparations of balls
/// of 29,000 and 100,000 nodes, 2.3 and 12.6 GB: less 40 kB a node for fields, 1.0 and 1.3 times.
constexpr double kConsistencyRoom = 1.4;

/// Pairs nearer than `radius` times the sum of their spacings; ascending, the diagonal first.
SymmetricPattern coupled_nodes(const PointCloud& cloud, double radius) {
  std::vector<double> reach;
  for (const double spacing : cloud.spacings) reach.push_back(2.0 * radius * spacing);
  const InfluenceGrid nodes(cloud.positions, reach);
  // A pair is found from the node of the narrower spacing: the wider one's ball holds it.
  std::vector<std::vector<int>> rows(cloud.size());
  std::vector<int> near;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    nodes.reaching(cloud.positions[i], near);
    for (const int other : near) {
      const auto j = static_cast<std::size_t>(other);
      if (std::pair(cloud.spacings[j], j) < std::pair(cloud.spacings[i], i)) continue;
      const double distance = (cloud.positions[i] - cloud.positions[j]).norm();
      if (distance < radius * (cloud.spacings[i] + cloud.spacings[j]))
        rows[std::min(i, j)].push_back(static_cast<int>(std::max(i, j)));
    }
  }
  SymmetricPattern pattern;
  for (std::vector<int>& row : rows) {
    std::ranges::sort(row);
    pattern.columns.insert(pattern.columns.end(), row.begin(), row.end());
    pattern.row_begin.push_back(pattern.columns.size());
  }
  return pattern;
}

/// Numbers of a front: what it keeps, and what it leaves to its parent.
struct FrontSize {
  double panel, rest;
};

FrontSize size_of(const Dissection::Front& front) {
  const double own = 3.0 * static_cast<double>(front.own());
  const double size = 3.0 * static_cast<double>(front.size());
  return {own * size, (size - own) * (size - own)};
}

}  // namespace

std::size_t elimination_bytes(const Dissection& dissection, std::size_t real_bytes, int threads) {
  // Of the fronts below and at each: what is alive at most besides what they keep.
  struct Subtree {
    double peak = 0.0;
    int threads = 1;
  };
  const std::vector<Dissection::Front>& fronts = dissection.fronts;
  std::vector<Subtree> trees(fronts.size());
  // Parents come last: threads are dealt out from them downwards.
  for (std::size_t f = fronts.size(); f-- > 0;) {
    if (fronts[f].parent < 0) trees[f].threads = threads;
    const int children = static_cast<int>(fronts[f].children.size());
    for (const int child : fronts[f].children)
      trees[static_cast<std::size_t>(child)].threads =
          std::max(1, trees[f].threads / std::max(1, children));
  }
  double kept = 0.0, peak = 0.0;
  for (std::size_t f = 0; f < fronts.size(); ++f) {
    const auto [panel, rest] = size_of(fronts[f]);
    double waiting = 0.0, side_by_side = 0.0, one_by_one = 0.0;
    for (const int child : fronts[f].children) {
      const Subtree& below = trees[static_cast<std::size_t>(child)];
      one_by_one = std::max(one_by_one, waiting + below.peak);
      side_by_side += below.peak;
      waiting += size_of(fronts[static_cast<std::size_t>(child)]).rest;
    }
    const double below = trees[f].threads > 1 ? side_by_side : one_by_one;
    trees[f].peak = std::max(below, waiting + rest);
    kept += panel;
    if (fronts[f].parent < 0) peak = std::max(peak, trees[f].peak);
  }
  return static_cast<std::size_t>((kept + peak) * static_cast<double>(real_bytes));
}

namespace {

/// The equations alone.
PreparationCost elimination_cost(const PointCloud& cloud, double radius, Dissection& dissection) {
  const SymmetricPattern pattern = coupled_nodes(cloud, radius);
  dissection = dissect(cloud.positions, pattern);
  PreparationCost cost;
  cost.stiffness_blocks = pattern.columns.size();
  cost.factor_entries = dissection.factor_entries(3);
  for (const Dissection::Front& front : dissection.fronts) {
    const double own = 3.0 * static_cast<double>(front.own());
    const double rest = 3.0 * static_cast<double>(front.border.size());
    cost.factoring_operations += own * own * own / 3.0 + own * own * rest + own * rest * rest;
  }
  const int threads = oneapi::tbb::this_task_arena::max_concurrency();
  cost.factoring_bytes =
      cost.stiffness_blocks * 24 + elimination_bytes(dissection, sizeof(float), threads);
  return cost;
}

}  // namespace

PreparationCost preparation_cost(const PointCloud& cloud, const Coupling& coupling) {
  Dissection dissection;
  PreparationCost cost = elimination_cost(
      cloud, kMeeting * coupling.support_factor + (coupling.averaged ? kCellReach : 0.0),
      dissection);
  constexpr std::size_t kBlock = 9 * sizeof(double) + sizeof(int);
  const std::size_t stiffness = cost.stiffness_blocks * kBlock;
  const double seen = coupling.support_factor / kLinearSupport;  // nodes: as the cube
  cost.assembling_bytes =
      stiffness + static_cast<std::size_t>(kQuadratureBytes * seen * seen * seen *
                                           static_cast<double>(cloud.size()));
  // In single precision; where that isn't enough, twice as much. Beside the matrix stand its
  // entries by column of the factor and the body's quadrature.
  cost.factoring_bytes += cost.assembling_bytes;
  return cost;
}

LevelsCost levels_cost(const PointCloud& cloud, const Coupling& coupling) {
  LevelsCost cost;
  std::vector<double> reach;
  for (const double spacing : cloud.spacings) reach.push_back(TwoLevels::kCoarser * spacing);
  const InfluenceGrid nodes(cloud.positions, reach);
  std::vector<char> covered(cloud.size(), 0);
  std::vector<int> near;
  PointCloud coarse;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (covered[i]) continue;
    coarse.positions.push_back(cloud.positions[i]);
    coarse.spacings.push_back(reach[i]);
    nodes.reaching(cloud.positions[i], near);
    for (const int other : near) covered[static_cast<std::size_t>(other)] = 1;
  }
  cost.coarse_nodes = coarse.size();
  Dissection dissection;
  cost.coarse = elimination_cost(coarse, kCoarseReach, dissection);
  // One unknown a node, in double precision.
  const PreparationCost scalar =
      elimination_cost(cloud, kMeeting * coupling.support_factor, dissection);
  cost.consistency_bytes = static_cast<std::size_t>(
      kConsistencyRoom / 9.0 *
      static_cast<double>(elimination_bytes(dissection, sizeof(double), 1)));
  cost.consistency_operations = scalar.factoring_operations / 27.0;
  return cost;
}

}  // namespace viscera
