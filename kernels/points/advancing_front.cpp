#include "kernels/points/advancing_front.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>

#include "kernels/base/parallel.h"
#include "kernels/base/random.h"
#include "kernels/points/point_octree.h"

namespace viscera {

namespace {

// More directions pack the nodes more tightly, at a cost that grows with them.
constexpr int kSurfaceDirections = 24;
constexpr int kInsideDirections = 48;
// Random places per h^2 of surface where a node may start: enough to leave no hole unseen.
constexpr double kSamplesPerNode = 16.0;
// Nodes placed per h^-2 of surface and per h^-3 of volume at accept = 0.95 (measured).
constexpr double kSurfaceDensity = 1.0;
constexpr double kInsideDensity = 0.85;

// Streams of random numbers.
constexpr std::uint64_t kSampleStream = 1;
constexpr std::uint64_t kSurfaceStream = 2;
constexpr std::uint64_t kInsideStream = 3;

std::string bad_spacing(const Vec3& x, double h) {
  std::ostringstream text;
  text << "node spacing: found " << h << " m at (" << x.transpose()
       << ") m, expected a positive, finite length";
  return text.str();
}

bool usable(double h) {
  return h > 0.0 && std::isfinite(h);
}

/// The front itself: nodes in the order of acceptance, each of which proposes neighbours.
class Front {
 public:
  explicit Front(const PlacementTask& task) : task_(task), octree_(roomy(bounds(task.surface))) {}

  PlacedNodes nodes;

  bool fits(const Vec3& x, double h) const {
    return !octree_.any_nearer(x, task_.options.accept * h);
  }

  void remember(const Vec3& x) { octree_.insert(x); }

  Result<void> accept(const Vec3& x, double h, double depth) {
    if (nodes.positions.size() >= task_.options.max_nodes) {
      const auto reached = static_cast<double>(nodes.positions.size());
      return std::unexpected(
          too_many_nodes(std::max(task_.expected_nodes, reached), task_.options.max_nodes));
    }
    nodes.positions.push_back(x);
    nodes.wanted.push_back(h);
    nodes.depths.push_back(depth);
    octree_.insert(x);
    return {};
  }

  /// The spacing at x, or an error that names the place.
  Result<double> spacing(const Vec3& x) const {
    const double h = task_.spacing(x);
    if (!usable(h)) return failure(bad_spacing(x, h));
    return h;
  }

  /// How far from `x` along the unit vector `direction` the next node stands: r = h(x + r
  /// direction) by two steps of fixed-point iteration. With r = h(x) the front would stall wherever
  /// h grows, each node refusing its own neighbours.
  Result<double> reach(const Vec3& x, double h, const Vec3& direction) const {
    double r = h;
    for (int step = 0; step < 2; ++step) {
      const Result<double> there = spacing(x + r * direction);
      if (!there) return there;
      const bool settled = std::abs(*there - r) < 0.01 * r;
      r = *there;
      if (settled) break;
    }
    return r;
  }

 private:
  /// Projection may put a node a rounding error outside the surface's own box.
  static Box roomy(const Box& box) {
    const Vec3 margin = Vec3::Constant(1e-3 * box.sizes().maxCoeff());
    return {box.min() - margin, box.max() + margin};
  }

  const PlacementTask& task_;
  PointOctree octree_;
};

Quaternion random_rotation(const Random& random, std::uint64_t counter) {
  const Vec4 q(random.normal(4 * counter), random.normal(4 * counter + 1),
               random.normal(4 * counter + 2), random.normal(4 * counter + 3));
  return Quaternion(q).normalized();
}

/// Points spread evenly over the unit sphere, on a Fibonacci spiral.
std::vector<Vec3> even_directions(int count) {
  std::vector<Vec3> directions;
  const double golden_angle = std::numbers::pi * (3.0 - std::sqrt(5.0));
  for (int i = 0; i < count; ++i) {
    const double z = 1.0 - (2.0 * i + 1.0) / count;
    const double radius = std::sqrt(1.0 - z * z);
    directions.emplace_back(radius * std::cos(golden_angle * i),
                            radius * std::sin(golden_angle * i), z);
  }
  return directions;
}

/// Lets the surface front run until no node finds room beside it.
Result<void> spread(const PlacementTask& task, Front& front, std::size_t& next) {
  const Random random(task.options.seed, kSurfaceStream);
  for (; next < front.nodes.positions.size(); ++next) {
    const Vec3 x = front.nodes.positions[next];
    const double h = front.nodes.wanted[next];
    const SurfaceTree::Closest here = task.tree.closest(x);
    const Vec3 normal = area_vector(task.surface, here.point.triangle).normalized();
    const Vec3 u = normal.unitOrthogonal(), v = normal.cross(u);
    const double start = random.uniform(next);
    for (int i = 0; i < kSurfaceDirections; ++i) {
      const double angle = 2.0 * std::numbers::pi * (i + start) / kSurfaceDirections;
      const Vec3 direction = std::cos(angle) * u + std::sin(angle) * v;
      const Result<double> r = front.reach(x, h, direction);
      if (!r) return std::unexpected(r.error());
      // Curvature brings the projected candidate nearer by a little: allow for it here, so that
      // most candidates are refused without a projection.
      const Vec3 flat = x + *r * direction;
      if (!front.fits(flat, 0.8 * *r)) continue;
      const Vec3 candidate = task.tree.closest(flat).position;
      const Result<double> there = front.spacing(candidate);
      if (!there) return std::unexpected(there.error());
      if (!front.fits(candidate, *there)) continue;
      if (const Result<void> done = front.accept(candidate, *there, 0.0); !done) return done;
    }
  }
  return {};
}

}  // namespace

Error too_many_nodes(double expected, std::size_t most) {
  std::ostringstream text;
  text.precision(3);
  text << "node placement: about " << expected << " nodes expected, more than the " << most
       << " allowed; use a coarser spacing";
  return Error(text.str());
}

Result<double> estimate_nodes(const TriangleSurface& surface, const SurfaceTree& tree,
                              const SpacingField& spacing) {
  double on_surface = 0.0;
  for (int t = 0; t < static_cast<int>(surface.triangles.size()); ++t) {
    const Vec3 centre = position(surface, {t, Vec3::Constant(1.0 / 3.0)});
    const double h = spacing(centre);
    if (!usable(h)) return failure(bad_spacing(centre, h));
    on_surface += area_vector(surface, t).norm() / (h * h);
  }

  // Cells are halved where they are wide against h, level by level, while there are few of them.
  constexpr double kCellPerSpacing = 4.0;
  constexpr std::size_t kMostCells = 30'000;
  struct Cell {
    Vec3 centre;
    double edge;
  };
  const Box box = bounds(surface);
  std::vector<Cell> cells{{box.center(), box.sizes().maxCoeff()}};
  double inside = 0.0;
  for (int level = 0; !cells.empty(); ++level) {
    const bool may_split = 8 * cells.size() <= kMostCells;
    std::vector<double> parts(cells.size(), 0.0);
    std::vector<char> splits(cells.size(), 0), bad(cells.size(), 0);
    parallel_for_each_index(cells.size(), 64, [&](std::size_t i) {
      const auto& [centre, edge] = cells[i];
      const double height = tree.signed_distance(centre);
      if (height > 0.5 * std::numbers::sqrt3 * edge) return;
      const double h = spacing(centre);
      bad[i] = height < 0.0 && !usable(h);
      splits[i] = may_split && (level < 3 || edge > kCellPerSpacing * h);
      const double share = std::clamp(0.5 - height / edge, 0.0, 1.0);
      if (!splits[i] && usable(h)) parts[i] = share * std::pow(edge / h, 3);
    });
    std::vector<Cell> finer;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      if (bad[i]) return failure(bad_spacing(cells[i].centre, spacing(cells[i].centre)));
      inside += parts[i];
      if (!splits[i]) continue;
      for (int k = 0; k < 8; ++k) {
        const Vec3 towards(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1);
        finer.push_back({cells[i].centre + 0.25 * cells[i].edge * towards, 0.5 * cells[i].edge});
      }
    }
    cells = std::move(finer);
  }
  // A layer of about 0.4 h under the surface belongs to the surface nodes.
  return kSurfaceDensity * on_surface + kInsideDensity * std::max(0.0, inside - 0.4 * on_surface);
}

Result<PlacedNodes> cover_surface(const PlacementTask& task) {
  Front front(task);
  const Random random(task.options.seed, kSampleStream);
  std::uint64_t counter = 0;
  std::size_t next = 0;
  for (int t = 0; t < static_cast<int>(task.surface.triangles.size()); ++t) {
    const Result<double> at_centre =
        front.spacing(position(task.surface, {t, Vec3::Constant(1.0 / 3.0)}));
    if (!at_centre) return std::unexpected(at_centre.error());
    const double share = area_vector(task.surface, t).norm() / (*at_centre * *at_centre);
    const int samples = 1 + static_cast<int>(kSamplesPerNode * share);
    for (int i = 0; i < samples; ++i, ++counter) {
      const double root = std::sqrt(random.uniform(2 * counter));
      const double along = random.uniform(2 * counter + 1);
      const Vec3 weights(1.0 - root, root * (1.0 - along), root * along);
      const Vec3 candidate = position(task.surface, {t, weights});
      const Result<double> h = front.spacing(candidate);
      if (!h) return std::unexpected(h.error());
      if (!front.fits(candidate, *h)) continue;
      if (const Result<void> done = front.accept(candidate, *h, 0.0); !done) {
        return std::unexpected(done.error());
      }
      if (const Result<void> done = spread(task, front, next); !done) {
        return std::unexpected(done.error());
      }
    }
  }
  front.nodes.surface_count = front.nodes.positions.size();
  return std::move(front.nodes);
}

Result<void> fill_inside(const PlacementTask& task, PlacedNodes& nodes, const Progress& progress) {
  Front front(task);
  for (const Vec3& x : nodes.positions) front.remember(x);
  front.nodes = std::move(nodes);
  const Random random(task.options.seed, kInsideStream);
  const std::vector<Vec3> directions = even_directions(kInsideDirections);

  for (std::size_t parent = 0; parent < front.nodes.positions.size(); ++parent) {
    if (parent % 1024 == 0) {
      const double share = static_cast<double>(parent) / std::max(1.0, task.expected_nodes);
      if (!progress(std::min(1.0, share), "placing nodes")) return failure(kCancelled);
    }
    const Vec3 x = front.nodes.positions[parent];
    const double h = front.nodes.wanted[parent];
    const double depth = front.nodes.depths[parent];
    const Mat3 turn = random_rotation(random, parent).toRotationMatrix();
    for (const Vec3& unturned : directions) {
      const Vec3 direction = turn * unturned;
      const Result<double> r = front.reach(x, h, direction);
      if (!r) return std::unexpected(r.error());
      const Vec3 candidate = x + *r * direction;
      const Result<double> there = front.spacing(candidate);
      if (!there) return std::unexpected(there.error());
      if (!front.fits(candidate, *there)) continue;
      // The ball around the parent up to the surface says enough about most candidates.
      const double needed = kDepthShare * *there;
      double depth_there = depth - *r;
      if (depth_there < needed) depth_there = -task.tree.signed_distance(candidate);
      if (depth_there < needed) continue;
      if (const Result<void> done = front.accept(candidate, *there, depth_there); !done) {
        return done;
      }
    }
  }
  nodes = std::move(front.nodes);
  return {};
}

}  // namespace viscera
