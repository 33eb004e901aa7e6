#include "kernels/contact/sides_of_places.h"

#include <algorithm>
#include <numeric>

#include "kernels/contact/same_side.h"

namespace viscera {
namespace {

/// Of the nearest places to a point so many are asked whether they lie on its side.
constexpr std::size_t kAsked = 16;

}  // namespace

SidesOfPlaces::SidesOfPlaces(const SurfacePlaces& places)
    : paths_(places.paths),
      positions_(places.positions),
      normals_(places.normals),
      spacings_(places.spacings),
      together_(places.size()) {}

bool SidesOfPlaces::same(std::size_t place, const Vec3& position, const Vec3& normal) const {
  return same_side(paths_.get(), kSideDepth * spacings_[place], positions_[place], normals_[place],
                   position, normal);
}

bool SidesOfPlaces::beyond_air(std::size_t place, std::size_t other) const {
  return place != other && !together_.ask(place, other, [&](std::size_t a, std::size_t b) {
    return same(a, positions_[b], normals_[b]);
  });
}

std::size_t SidesOfPlaces::nearest(const Vec3& position, const Vec3& normal) const {
  std::vector<std::size_t> order(positions_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto last = order.begin() + static_cast<std::ptrdiff_t>(std::min(kAsked, order.size()));
  std::partial_sort(order.begin(), last, order.end(), [&](std::size_t a, std::size_t b) {
    return (positions_[a] - position).squaredNorm() < (positions_[b] - position).squaredNorm();
  });
  const auto found =
      std::find_if(order.begin(), last, [&](std::size_t p) { return same(p, position, normal); });
  return found == last ? order.front() : *found;
}

std::size_t SidesOfPlaces::memory_bytes() const {
  const auto of = [](const auto& v) { return v.size() * sizeof(v[0]); };
  return of(positions_) + of(normals_) + of(spacings_) + together_.memory_bytes();
}

}  // namespace viscera
