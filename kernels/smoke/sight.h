// How well one sees through smoke: independent of any rendering.
#pragma once

#include <span>

#include "kernels/smoke/smoke.h"
#include "kernels/smoke/smoke_optics.h"

namespace viscera {

/// The smoke of a cavity: grids, which may overlap (empty ones hold nothing), and what is mixed
/// evenly into all of it.
struct SmokyCavity {
  std::span<const SmokeGrid* const> grids;
  double background = 0.0;  ///< [kg/m3]
  SmokeOptics optics;
};

/// Optical depth between two points [m]: mass extinction times the integral of the density, which
/// is linear between cell centres, constant in a grid's outermost half cells and nothing beyond.
double optical_depth(const SmokyCavity& cavity, const Vec3& from, const Vec3& to);

/// Mean of exp(-optical depth) from the lens to points spread evenly over a disc of this radius [m]
/// about a tip, square to the line of sight; an open view gives 1. The points are always the same.
double mean_transmittance(const SmokyCavity& cavity, const Vec3& lens, const Vec3& tip,
                          double radius);

}  // namespace viscera
