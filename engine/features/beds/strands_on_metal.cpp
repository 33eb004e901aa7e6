#include "engine/features/beds/strands_on_metal.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/features/beds/beds.h"

namespace viscera {

StrandsOnMetal::StrandsOnMetal(const World& world, const Bed& bed, const BedPlaces& places,
                               std::span<const MetalBall> metal, double thick)
    : places_(places),
      one_(world, bed.organs[0]),
      other_(world, bed.organs[1]),
      metal_(metal),
      thick_(thick) {}

bool StrandsOnMetal::touched(std::size_t bond) const {
  if (metal_.empty()) return false;
  const Vec3 begin = one_.place(places_.points[0][bond]);
  const Vec3 along = other_.place(places_.points[1][bond]) - begin;
  const double thick = thick_ * std::sqrt(places_.layer.areas[bond] / std::numbers::pi);
  return std::ranges::any_of(metal_, [&](const MetalBall& ball) {
    const double length = along.squaredNorm();
    const double share =
        length > 0.0 ? std::clamp((ball.middle - begin).dot(along) / length, 0.0, 1.0) : 0.0;
    return (begin + share * along - ball.middle).norm() < ball.radius + thick;
  });
}

}  // namespace viscera
