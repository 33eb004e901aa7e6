// Which places of a folded surface air parts from each other.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "kernels/contact/surface_places.h"

namespace viscera {

/// Ways through tissue are long to follow, and places stay where they are at rest: what was found
/// of two of them is kept. It answers the same whatever was asked before, and by many threads at
/// once.
class SidesOfPlaces {
 public:
  /// `places`: of a body with folds.
  explicit SidesOfPlaces(const SurfacePlaces& places);
  SidesOfPlaces(const SidesOfPlaces&) = delete;
  SidesOfPlaces& operator=(const SidesOfPlaces&) = delete;
  ~SidesOfPlaces();

  /// Whether no way through tissue leads straight from a place to another (same_side.h).
  bool beyond_air(std::size_t place, std::size_t other) const {
    Row& known = row_of(place)[other];
    const std::uint8_t found = known.load(std::memory_order_relaxed);
    return (found == kUnknown ? find(place, other, known) : found) == kBeyond;
  }
  /// Finds that of all places within `reach` [m] in parallel, for who asks next.
  void look_around(std::size_t place, double reach) const;
  const Vec3& position(std::size_t place) const { return positions_[place]; }
  /// The nearest to a place on the surface that lies on its side.
  std::size_t nearest(const Vec3& position, const Vec3& normal) const;

 private:
  using Row = std::atomic<std::uint8_t>;
  static constexpr std::uint8_t kUnknown = 0, kSame = 1, kBeyond = 2;

  bool same(std::size_t place, const Vec3& position, const Vec3& normal) const;
  Row* row_of(std::size_t place) const {
    Row* row = rows_[place].load(std::memory_order_acquire);
    return row ? row : begin_row(place);
  }
  Row* begin_row(std::size_t place) const;
  std::uint8_t find(std::size_t place, std::size_t other, Row& known) const;

  std::shared_ptr<const TissuePaths> paths_;
  std::vector<Vec3> positions_, normals_;
  std::vector<double> spacings_;
  mutable std::vector<std::atomic<Row*>> rows_;  // null: nobody has asked (P)
};

}  // namespace viscera
