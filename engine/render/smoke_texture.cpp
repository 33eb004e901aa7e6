#include "engine/render/smoke_texture.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <string>

namespace viscera {
namespace {

constexpr int kBrick = 8;  // cells along an edge

}  // namespace

void SmokeTexture::find_bricks(const SmokeView& view) {
  const Eigen::Vector3i n = view.size;
  const Vec3 cell = view.domain.sizes().cwiseQuotient(n.cast<double>());
  // Optical depth of a cell below which smoke can't be seen, whatever the number of cells.
  const float least =
      static_cast<float>(1e-5 / (view.optics.mass_extinction * cell.maxCoeff() + 1e-30));
  const Eigen::Vector3i count = (n.array() + kBrick - 1) / kBrick;
  std::vector<bool> filled(static_cast<std::size_t>(count.prod()), false);
  std::size_t index = 0;
  for (int z = 0; z < n.z(); ++z) {
    for (int y = 0; y < n.y(); ++y) {
      const int row = count.x() * (y / kBrick + count.y() * (z / kBrick));
      for (int x = 0; x < n.x(); ++x, ++index) {
        if (view.density[index] > least) filled[static_cast<std::size_t>(row + x / kBrick)] = true;
      }
    }
  }
  filled_.setEmpty();
  bricks_.clear();
  for (int b = 0; b < count.prod(); ++b) {
    if (!filled[static_cast<std::size_t>(b)]) continue;
    const Eigen::Vector3i low = kBrick * Eigen::Vector3i(b % count.x(), b / count.x() % count.y(),
                                                         b / count.head<2>().prod());
    // Linear filtering spreads a cell's smoke over one cell on each side.
    const Vec3 from = (low.cast<double>().array() - 1.0).max(0.0);
    const Vec3 to = (low.cast<double>().array() + kBrick + 1.0).min(n.cast<double>().array());
    bricks_.emplace_back(view.domain.min() + from.cwiseProduct(cell),
                         view.domain.min() + to.cwiseProduct(cell));
    filled_.extend(bricks_.back());
  }
}

Result<void> SmokeTexture::update(const SmokeView& view, bool with_temperature) {
  const Eigen::Vector3i n = view.size;
  const std::size_t cells =
      (n.array() < 1).any() ? 0 : static_cast<std::size_t>(n.x()) * n.y() * n.z();
  if (cells == 0 || view.density.size() != cells ||
      (!view.temperature.empty() && view.temperature.size() != cells)) {
    bricks_.clear();
    return failure("smoke volume: " + std::to_string(view.density.size()) + " densities and " +
                   std::to_string(view.temperature.size()) +
                   " temperatures, expected one density for each of " + std::to_string(n.x()) +
                   " x " + std::to_string(n.y()) + " x " + std::to_string(n.z()) +
                   " cells, and as many temperatures or none");
  }
  find_bricks(view);
  if (bricks_.empty()) return {};
  const bool both = with_temperature && !view.temperature.empty();
  const unsigned format = both ? GL_RG32F : GL_R32F;
  if (format != format_ || density_.width() != n.x() || density_.height() != n.y() ||
      density_.depth() != n.z()) {
    density_ = Texture(format, n.x(), n.y(), n.z());
    format_ = format;
  }
  const float* values = view.density.data();
  if (both) {
    both_.resize(2 * cells);
    for (std::size_t i = 0; i < cells; ++i) {
      both_[2 * i] = view.density[i];
      both_[2 * i + 1] = view.temperature[i];
    }
    values = both_.data();
  }
  density_.upload_3d(0, 0, 0, n.x(), n.y(), n.z(), both ? GL_RG : GL_RED, GL_FLOAT, values);
  return {};
}

}  // namespace viscera
