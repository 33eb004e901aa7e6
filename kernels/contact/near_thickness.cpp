#include "kernels/contact/near_thickness.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

namespace viscera {
namespace {

/// Deeper than this an exponential says nothing any more; q t.
constexpr double kDeep = 20.0;
/// Thicknesses that are told apart, in sigma; between them lie so many steps of equal ratio.
constexpr double kThinnest = 0.25, kThickest = 16.0;
constexpr std::size_t kSteps = 60;
/// Wave numbers of a band, in 1 / sigma: it has 2e-7 of itself beyond.
constexpr double kMostWaves = 8.0;
constexpr std::size_t kWaves = 400;
/// Tissue is as if without an end where this share more is all that a load of the usual width
/// meets.
constexpr double kFelt = 0.01;
/// The least cosine between the surface's sides at which they make a layer.
constexpr double kParallel = 0.5;
/// Ways down begin below the surface by this share of them: past the triangles about the place.
constexpr double kBelow = 1e-4;

/// A layer's moduli by its thickness.
class LayerTable {
 public:
  explicit LayerTable(double poisson_ratio) {
    for (std::size_t i = 0; i <= kSteps; ++i)
      moduli_[i] = layer_modulus(
          kThinnest * std::pow(kThickest / kThinnest, static_cast<double>(i) / kSteps),
          poisson_ratio);
  }
  LayerModulus at(double thickness) const {
    const double place =
        std::clamp(std::log(thickness / kThinnest) / std::log(kThickest / kThinnest), 0.0, 1.0) *
        kSteps;
    const auto low = std::min(static_cast<std::size_t>(place), kSteps - 1);
    const double rest = place - static_cast<double>(low);
    const LayerModulus &a = moduli_[low], &b = moduli_[low + 1];
    return {std::lerp(a.pressed, b.pressed, rest), std::lerp(a.pulled, b.pulled, rest)};
  }

 private:
  std::array<LayerModulus, kSteps + 1> moduli_;
};

/// How far below a place of the surface, within `reach`, the body ends held [m].
std::optional<double> held_below(const Vec3& place, const Vec3& normal, double reach,
                                 const TriangleSurface& body, const SurfaceTree& tree,
                                 const std::function<bool(const Vec3&)>& is_fixed) {
  const Vec3 from = place - kBelow * reach * normal, to = place - reach * normal;
  std::vector<SurfaceTree::Crossing> found;
  tree.crossings(from, to, found);
  if (found.empty()) return std::nullopt;
  const Vec3 end = from + found.front().share * (to - from);
  const Vec3 outward = area_vector(body, found.front().triangle);
  if (!(-normal.dot(outward) > kParallel * outward.norm()) || !is_fixed(end)) return std::nullopt;
  return (end - place).norm();
}

}  // namespace

double layer_softness_pressed(double x, double poisson_ratio) {
  if (x > kDeep) return 1.0;
  const double k = 3.0 - 4.0 * poisson_ratio;
  return (2.0 * k * std::sinh(2.0 * x) - 4.0 * x) /
         (2.0 * k * std::cosh(2.0 * x) + 4.0 * x * x + 1.0 + k * k);
}

double layer_softness_pulled(double x, double poisson_ratio) {
  if (x > kDeep) return 1.0;
  const double k = 3.0 - 4.0 * poisson_ratio;
  const double along = (2.0 * k * std::sinh(2.0 * x) + 4.0 * x) /
                       (2.0 * k * std::cosh(2.0 * x) + 4.0 * x * x + 1.0 + k * k);
  return ((1.0 - poisson_ratio) * along + std::tanh(x)) / (2.0 - poisson_ratio);
}

LayerModulus layer_modulus(double thickness, double poisson_ratio) {
  const double t = std::max(kThinnest, thickness);
  double whole = 0.0, pressed = 0.0, pulled = 0.0;
  for (std::size_t i = 0; i < kWaves; ++i) {
    const double q = kMostWaves * (static_cast<double>(i) + 0.5) / kWaves;
    const double disc = 2.0 * std::cyl_bessel_j(1.0, q) / q;
    const double band = disc * disc * (std::exp(-0.25 * q * q) - std::exp(-q * q));
    whole += band;
    pressed += band * layer_softness_pressed(q * t, poisson_ratio);
    pulled += band * layer_softness_pulled(q * t, poisson_ratio);
  }
  return {whole / pressed, whole / pulled};
}

void note_thickness(TouchableSurface& surface, const IsotropicMaterial& material, double spread,
                    const TriangleSurface& body, const SurfaceTree& tree,
                    const std::function<bool(const Vec3&)>& is_fixed) {
  constexpr std::size_t kScales = TouchableSurface::kModulusScales;
  const LayerTable table(material.poisson_ratio);
  for (std::size_t t = 0; t < surface.size(); ++t) {
    const double usual = spread * surface.spacings[t];
    const auto thickness = held_below(surface.positions[t], surface.normals[t], kThickest * usual,
                                      body, tree, is_fixed);
    if (!thickness) continue;
    const bool thin = table.at(*thickness / usual).pressed > 1.0 + kFelt;
    if (surface.modulus.empty()) {
      if (!thin) continue;
      surface.modulus.assign(2 * kScales * surface.size(), 1.0f);
    }
    for (std::size_t s = 0; s < kScales; ++s) {
      const double sigma = std::ldexp(2.0 * usual, -static_cast<int>(s));
      const LayerModulus layer = table.at(*thickness / sigma);
      surface.modulus[2 * (kScales * t + s)] *= static_cast<float>(layer.pressed);
      surface.modulus[2 * (kScales * t + s) + 1] *= static_cast<float>(layer.pulled);
    }
  }
}

}  // namespace viscera
