#include "engine/features/smoke/puffs.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace viscera {
namespace {

constexpr double kSound = 473.0;  // in steam at 100 C, recalled [m/s]

}  // namespace

std::vector<Puff> puffs_of(const Bioheat& heat, const GasMixture& mixture) {
  std::vector<Puff> puffs;
  for (const Vapour& vapour : heat.vapour()) {
    const double smoke = heat.smoke(vapour), lost = vapour.water + vapour.tissue;
    if (!(lost > 0.0)) continue;
    const BrickIndex brick = BrickField::brick_of(heat.bricks().voxel_of(vapour.position));
    // Vapour comes in order of bricks.
    if (puffs.empty() || puffs.back().brick != brick) puffs.push_back({.brick = brick});
    Puff& puff = puffs.back();
    const double gas = 1.0 - smoke / lost;
    puff.smoke += smoke;
    puff.mass += gas * lost;
    puff.place += lost * vapour.position;
    puff.temperature += lost * vapour.temperature;
    puff.gas += GasGift::steam(mixture, gas * vapour.water, vapour.temperature);
    puff.gas += GasGift::fumes(mixture, gas * vapour.tissue, vapour.temperature);
    puff.voxels.push_back(vapour.position);
  }
  for (Puff& puff : puffs) {
    const double lost = puff.smoke + puff.mass;
    puff.place /= lost;
    puff.temperature /= lost;
  }
  return puffs;
}

double area_over(std::span<const Vec3> voxels, const Vec3& outward, double edge) {
  const Vec3 first = outward.unitOrthogonal(), second = outward.cross(first).normalized();
  std::vector<std::pair<long, long>> columns;
  for (const Vec3& at : voxels)
    columns.emplace_back(std::lround(at.dot(first) / edge), std::lround(at.dot(second) / edge));
  std::ranges::sort(columns);
  const auto repeated = std::ranges::unique(columns);
  columns.erase(repeated.begin(), repeated.end());
  return static_cast<double>(columns.size()) * edge * edge;
}

double vent_speed(double volume, double area, double dt) {
  return area > 0.0 && dt > 0.0 ? std::min(volume / (area * dt), kSound) : 0.0;
}

}  // namespace viscera
