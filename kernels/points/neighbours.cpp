#include "kernels/points/neighbours.h"

#include <algorithm>
#include <cmath>

#include "kernels/base/parallel.h"
#include "kernels/points/kd_tree.h"

namespace viscera {

namespace {

// A cell of half a radius lists about 2.5 times the points that reach a place in it, and each point
// stands in about 85 cells: queries are many, so memory is spent on them, up to these limits.
constexpr double kCellPerRadius = 0.5;
constexpr double kEntriesPerPoint = 300.0;
constexpr double kCellsPerPoint = 64.0;
constexpr double kCellsAtLeast = 4096.0;

}  // namespace

InfluenceGrid::InfluenceGrid(std::span<const Vec3> points, std::span<const double> radii)
    : points_(points.begin(), points.end()), radii_(radii.begin(), radii.end()) {
  begin_.assign(2, 0);
  if (points_.empty()) return;

  double mean_radius = 0.0;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    box_.extend(Box(points_[i].array() - radii_[i], points_[i].array() + radii_[i]));
    mean_radius += radii_[i] / static_cast<double>(points_.size());
  }
  const auto count = static_cast<double>(points_.size());
  const Vec3 extent = box_.sizes();
  cell_ = kCellPerRadius * mean_radius;
  for (;; cell_ *= 1.25) {
    double entries = 0.0;
    for (const double radius : radii_) entries += std::pow(2.0 * radius / cell_ + 1.0, 3);
    const double cells = (extent / cell_).array().ceil().max(1.0).prod();
    if (entries <= kEntriesPerPoint * count &&
        cells <= std::max(kCellsAtLeast, kCellsPerPoint * count)) {
      break;
    }
  }
  size_ = (extent / cell_).array().ceil().max(1.0).cast<int>().matrix();

  // Two passes over the balls: count, then fill; each cell's list comes out ascending.
  const auto cell_of = [&](const Vec3& x) -> Eigen::Vector3i {
    return ((x - box_.min()) / cell_)
        .array()
        .floor()
        .cast<int>()
        .max(0)
        .min(size_.array() - 1)
        .matrix();
  };
  const auto for_cells_touched = [&](std::size_t i, const auto& touch) {
    // A hair more than the radius, so that rounding in the choice of a cell loses no point.
    const double reach = radii_[i] + 1e-9 * cell_;
    const Vec3 arm = Vec3::Constant(reach);
    const Eigen::Vector3i low = cell_of(points_[i] - arm);
    const Eigen::Vector3i high = cell_of(points_[i] + arm);
    for (int z = low.z(); z <= high.z(); ++z) {
      for (int y = low.y(); y <= high.y(); ++y) {
        for (int x = low.x(); x <= high.x(); ++x) {
          const Vec3 corner = box_.min() + cell_ * Vec3(x, y, z);
          const Box cell(corner, corner + Vec3::Constant(cell_));
          if (cell.squaredExteriorDistance(points_[i]) > reach * reach) continue;
          touch((static_cast<std::size_t>(z) * size_.y() + y) * size_.x() + x);
        }
      }
    }
  };
  const std::size_t cells = static_cast<std::size_t>(size_.x()) * size_.y() * size_.z();
  begin_.assign(cells + 1, 0);
  for (std::size_t i = 0; i < points_.size(); ++i) {
    for_cells_touched(i, [&](std::size_t cell) { ++begin_[cell + 1]; });
  }
  for (std::size_t cell = 0; cell < cells; ++cell) begin_[cell + 1] += begin_[cell];
  items_.resize(begin_.back());
  std::vector<int> next(begin_.begin(), begin_.end() - 1);
  for (std::size_t i = 0; i < points_.size(); ++i) {
    for_cells_touched(i, [&](std::size_t cell) { items_[next[cell]++] = static_cast<int>(i); });
  }
}

void InfluenceGrid::reaching(const Vec3& x, std::vector<int>& found) const {
  found.clear();
  if (points_.empty() || !box_.contains(x)) return;
  const Vec3 local = (x - box_.min()) / cell_;
  const Eigen::Vector3i at = local.cast<int>().cwiseMin(size_ - Eigen::Vector3i::Ones());
  const std::size_t cell =
      (static_cast<std::size_t>(at.z()) * size_.y() + at.y()) * size_.x() + at.x();
  for (int item = begin_[cell]; item < begin_[cell + 1]; ++item) {
    const int i = items_[item];
    if ((x - points_[i]).squaredNorm() < radii_[i] * radii_[i]) found.push_back(i);
  }
}

std::vector<int> nearest_neighbours(std::span<const Vec3> points, int k) {
  if (k <= 0) return {};
  std::vector<int> neighbours(points.size() * static_cast<std::size_t>(k), -1);
  const KdTree tree(points);
  parallel_chunks(points.size(), 256, [&](std::size_t begin, std::size_t end) {
    std::vector<KdTree::Found> found;
    for (std::size_t i = begin; i < end; ++i) {
      tree.nearest(points[i], k, static_cast<int>(i), found);
      for (std::size_t j = 0; j < found.size(); ++j) neighbours[i * k + j] = found[j].index;
    }
  });
  return neighbours;
}

}  // namespace viscera
