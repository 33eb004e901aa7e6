#include "kernels/contact/sides_of_places.h"

#include <algorithm>
#include <numeric>

#include "kernels/base/parallel.h"
#include "kernels/contact/same_side.h"

namespace viscera {
namespace {

constexpr std::size_t kPlaceChunk = 64;
/// Of the nearest places to a point so many are asked whether they lie on its side.
constexpr std::size_t kAsked = 16;

}  // namespace

SidesOfPlaces::SidesOfPlaces(const SurfacePlaces& places)
    : paths_(places.paths),
      positions_(places.positions),
      normals_(places.normals),
      spacings_(places.spacings),
      rows_(places.size()) {}

SidesOfPlaces::~SidesOfPlaces() {
  for (std::atomic<Row*>& row : rows_) delete[] row.load();
}

bool SidesOfPlaces::same(std::size_t place, const Vec3& position, const Vec3& normal) const {
  return same_side(paths_.get(), kSideDepth * spacings_[place], positions_[place], normals_[place],
                   position, normal);
}

SidesOfPlaces::Row* SidesOfPlaces::begin_row(std::size_t place) const {
  auto fresh = std::make_unique<Row[]>(positions_.size());
  Row* row = nullptr;
  if (rows_[place].compare_exchange_strong(row, fresh.get(), std::memory_order_acq_rel))
    return fresh.release();
  return row;  // another thread was first
}

std::uint8_t SidesOfPlaces::find(std::size_t place, std::size_t other, Row& known) const {
  const std::uint8_t found = same(place, positions_[other], normals_[other]) ? kSame : kBeyond;
  known.store(found, std::memory_order_relaxed);
  return found;
}

void SidesOfPlaces::look_around(std::size_t place, double reach) const {
  parallel_for_each_index(positions_.size(), kPlaceChunk, [&](std::size_t p) {
    if ((positions_[p] - positions_[place]).squaredNorm() < reach * reach) beyond_air(place, p);
  });
}

std::size_t SidesOfPlaces::nearest(const Vec3& position, const Vec3& normal) const {
  std::vector<std::size_t> order(positions_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const std::size_t asked = std::min(kAsked, order.size());
  const auto last = order.begin() + static_cast<std::ptrdiff_t>(asked);
  std::partial_sort(order.begin(), last, order.end(), [&](std::size_t a, std::size_t b) {
    return (positions_[a] - position).squaredNorm() < (positions_[b] - position).squaredNorm();
  });
  const auto found =
      std::find_if(order.begin(), last, [&](std::size_t p) { return same(p, position, normal); });
  return found == last ? order.front() : *found;
}

}  // namespace viscera
