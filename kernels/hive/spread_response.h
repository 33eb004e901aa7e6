// What a body does that a half-space wouldn't, between the surface nodes of a hive: both under the
// same loads, spread by Gaussians that the body's own nodes can carry
// (kernels/contact/near_field.h). Smooth where both are steep, so that the hive's few nodes carry
// it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/base/types.h"
#include "kernels/contact/touchable_surface.h"
#include "kernels/paff/elasticity.h"

namespace viscera {

class SpreadResponse {
 public:
  /// Takes all memory. `most_places`: touchable places under all loads of one gathering.
  SpreadResponse(const SurfaceCompliance& compliance, const TouchableSurface& surface,
                 const IsotropicMaterial& material, int most_nodes, std::size_t most_places);

  /// S (C - C_half-space / modulus) S^T between these places, (3 n) x (3 n), symmetric [m/N]; S
  /// spreads a load over the touchable places. False: they reach over more than `most_places`, or
  /// have more shares than there is memory for.
  bool gather(std::span<const Vec3> positions, std::span<const Vec3> normals, double modulus,
              Eigen::Ref<MatrixX> out) noexcept;

 private:
  struct Share {
    std::uint16_t local, node;
    float share;
  };
  void add_images(std::size_t first, std::size_t end) noexcept;

  const SurfaceCompliance& compliance_;
  const TouchableSurface& surface_;
  IsotropicMaterial material_;
  std::size_t most_places_;
  std::vector<LoadShare> shares_of_one_;
  std::vector<Vec2> offsets_;
  std::vector<Share> shares_;
  std::vector<double> sigmas_;
  std::vector<int> touched_, local_of_;
  Eigen::MatrixXf images_;  ///< C S^T on some touched places, (3 places) x (3 n)
  Eigen::MatrixXf rows_;    ///< its transpose
  Eigen::MatrixXf sums_;    ///< (S C S^T)^T, (3 n) x (3 n)
};

}  // namespace viscera
