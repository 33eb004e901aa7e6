// Checks of `viscera stress --whole` on bodies that touch each other, by measures of their own.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "engine/simulation/world.h"

namespace viscera {

/// Farther than this inside another organ, beyond where it was at rest, no vertex of the drawn
/// surface may lie [m]. Where an organ has come to lie in another, forces don't mean much.
inline constexpr double kMostInside = 1e-3;
/// What energy may rise by within a still scene: a share of the greatest that it had while still,
/// and this besides [J]. Chosen: a step's minimum is found to its residual. A millijoule lifts a
/// gram by 100 mm.
inline constexpr double kEnergyRise = 0.05, kEnergyFloor = 1e-7;

/// How deep vertices of one organ of each pair lie in the other, by the signed distance
/// [Baerentzen2005] from its drawn surface: neither patches nor Embree have a part in it.
class Insides {
 public:
  explicit Insides(const World& world);
  struct Deepest {
    double depth = 0.0;  ///< beyond that of the same vertex at rest [m]
    std::string what;    ///< "organ0 in organ1"
  };
  Deepest deepest(const World& world) const;

 private:
  struct Side {
    Entity inner, outer;
    std::vector<float> at_rest;  // of the inner's vertices [m]
  };
  std::vector<Side> sides_;
};

/// Strain energy of all organs at finite strain, what contact has stored under their cells besides
/// (FiniteContact::near_energy: under a small tip, ten times as much), and that of their motion,
/// with the share of their mass that each node's spacing cubed gives it [J].
double energy_of(const World& world);

/// Watches that energy doesn't rise: from each frame's to any later one's.
class EnergyWatch {
 public:
  /// Greatest rise so far over what may be, and as words where that is over 1.
  void add(std::uint64_t frame, double energy);
  const std::optional<std::string>& failure() const { return failure_; }

 private:
  std::optional<double> least_;
  double greatest_ = 0.0;
  std::uint64_t least_at_ = 0;
  std::optional<std::string> failure_;
};

}  // namespace viscera
