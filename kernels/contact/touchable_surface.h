// The part of a body's surface that tools may touch, as places over which contact loads are spread.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "kernels/base/result.h"
#include "kernels/contact/surface_places.h"

namespace viscera {

/// The touchable places of a surface, in the order of the columns of a compliance. Immutable; built
/// once in pre-processing.
struct TouchableSurface {
  std::vector<int> places;       ///< of SurfacePlaces, ascending: SurfaceCompliance::touchable  (S)
  std::vector<Vec3> positions;   ///< rest [m]                                                   (S)
  std::vector<Vec3> normals;     ///< outward, unit                                              (S)
  std::vector<double> areas;     ///< [m2]                                                       (S)
  std::vector<double> spacings;  ///< local node spacing h [m]                                   (S)
  /// What loads of several widths meet under it, over the material's modulus (near_modulus.h);
  /// empty: 1 everywhere                                                     (S x kModulusScales x
  /// 2)
  std::vector<float> modulus;
  static constexpr std::size_t kModulusScales = 6;
  std::shared_ptr<const TissuePaths> paths;  ///< of SurfacePlaces
  // Uniform grid over positions for range queries.
  Box box;
  double cell = 1.0;  ///< [m]
  Eigen::Vector3i cells = Eigen::Vector3i::Ones();
  std::vector<int> cell_begin, cell_items;

  std::size_t size() const { return positions.size(); }
};

/// The places for which `is_touchable` holds. Fails where there is none.
Result<TouchableSurface> touchable_part(const SurfacePlaces& places,
                                        const std::function<bool(const Vec3&)>& is_touchable);

/// True where `x` (rest, on the surface) lies among the touchable places.
bool is_touchable(const TouchableSurface& touchable, const Vec3& x);

/// A touchable place and its share of a load.
struct LoadShare {
  int place;  ///< index into TouchableSurface
  double share;
};

/// Node spacing about a point, averaged over the samples around it; smooth along the surface [m].
double spacing_at(const TouchableSurface& surface, const Vec3& position);

/// How far about a place the tissue counts for what is finer than the nodes, in their spacings: as
/// narrow as places allow, since what is wider is the compliance's part.
inline constexpr double kFeltSpacings = 0.35;

/// The numbers of `modulus` at a point of the surface, by a bell over the places about it that face
/// its way. Allocates nothing; the surface has such numbers.
std::array<double, 2 * TouchableSurface::kModulusScales> modulus_about(
    const TouchableSurface& surface, const Vec3& position, const Vec3& normal);

/// A unit load at `position` (outward unit surface `normal`) spread over the places about it by a
/// bell of standard deviation `sigma` [m] whose centre is the position. Shares add up to 1 and have
/// the bell's own second moments along the surface, but for borders and edges, where that would
/// take large negative shares. Places that face away carry nothing, nor do those beyond air, so
/// that a load stays on its side of a thin body or a fold. False when no place is in reach: the
/// nearest one then carries all.
bool spread_load(const TouchableSurface& surface, const Vec3& position, const Vec3& normal,
                 double sigma, std::vector<LoadShare>& shares);
/// The same without new memory, once the vectors are large enough; `offsets` (along the surface,
/// over the reach) is for this function alone.
bool spread_load(const TouchableSurface& surface, const Vec3& position, const Vec3& normal,
                 double sigma, std::vector<LoadShare>& shares, std::vector<Vec2>& offsets);
/// No more places than these take a share in such a load: how large the vectors must be.
std::size_t places_in_reach(const TouchableSurface& surface, const Vec3& position, double sigma);

}  // namespace viscera
