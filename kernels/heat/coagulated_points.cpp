#include "kernels/heat/coagulated_points.h"

#include <algorithm>
#include <cmath>

#include "kernels/heat/damage.h"

namespace viscera {
namespace {

/// A voxel counts at its nearest point within this many edges of the cube that the point stands
/// for.
constexpr double kNearEnough = 1.5;
/// What has stiffened by less counts as sound: nobody feels it, and each point costs.
constexpr double kSlightest = 0.02;
/// Omega of coagulation and of collagen: where there is so little nothing is asked further.
constexpr float kLeastCoagulation = 1e-3f, kLeastCollagen = 1e-5f;
/// Tissue from which volumes are counted.
constexpr double kHalfAgain = 1.5;

bool has_changed(const HeatBrick& brick, std::size_t voxel) {
  return brick.coagulation[voxel] >= kLeastCoagulation || brick.collagen[voxel] >= kLeastCollagen;
}

bool has_changed(const HeatBrick& brick) {
  for (std::size_t v = 0; v < BrickField::kVoxels; ++v)
    if (has_changed(brick, v)) return true;
  return false;
}

}  // namespace

CoagulationGauge::CoagulationGauge(std::span<const Vec3> positions, std::span<const double> volumes)
    : tree_(positions), volumes_(volumes.begin(), volumes.end()) {
  for (const double volume : volumes_)
    mean_volume_ += volume / static_cast<double>(volumes_.size());
}

const CoagulationGauge::Nearest& CoagulationGauge::nearest_points(const HeatBricks& bricks,
                                                                  const HeatBrick& brick) {
  const int fresh = static_cast<int>(nearest_.size());
  const int number = numbers_.find_or_add(brick.index, fresh);
  if (number != fresh) return nearest_[static_cast<std::size_t>(number)];
  Nearest& nearest = nearest_.emplace_back();
  std::vector<KdTree::Found> found;
  for (int v = 0; v < BrickField::kVoxels; ++v) {
    tree_.nearest(bricks.centre(brick, v), 1, -1, found);
    std::int32_t& at = nearest[static_cast<std::size_t>(v)];
    at = -1;
    if (found.empty()) continue;
    const double volume = volumes_[static_cast<std::size_t>(found.front().index)];
    const double reach = kNearEnough * std::cbrt(std::max(volume, mean_volume_));
    if (found.front().distance2 <= reach * reach) at = found.front().index;
  }
  return nearest;
}

CoagulatedPoints CoagulationGauge::read(const HeatBricks& bricks, double water_fraction) {
  CoagulatedPoints points;
  points.stiffness.assign(volumes_.size(), 1.0);
  points.shrinkage.assign(volumes_.size(), 0.0);
  std::vector<double> gain(volumes_.size(), 0.0), loss(volumes_.size(), 0.0),
      seen(volumes_.size(), 0.0);
  const double voxel = std::pow(bricks.voxel(), 3);
  for (std::size_t b = 0; b < bricks.count(); ++b) {
    const HeatBrick& brick = bricks.brick(b);
    if (!brick.harmed || !has_changed(brick)) continue;
    const Nearest& nearest = nearest_points(bricks, brick);
    for (std::size_t v = 0; v < nearest.size(); ++v) {
      const double volume = voxel * static_cast<double>(brick.geometry->fraction[v]);
      if (volume <= 0.0) continue;
      const bool changed = has_changed(brick, v);
      const TissueState state =
          changed ? tissue_state(brick.coagulation[v], brick.water[v], brick.charred[v])
                  : TissueState{};
      const double factor = changed ? stiffness_factor(state) : 1.0;
      if (nearest[v] < 0) {
        if (factor >= kHalfAgain) points.left_out += volume;
        continue;
      }
      const auto q = static_cast<std::size_t>(nearest[v]);
      seen[q] += volume;
      if (!changed) continue;
      gain[q] += volume * (factor - 1.0);
      loss[q] += volume * (1.0 - remaining_length(state, brick.collagen[v], water_fraction));
    }
  }
  for (std::size_t q = 0; q < volumes_.size(); ++q) {
    if (gain[q] <= 0.0 && loss[q] <= 0.0) continue;
    // A mean over more tissue than the point stands for, where voxels of others are nearest to it.
    const double whole = std::max(volumes_[q], seen[q]);
    if (gain[q] >= kSlightest * whole) points.stiffness[q] = 1.0 + gain[q] / whole;
    points.shrinkage[q] = loss[q] / whole;
    points.greatest_stiffness = std::max(points.greatest_stiffness, points.stiffness[q]);
    if (points.stiffness[q] >= kHalfAgain) points.stiffened += volumes_[q];
  }
  return points;
}

std::size_t CoagulationGauge::memory_bytes() const {
  return volumes_.size() * (sizeof(double) + sizeof(Vec3) + sizeof(int)) +
         nearest_.size() * sizeof(Nearest) + numbers_.memory_bytes();
}

}  // namespace viscera
