#include "kernels/heat/heat_bridge.h"

#include <algorithm>
#include <cmath>

namespace viscera {
namespace {

/// Of the difference, within a step, from either side.
constexpr double kMostAStep = 0.25;

struct BridgeEnd {
  HeatBrick* brick = nullptr;
  int voxel = 0;
  double capacity = 0.0;  // [J/K]
};

BridgeEnd end_at(Bioheat& heat, const BrickIndex& voxel) {
  const BrickIndex index = BrickField::brick_of(voxel);
  BridgeEnd end{heat.bricks().warm_up(index), BrickField::place_in_brick(voxel, index), 0.0};
  if (end.brick) end.capacity = heat.voxel_capacity(*end.brick, end.voxel);
  return end;
}

}  // namespace

double conduct(Bioheat& one, const Vec3& at_one, Bioheat& other, const Vec3& at_other,
               double conductance, double dt) {
  const BrickIndex from = one.bricks().voxel_of(at_one), to = other.bricks().voxel_of(at_other);
  const double warmer = one.options().body + one.bricks().excess_at(from) -
                        (other.options().body + other.bricks().excess_at(to));
  if (std::abs(warmer) <= one.options().followed) return 0.0;
  const BridgeEnd first = end_at(one, from), second = end_at(other, to);
  const double capacity = std::min(first.capacity, second.capacity);
  if (!(capacity > 0.0)) return 0.0;
  const double power = std::min(conductance, kMostAStep * capacity / dt) * warmer;
  one.heat_voxel(*first.brick, first.voxel, -power);
  other.heat_voxel(*second.brick, second.voxel, power);
  return power * dt;
}

}  // namespace viscera
