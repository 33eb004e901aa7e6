#include "kernels/contact/surface_carriers.h"

#include <algorithm>
#include <cmath>

#include "kernels/base/parallel.h"
#include "kernels/contact/facing.h"
#include "kernels/contact/same_side.h"
#include "kernels/points/kd_tree.h"
#include "kernels/points/neighbours.h"

namespace viscera {
namespace {

/// Reach of a place in its spacings: some fifteen places carry a point.
constexpr double kReach = 2.3;

/// A place about a point, its offset scaled; its weight in a mean.
struct Neighbour {
  int place;
  Vec3 offset;
  double weight;
};

/// Weights of the places for the value at the point itself: interpolation by |r|^3 and linear
/// polynomials, the interpolant of least bending [Duchon1977]. Moving least squares smooth what
/// they carry: with second-degree terms the deformed hemisphere of 1,073 nodes was off by 3.3 to
/// 4.2 % so, by 2.1 to 2.9 % with this. False where there are too few places, or badly placed.
bool interpolate(std::span<const Neighbour> neighbours, std::vector<double>& shares) {
  constexpr Eigen::Index kTerms = 4;
  constexpr double kLargest = 2.0;
  // On a plane the polynomial across it vanishes at all places: any multiplier will do, this takes
  // none.
  constexpr double kRidge = 1e-7;
  const auto n = static_cast<Eigen::Index>(neighbours.size());
  if (n < kTerms) return false;
  const auto offset = [&](Eigen::Index i) -> const Vec3& {
    return neighbours[static_cast<std::size_t>(i)].offset;
  };
  MatrixX system = MatrixX::Zero(n + kTerms, n + kTerms);
  VectorX right = VectorX::Zero(n + kTerms);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < i; ++j) {
      system(i, j) = system(j, i) = std::pow((offset(i) - offset(j)).squaredNorm(), 1.5);
    }
    system(i, n) = system(n, i) = 1.0;
    system.block<1, 3>(i, n + 1) = offset(i).transpose();
    system.block<3, 1>(n + 1, i) = offset(i);
    right[i] = std::pow(offset(i).squaredNorm(), 1.5);
  }
  system.diagonal().tail<3>().setConstant(-kRidge);
  right[n] = 1.0;
  const VectorX weights = system.partialPivLu().solve(right).head(n);
  if (!(std::abs(weights.sum() - 1.0) < 1e-6) || weights.cwiseAbs().maxCoeff() > kLargest) {
    return false;
  }
  shares.assign(weights.data(), weights.data() + n);
  return true;
}

/// A weighted mean; false where nothing weighs.
bool average(std::span<const Neighbour> neighbours, std::vector<double>& shares) {
  shares.clear();
  double sum = 0.0;
  for (const Neighbour& one : neighbours) sum += one.weight;
  for (const Neighbour& one : neighbours) shares.push_back(one.weight / sum);
  return sum > 0.0;
}

struct Carriers {
  std::vector<int> places;
  std::vector<double> shares;
};

/// Of so many nearest places one is chosen for a point that none carries.
constexpr int kChosenOf = 64;

/// Which closed piece of a body places of its surface are on.
class PieceOfPlace {
 public:
  explicit PieceOfPlace(const SurfacePlaces& places) : paths_(places.paths.get()) {
    if (!paths_ || !paths_->in_pieces()) return;
    of_places_.resize(places.size());
    parallel_for_each_index(places.size(), 64,
                            [&](std::size_t p) { of_places_[p] = number_at(places.positions[p]); });
  }
  int number_at(const Vec3& place) const { return paths_ ? paths_->piece_at(place) : 0; }
  int of_place(std::size_t place) const { return of_places_.empty() ? 0 : of_places_[place]; }

 private:
  const TissuePaths* paths_;
  std::vector<int> of_places_;  // empty: it is one
};

/// For a point about which no place counts: the nearest on its side of all air, else the nearest of
/// its piece.
int nearest_carrier(const Vec3& x, const Vec3& normal, const SurfacePlaces& places,
                    const KdTree& tree, const PieceOfPlace& pieces, int own) {
  std::vector<KdTree::Found> nearest;
  tree.nearest(x, places.paths ? kChosenOf : 1, -1, nearest);
  int of_piece = -1;
  for (const KdTree::Found& found : nearest) {
    const auto p = static_cast<std::size_t>(found.index);
    if (pieces.of_place(p) != own) continue;
    if (same_side(places.paths.get(), kSideDepth * places.spacings[p], x, normal,
                  places.positions[p], places.normals[p]))
      return found.index;
    if (of_piece < 0) of_piece = found.index;
  }
  return of_piece < 0 ? nearest.front().index : of_piece;
}

}  // namespace

SparseWeights surface_carriers(std::span<const Vec3> points, std::span<const Vec3> normals,
                               const SurfacePlaces& places) {
  std::vector<double> reaches;
  for (const double h : places.spacings) reaches.push_back(kReach * h);
  const InfluenceGrid grid(places.positions, reaches);
  const KdTree tree(places.positions);
  const PieceOfPlace pieces(places);

  std::vector<Carriers> carriers(points.size());
  parallel_chunks(points.size(), 128, [&](std::size_t begin, std::size_t end) {
    std::vector<int> near;
    std::vector<Neighbour> neighbours;
    for (std::size_t v = begin; v < end; ++v) {
      const Vec3 &x = points[v], &normal = normals[v];
      // Places of another piece may go anywhere, however near they lie at rest.
      const int own = pieces.number_at(x);
      grid.reaching(x, near);
      neighbours.clear();
      for (const int place : near) {
        const auto p = static_cast<std::size_t>(place);
        if (pieces.of_place(p) != own) continue;
        const Vec3 offset = places.positions[p] - x;
        const double weight =
            quartic_weight(offset.norm() / reaches[p]) * facing(normal.dot(places.normals[p]));
        if (weight <= 0.0) continue;
        if (!same_side(places.paths.get(), kSideDepth * places.spacings[p], x, normal,
                       places.positions[p], places.normals[p]))
          continue;
        neighbours.push_back({place, offset, weight});
      }
      // Of the size of one, by one scale for all places of a point.
      double farthest = 0.0;
      for (const Neighbour& one : neighbours) farthest = std::max(farthest, one.offset.norm());
      if (farthest > 0.0) {
        for (Neighbour& one : neighbours) one.offset /= farthest;
      }
      Carriers& out = carriers[v];
      if (interpolate(neighbours, out.shares) || average(neighbours, out.shares)) {
        for (const Neighbour& one : neighbours) out.places.push_back(one.place);
        continue;
      }
      out.places = {nearest_carrier(x, normal, places, tree, pieces, own)};
      out.shares = {1.0};
    }
  });

  SparseWeights weights;
  for (const Carriers& one : carriers) {
    weights.nodes.insert(weights.nodes.end(), one.places.begin(), one.places.end());
    for (const double share : one.shares) weights.values.push_back(static_cast<float>(share));
    weights.row_begin.push_back(static_cast<int>(weights.nodes.size()));
  }
  return weights;
}

}  // namespace viscera
