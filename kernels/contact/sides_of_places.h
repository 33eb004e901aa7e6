// Which places of a folded surface air parts from each other.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "kernels/contact/surface_places.h"

namespace viscera {

/// Ways through tissue are long to follow, and places stay where they are at rest: what was found
/// of two of them is kept. Asked by many threads at once, it answers the same whoever was first.
class SidesOfPlaces {
 public:
  /// `places`: of a body with folds.
  explicit SidesOfPlaces(const SurfacePlaces& places);
  SidesOfPlaces(const SidesOfPlaces&) = delete;
  SidesOfPlaces& operator=(const SidesOfPlaces&) = delete;
  ~SidesOfPlaces();

  /// Follows the ways from a place to all others within `reach` [m] that it hasn't followed yet.
  void look_around(std::size_t place, double reach) const;
  /// Whether it has found the other one beyond air; places that were out of reach aren't.
  bool beyond_air(std::size_t place, std::size_t other) const {
    const Row* row = rows_[place].load(std::memory_order_acquire);
    return row && row[other].load(std::memory_order_relaxed) == kBeyond;
  }
  const Vec3& position(std::size_t place) const { return positions_[place]; }
  /// The nearest to a place on the surface that lies on its side.
  std::size_t nearest(const Vec3& position, const Vec3& normal) const;

 private:
  using Row = std::atomic<std::uint8_t>;
  static constexpr std::uint8_t kUnknown = 0, kSame = 1, kBeyond = 2;

  bool same(std::size_t place, const Vec3& position, const Vec3& normal) const;
  Row* row_of(std::size_t place) const;

  std::shared_ptr<const TissuePaths> paths_;
  std::vector<Vec3> positions_, normals_;
  std::vector<double> spacings_;
  mutable std::vector<std::atomic<Row*>> rows_;  // null: nobody has asked (P)
};

}  // namespace viscera
