#include "kernels/parting/tissue_share.h"

#include <algorithm>
#include <numbers>

namespace viscera {
namespace {

/// From half a share to none or all of it, in voxels: from corner to corner of one, so that it is
/// linear along all edges between middles that meet a wall.
const double kRamp = std::numbers::sqrt3;

}  // namespace

bool TissueShare::limit(const Voxel& voxel, double share) {
  const auto gone = static_cast<float>(1.0 - std::clamp(share, 0.0, 1.0));
  if (!(gone > gone_.at(voxel))) return false;
  const Voxel brick = BrickField::brick_of(voxel);
  const Voxel local = voxel - kEdge * brick;
  const auto at = static_cast<std::size_t>(local.x() + kEdge * (local.y() + kEdge * local.z()));
  gone_.brick(gone_.ensure(brick))[at] = gone;
  return true;
}

bool TissueShare::take_out(const Box& reach, const std::function<double(const Vec3&)>& distance) {
  if (reach.isEmpty()) return false;
  const Voxel low = gone_.voxel_of(reach.min() - shift()) - Voxel::Constant(2);
  const Voxel high = gone_.voxel_of(reach.max() - shift()) + Voxel::Constant(2);
  bool less = false;
  for (int z = low.z(); z <= high.z(); ++z)
    for (int y = low.y(); y <= high.y(); ++y)
      for (int x = low.x(); x <= high.x(); ++x) {
        const Voxel voxel(x, y, z);
        const double share = 0.5 + 0.5 * distance(middle(voxel)) / (kRamp * gone_.voxel());
        if (share < 1.0) less = limit(voxel, share) || less;
      }
  return less;
}

std::vector<TissueShare::Voxel> TissueShare::bricks() const {
  std::vector<Voxel> lowest;
  for (const Voxel& brick : gone_.brick_indices()) lowest.push_back(kEdge * brick);
  return lowest;
}

}  // namespace viscera
