#include "kernels/parting/tissue_share.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace viscera {
namespace {

/// Where voxel 0 has its middle, in voxels: so that planes at round coordinates pass through none.
const Vec3 kOffset(0.18301, 0.31415, 0.27182);

/// From half a share to none or all of it, in voxels: from corner to corner of one, so that it is
/// linear along all edges between middles that meet a wall.
const double kRamp = std::numbers::sqrt3;

int floor_divided(int number, int by) {
  return (number >= 0 ? number : number - by + 1) / by;
}

}  // namespace

TissueShare::TissueShare(double voxel) : voxel_(voxel) {}

TissueShare::Voxel TissueShare::brick_of(const Voxel& voxel) {
  return {floor_divided(voxel[0], kEdge), floor_divided(voxel[1], kEdge),
          floor_divided(voxel[2], kEdge)};
}

std::size_t TissueShare::within(const Voxel& voxel) {
  const Voxel brick = brick_of(voxel);
  std::size_t at = 0;
  for (std::size_t c = 3; c-- > 0;)
    at = at * kEdge + static_cast<std::size_t>(voxel[c] - kEdge * brick[c]);
  return at;
}

Vec3 TissueShare::middle(const Voxel& voxel) const {
  return voxel_ * (kOffset + Vec3(voxel[0], voxel[1], voxel[2]));
}

bool TissueShare::limit(const Voxel& voxel, double share) {
  const auto left = static_cast<float>(std::clamp(share, 0.0, 1.0));
  const Voxel number = brick_of(voxel);
  auto found = bricks_.find(number);
  if (found == bricks_.end()) {
    if (!(left < 1.0f)) return false;
    found = bricks_.emplace(number, Brick{}).first;
    found->second.fill(1.0f);
  }
  float& here = found->second[within(voxel)];
  if (!(left < here)) return false;
  here = left;
  return true;
}

bool TissueShare::take_out(const Box& reach, const std::function<double(const Vec3&)>& distance) {
  if (reach.isEmpty()) return false;
  Voxel low, high;
  for (int c = 0; c < 3; ++c) {
    const auto at = static_cast<std::size_t>(c);
    low[at] = static_cast<int>(std::floor(reach.min()[c] / voxel_ - kOffset[c])) - 2;
    high[at] = static_cast<int>(std::ceil(reach.max()[c] / voxel_ - kOffset[c])) + 2;
  }
  bool less = false;
  for (int z = low[2]; z <= high[2]; ++z)
    for (int y = low[1]; y <= high[1]; ++y)
      for (int x = low[0]; x <= high[0]; ++x) {
        const double share = 0.5 + 0.5 * distance(middle({x, y, z})) / (kRamp * voxel_);
        if (share < 1.0) less = limit({x, y, z}, share) || less;
      }
  return less;
}

double TissueShare::share(const Voxel& voxel) const {
  const auto found = bricks_.find(brick_of(voxel));
  return found == bricks_.end() ? 1.0 : static_cast<double>(found->second[within(voxel)]);
}

double TissueShare::share(const Vec3& place) const {
  const Vec3 at = place / voxel_ - kOffset;
  const Vec3 low(std::floor(at.x()), std::floor(at.y()), std::floor(at.z()));
  const Vec3 part = at - low;
  double sum = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    Voxel voxel;
    double weight = 1.0;
    for (int c = 0; c < 3; ++c) {
      const int up = corner >> c & 1;
      voxel[static_cast<std::size_t>(c)] = static_cast<int>(low[c]) + up;
      weight *= up == 1 ? part[c] : 1.0 - part[c];
    }
    sum += weight * share(voxel);
  }
  return sum;
}

std::size_t TissueShare::memory_bytes() const {
  return bricks_.size() * sizeof(std::pair<const Voxel, Brick>);
}

std::vector<TissueShare::Voxel> TissueShare::bricks() const {
  std::vector<Voxel> lowest;
  for (const auto& [number, brick] : bricks_)
    lowest.push_back({kEdge * number[0], kEdge * number[1], kEdge * number[2]});
  return lowest;
}

}  // namespace viscera
