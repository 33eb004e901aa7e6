// Places of a surface that are chosen one after another, none near another.
#pragma once

#include <array>
#include <map>
#include <vector>

#include "kernels/base/types.h"

namespace viscera {

/// What faces the same way by this cosine (60 degrees) is one face; where a surface turns by more
/// lies an edge.
inline constexpr double kSameFace = 0.5;

/// Those chosen so far, by cells of a grid.
class ChosenPlaces {
 public:
  /// `reach`: what is asked at most [m].
  explicit ChosenPlaces(double reach) : edge_(reach) {}
  /// Index of the nearest within `radius` that faces as `normal` does; -1: none.
  int nearest(const Vec3& x, const Vec3& normal, double radius) const;
  void add(const Vec3& x, const Vec3& normal, int index);

 private:
  struct Place {
    Vec3 place, normal;
    int index = 0;
  };
  using Cell = std::array<int, 3>;
  Cell cell_of(const Vec3& x) const;

  double edge_;
  std::map<Cell, std::vector<Place>> cells_;
};

}  // namespace viscera
