// Strands of bonds, between their ends as they are drawn, that lie on metal.
#pragma once

#include <span>

#include "engine/features/beds/bed_places.h"
#include "engine/features/touching/drawn_organ.h"

namespace viscera {

struct Bed;

struct MetalBall {
  Vec3 middle = Vec3::Zero();  ///< world [m]
  double radius = 0.0;         ///< [m]
};

/// Refers to what it is made of. A strand is as thick as this share of the radius of the area that
/// its bond stands for.
class StrandsOnMetal {
 public:
  StrandsOnMetal(const World& world, const Bed& bed, const BedPlaces& places,
                 std::span<const MetalBall> metal, double thick);

  bool touched(std::size_t bond) const;

 private:
  const BedPlaces& places_;
  DrawnOrgan one_, other_;
  std::span<const MetalBall> metal_;
  double thick_;
};

}  // namespace viscera
