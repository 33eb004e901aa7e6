// Smoke that passes are timed on: a box full of particles over an organ-like sheet, with a shaft
// in it.
#pragma once

#include <cstddef>
#include <vector>

#include "kernels/points/surface.h"
#include "kernels/smoke/smoke.h"

namespace viscera {

/// Particles at half the support radius, jittered, so that phi (viscosity.h) is about 1, as in the
/// midst of a plume, and up to five seconds old. Cold, in gas that turns slowly: nothing moves far
/// enough in a step of 1/60 s to ask for substeps. The sheet's bumps grow and shrink.
class SmokeCase {
 public:
  explicit SmokeCase(std::size_t particles);
  SmokeCase(const SmokeCase&) = delete;
  SmokeCase& operator=(const SmokeCase&) = delete;

  const SmokeParameters& parameters() const { return parameters_; }
  /// Emits the particles.
  void fill(SmokeVolume& volume) const;

  const TriangleSurface& sheet() const { return sheet_; }  ///< closed; at rest, world [m]
  /// How the gas moves at first: a vortex, without divergence [m/s].
  Vec3 stirring(const Vec3& at) const;
  /// What the particles meet at this time [s]; valid until the next call.
  SmokeSurroundings around(double time);

 private:
  std::size_t particles_;
  double width_ = 0.0;  // of the box along x and y [m]
  SmokeParameters parameters_;
  TriangleSurface sheet_;
  SurfaceTopology topology_;
  std::vector<Vec3f> corners_;  // of the sheet now
  SmokeSurface surface_;
  SmokeObstacle shaft_;
};

}  // namespace viscera
