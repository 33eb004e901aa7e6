// How much heat a voxel of tissue may still take from a current.
#pragma once

#include "kernels/heat/bioheat.h"

namespace viscera {

/// Char glows and crumbles beyond this: there current crosses gas instead [K].               [R]
inline constexpr double kHottest = 1300.0;

struct HeatRoom {
  double kelvin = 0.0;    ///< now
  double capacity = 0.0;  ///< [J/K]
  double to_boil = 0.0;   ///< [J]
  double latent = 0.0;    ///< of its water [J]
  double room = 0.0;      ///< until kHottest, beyond which nothing is left to warm but char [J]
};
/// Of a warm brick's voxel as the step begins.
HeatRoom heat_room(const Bioheat& heat, const HeatBrick& brick, int voxel);
/// What electrodes have put into it for the step of dt [s] so far [J].
double heat_taken(const Bioheat& heat, const HeatBrick& brick, int voxel, double dt);

}  // namespace viscera
