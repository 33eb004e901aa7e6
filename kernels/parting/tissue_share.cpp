#include "kernels/parting/tissue_share.h"

#include <algorithm>
#include <numbers>

namespace viscera {
namespace {

/// From half a share to none or all of it, in voxels: from corner to corner of one, so that it is
/// linear along all edges between middles that meet a wall.
const double kRamp = std::numbers::sqrt3;

}  // namespace

double TissueShare::limit(const Voxel& voxel, double share) {
  const auto gone = static_cast<float>(1.0 - std::clamp(share, 0.0, 1.0));
  const float before = gone_.at(voxel);
  if (!(gone > before)) return 0.0;
  const Voxel brick = BrickField::brick_of(voxel);
  const auto at = static_cast<std::size_t>(BrickField::place_in_brick(voxel, brick));
  gone_.brick(gone_.ensure(brick))[at] = gone;
  return static_cast<double>(gone - before);
}

void TissueShare::limit_by(const TissueShare& other) {
  for (std::size_t b = 0; b < other.gone_.brick_count(); ++b) {
    BrickField::Values& gone = gone_.brick(gone_.ensure(other.gone_.brick_indices()[b]));
    const BrickField::Values& more = other.gone_.brick(b);
    for (std::size_t v = 0; v < gone.size(); ++v) gone[v] = std::max(gone[v], more[v]);
  }
}

double TissueShare::take_out(const Box& reach, const std::function<double(const Vec3&)>& distance) {
  if (reach.isEmpty()) return 0.0;
  const Voxel low = voxel_of(reach.min()) - Voxel::Constant(2);
  const Voxel high = voxel_of(reach.max()) + Voxel::Constant(2);
  double less = 0.0;
  for (int z = low.z(); z <= high.z(); ++z)
    for (int y = low.y(); y <= high.y(); ++y)
      for (int x = low.x(); x <= high.x(); ++x) {
        const Voxel voxel(x, y, z);
        const double share = 0.5 + 0.5 * distance(middle(voxel)) / (kRamp * gone_.voxel());
        if (share < 1.0) less += limit(voxel, share);
      }
  return less * gone_.voxel() * gone_.voxel() * gone_.voxel();
}

double TissueShare::taken_by_plate(double thickness) const {
  const double ramp = kRamp * voxel(), half = std::min(0.5 * thickness, ramp);
  return thickness - 2.0 * half + 0.5 * ramp + half + 0.5 * half * half / ramp;
}

bool TissueShare::fits(const State& state) {
  return BrickField::fits(state) &&
         std::ranges::all_of(state.values, [](const BrickField::Values& gone) {
           return std::ranges::all_of(gone, [](float one) { return one >= 0.0f && one <= 1.0f; });
         });
}

std::vector<TissueShare::Voxel> TissueShare::bricks() const {
  std::vector<Voxel> lowest;
  for (const Voxel& brick : gone_.brick_indices()) lowest.push_back(kEdge * brick);
  return lowest;
}

}  // namespace viscera
