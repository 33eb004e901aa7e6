// How current spreads from a disc into tissue whose conductivity varies.
#pragma once

#include <array>
#include <vector>

#include "kernels/heat/bioheat.h"

namespace viscera {

/// In uniform tissue the potential of a disc of radius a on a half-space is a function of u = atan(zeta)
/// alone, zeta the oblate coordinate of the half-ellipsoids about the disc [Newman1966]. Where
/// conductivity varies, the potential is still taken as a function of u, the one that dissipates least
/// (Thomson's principle; so the resistance is never overrated by much, and is exact for uniform tissue and
/// for what varies from shell to shell, as drying under a contact does). With S(u) the conductance of a
/// shell, sum of sigma |grad u|^2 over it, current I heats a place by sigma |grad u|^2 (I / S)^2: within
/// a shell current goes round what is dry, between shells it can't.
class CurrentField {
 public:
  static constexpr int kMostShells = 16;

  /// Of a disc at `point` facing into the tissue against `outward`; warms bricks up to a few radii away.
  /// Dried layers thinner in all than `gap` [m] are crossed by sparks.
  CurrentField(Bioheat& heat, const Vec3& point, const Vec3& outward, double radius, double gap);

  double near_resistance() const { return near_; }  ///< of the tissue that is heated, with its sparks [Ohm]
  double far_resistance() const { return far_; }    ///< of the body beyond, at rest [Ohm]
  bool any_tissue() const { return !voxels_.empty(); }

  struct Heating {
    double tissue = 0.0, sparks = 0.0;  ///< [W]
  };
  /// Gives the tissue what `current` [A] makes of it, sparks the rest. What would heat a voxel beyond
  /// `hottest` [K] within dt is theirs too: such tissue has gone, and the current crosses gas.
  Heating heat_with(Bioheat& heat, double current, double hottest, double dt) const;

 private:
  struct Voxel {
    HeatBrick* brick;
    int index;
    float conductivity, if_wet;            ///< [S/m]
    std::array<float, kMostShells> share;  ///< integral of |grad u|^2 over its tissue in each shell [m]
  };

  void collect(HeatBrick& brick, const Bioheat& heat, double radius, double reach, int fine);
  void conduct(double radius, double whole, double gap);

  Vec3 point_, outward_;
  std::vector<Voxel> voxels_;
  int shells_ = 0;
  std::array<double, kMostShells> tissue_{};       ///< conductance of a unit of u by tissue alone [S]
  std::array<double, kMostShells> conductance_{};  ///< with sparks [S]
  double shell_ = 0.0;                         ///< thickness in u
  double near_ = 0.0, far_ = 0.0;
};

}  // namespace viscera
