// What leaves burning tissue in a frame: smoke, steam and fumes, with their heat, and how fast.
#pragma once

#include <span>
#include <vector>

#include "kernels/heat/bioheat.h"
#include "kernels/smoke/gas_mixture.h"

namespace viscera {

/// What left one brick of tissue.
struct Puff {
  BrickIndex brick;
  Vec3 place = Vec3::Zero();  ///< mean by mass, rest frame [m]
  double smoke = 0.0;         ///< [kg]
  double mass = 0.0;          ///< of gas [kg]
  double temperature = 0.0;   ///< mean by mass [K]
  GasGift gas;
  std::vector<Vec3> voxels;  ///< where it came from, rest frame [m]
};

/// In order of bricks. The share of what vaporises that is smoke is no gas.
std::vector<Puff> puffs_of(const Bioheat& heat, const GasMixture& mixture);

/// The area of a surface over voxels of that edge [m], as seen along its normal: that of the
/// columns which hold any [m2].
double area_over(std::span<const Vec3> voxels, const Vec3& outward, double edge);

/// At which a volume [m3] leaves through an area in dt: at most that of sound in steam [m/s].
double vent_speed(double volume, double area, double dt);

}  // namespace viscera
