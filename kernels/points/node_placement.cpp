#include "kernels/points/node_placement.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <memory>
#include <sstream>
#include <utility>

#include "kernels/base/parallel.h"
#include "kernels/points/advancing_front.h"
#include "kernels/points/kd_tree.h"
#include "kernels/points/neighbours.h"
#include "kernels/points/repulsion.h"

namespace viscera {

namespace {

constexpr double kLeastSeparation = 0.5;  // in h

/// The nodes of a moment matrix must span space: how thick the cloud is in its thinnest direction
/// against its widest.
double thickness_share(const std::vector<Vec3>& positions) {
  Vec3 mean = Vec3::Zero();
  for (const Vec3& x : positions) mean += x / static_cast<double>(positions.size());
  Mat3 spread = Mat3::Zero();
  for (const Vec3& x : positions) spread += (x - mean) * (x - mean).transpose();
  const Vec3 squares = Eigen::SelfAdjointEigenSolver<Mat3>(spread).eigenvalues();
  return std::sqrt(std::max(0.0, squares[0]) / std::max(squares[2], 1e-300));
}

Result<void> enough_nodes(const TriangleSurface& surface, const SpacingField& spacing,
                          const std::vector<Vec3>& positions) {
  constexpr double kFlat = 1e-6;
  if (positions.size() >= 4 && thickness_share(positions) > kFlat) return {};
  std::ostringstream text;
  text.precision(3);
  text << "node placement: a spacing of " << 1e3 * spacing(positions.front()) << " mm on a body of "
       << 1e3 * bounds(surface).sizes().maxCoeff() << " mm gives ";
  if (positions.size() < 4) {
    text << positions.size() << " nodes, expected at least 4";
  } else {
    text << positions.size() << " nodes in one plane, expected them to span the body";
  }
  text << "; use a finer spacing";
  return failure(text.str());
}

/// A share of the whole progress.
Progress part(const Progress& progress, double begin, double end) {
  return [&progress, begin, end](double fraction, std::string_view what) {
    return progress(begin + (end - begin) * fraction, what);
  };
}

}  // namespace

SpacingField graded_spacing(double h_max, double h_min, double gradient, std::vector<Vec3> points) {
  if (points.empty()) return [h_max](const Vec3&) { return h_max; };
  // Shared, because copies of a std::function copy what they hold.
  const auto tree = std::make_shared<const KdTree>(points);
  return [=](const Vec3& x) {
    const double distance = tree->nearest_distance(x);
    return std::min(h_max, h_min + gradient * distance);
  };
}

Result<PointCloud> place_nodes(const TriangleSurface& surface, const SurfaceTree& tree,
                               const SpacingField& spacing, const NodePlacement& options,
                               const Progress& progress) {
  if (surface.empty()) return failure("node placement: the surface has no triangles");
  if (!(options.accept >= kLeastSeparation && options.accept <= 1.0)) {
    return failure("node placement: accept is " + std::to_string(options.accept) +
                   ", expected 0.5 to 1");
  }
  if (!progress(0.0, "placing nodes")) return failure(kCancelled);
  const Result<double> expected = estimate_nodes(surface, tree, spacing);
  if (!expected) return std::unexpected(expected.error());
  // The estimate is rough: what may still fit is found out by placing.
  if (*expected > 1.5 * static_cast<double>(options.max_nodes)) {
    return std::unexpected(too_many_nodes(*expected, options.max_nodes));
  }
  const PlacementTask task{surface, tree, spacing, options, *expected};

  Result<PlacedNodes> nodes = cover_surface(task);
  if (!nodes) return std::unexpected(nodes.error());
  if (const Result<void> done = relax_surface(task, *nodes); !done) {
    return std::unexpected(done.error());
  }
  if (const Result<void> done = fill_inside(task, *nodes, part(progress, 0.1, 0.5)); !done) {
    return std::unexpected(done.error());
  }
  if (const Result<void> done = relax_all(task, *nodes, part(progress, 0.5, 1.0)); !done) {
    return std::unexpected(done.error());
  }
  separate(kLeastSeparation, *nodes);
  if (const Result<void> enough = enough_nodes(surface, spacing, nodes->positions); !enough) {
    return std::unexpected(enough.error());
  }

  PointCloud cloud;
  cloud.positions = std::move(nodes->positions);
  cloud.spacings = measure_spacings(cloud.positions);
  cloud.surface_count = nodes->surface_count;
  return cloud;
}

std::vector<double> measure_spacings(const std::vector<Vec3>& positions) {
  constexpr int kNearest = 6;
  const std::vector<int> neighbours = nearest_neighbours(positions, kNearest);
  std::vector<double> spacings(positions.size(), 0.0);
  parallel_for_each_index(positions.size(), 1024, [&](std::size_t i) {
    int found = 0;
    for (int n = 0; n < kNearest; ++n) {
      const int j = neighbours[i * kNearest + n];
      if (j < 0) break;
      spacings[i] += (positions[i] - positions[j]).norm();
      ++found;
    }
    if (found > 0) spacings[i] /= found;
  });
  return spacings;
}

}  // namespace viscera
