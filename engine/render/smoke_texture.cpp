#include "engine/render/smoke_texture.h"

#include <epoxy/gl.h>

#include <string>

namespace viscera {

Result<void> SmokeTexture::update(const SmokeView& view) {
  const Eigen::Vector3i n = view.size;
  filled_.setEmpty();
  if ((n.array() < 1).any() ||
      view.density.size() != static_cast<std::size_t>(n.x()) * n.y() * n.z()) {
    return failure("smoke volume: " + std::to_string(view.density.size()) +
                   " densities, expected one for each of " + std::to_string(n.x()) + " x " +
                   std::to_string(n.y()) + " x " + std::to_string(n.z()) + " cells");
  }
  // Optical depth of a cell below which smoke can't be seen, whatever the number of cells.
  const Vec3 cell = view.domain.sizes().cwiseQuotient(n.cast<double>());
  const float least = static_cast<float>(1e-5 / (view.mass_extinction * cell.maxCoeff()));
  Eigen::Vector3i low = n, high = Eigen::Vector3i::Constant(-1);
  std::size_t index = 0;
  for (int z = 0; z < n.z(); ++z) {
    for (int y = 0; y < n.y(); ++y) {
      for (int x = 0; x < n.x(); ++x, ++index) {
        if (!(view.density[index] > least)) continue;
        low = low.cwiseMin(Eigen::Vector3i(x, y, z));
        high = high.cwiseMax(Eigen::Vector3i(x, y, z));
      }
    }
  }
  if (high.x() < 0) return {};
  // Linear filtering spreads a cell's smoke over one cell on each side.
  const Vec3 from = (low.cast<double>().array() - 1.0).max(0.0);
  const Vec3 to = (high.cast<double>().array() + 2.0).min(n.cast<double>().array());
  filled_ =
      Box(view.domain.min() + from.cwiseProduct(cell), view.domain.min() + to.cwiseProduct(cell));
  if (!density_ || density_.width() != n.x() || density_.height() != n.y() ||
      density_.depth() != n.z()) {
    density_ = Texture(GL_R32F, n.x(), n.y(), n.z());
  }
  density_.upload_3d(0, 0, 0, n.x(), n.y(), n.z(), GL_RED, GL_FLOAT, view.density.data());
  return {};
}

}  // namespace viscera
