// Which places of a folded surface air parts from each other.
#pragma once

#include <memory>
#include <vector>

#include "kernels/base/known_pairs.h"
#include "kernels/contact/surface_places.h"

namespace viscera {

/// Ways through tissue are long to follow, and places stay where they are at rest: what was found
/// of two of them is kept.
class SidesOfPlaces {
 public:
  /// `places`: of a body with folds.
  explicit SidesOfPlaces(const SurfacePlaces& places);

  /// Whether no way through tissue leads straight from one to the other (same_side.h).
  bool beyond_air(std::size_t place, std::size_t other) const;
  /// The nearest to a place on the surface that lies on its side; if none of the nearest few does,
  /// the nearest of all.
  std::size_t nearest(const Vec3& position, const Vec3& normal) const;

  std::size_t memory_bytes() const;

 private:
  bool same(std::size_t place, const Vec3& position, const Vec3& normal) const;

  std::shared_ptr<const TissuePaths> paths_;
  std::vector<Vec3> positions_, normals_;
  std::vector<double> spacings_;
  KnownPairs together_;
};

}  // namespace viscera
