#include "engine/features/touching/chosen_places.h"

#include <cmath>

namespace viscera {

int ChosenPlaces::nearest(const Vec3& x, const Vec3& normal, double radius) const {
  const Cell home = cell_of(x);
  int found = -1;
  double best = radius * radius;
  for (int dz = -1; dz <= 1; ++dz)
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx) {
        const auto at = cells_.find({home[0] + dx, home[1] + dy, home[2] + dz});
        if (at == cells_.end()) continue;
        for (const Place& one : at->second)
          if (const double d = (one.place - x).squaredNorm();
              d < best && one.normal.dot(normal) > kSameFace) {
            best = d;
            found = one.index;
          }
      }
  return found;
}

void ChosenPlaces::add(const Vec3& x, const Vec3& normal, int index) {
  cells_[cell_of(x)].push_back({x, normal, index});
}

ChosenPlaces::Cell ChosenPlaces::cell_of(const Vec3& x) const {
  Cell cell;
  for (int a = 0; a < 3; ++a)
    cell[static_cast<std::size_t>(a)] = static_cast<int>(std::floor(x[a] / edge_));
  return cell;
}

}  // namespace viscera
