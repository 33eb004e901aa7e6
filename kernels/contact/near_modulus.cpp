#include "kernels/contact/near_modulus.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "kernels/contact/touchable_surface.h"

namespace viscera {
namespace {

/// Depths that are asked, in spacings: each stands for the slab to the next, which is a fifth
/// thicker.
constexpr int kDepths = 30;
constexpr double kFirstDepth = 0.02, kGrowth = 1.22;
/// Wave number of a band over 1 / sigma: where exp(-s / 4) - exp(-s), s = (q sigma)^2, is greatest.
constexpr double kWaveNumber = 1.36;
/// Bands end where they are as narrow as the disc.
constexpr double kNarrowest = 0.6;

/// Share of the energy that lies above a depth, from the stresses of a half-space (plane strain):
/// pressed, (1 + x, 1 - x, x) exp(-x); pulled, (x, 2 - x, 1 - x) exp(-x), x = q z.
double pressed_above(double x, double poisson_ratio) {
  // Integral of e^(-2x) (1 - 2 nu + 2 x^2) / (1 - nu).
  const double n = 1.0 - 2.0 * poisson_ratio;
  return 1.0 - std::exp(-2.0 * x) * (0.5 * n + x * x + x + 0.5) / (1.0 - poisson_ratio);
}
double pulled_above(double x, double poisson_ratio) {
  // (1 - nu) (x^2 + (2 - x)^2) + 2 nu x (x - 2) + 2 (1 - x)^2 = 4 x^2 - 8 x + 4 (1 - nu) + 2, its
  // integral under e^(-2x) being 1 + 2 (1 - nu).
  const double c = 4.0 * (1.0 - poisson_ratio) + 2.0;
  const double tail = std::exp(-2.0 * x) * (2.0 * x * x - 2.0 * x - 1.0 + 0.5 * c);
  return 1.0 - tail / (0.5 * c - 1.0);
}

/// The surface has numbers for sigma of these shares of the usual one: 2, 1, 1/2, ...
double share_of_scale(std::size_t scale) {
  return std::ldexp(2.0, -static_cast<int>(scale));
}

bool is_nothing(const RadialKernels& kernels) {
  return kernels.monopole == 0.0 && kernels.dipole == 0.0 && kernels.quadrupole == 0.0;
}

/// The roots of one's softness, times a response between the two, times those of the other's.
Mat3 between_roots(const NearModulus& one, const NearModulus& other, std::size_t band,
                   const Vec3& normal, const Mat3& response) {
  const double a = one.pulled_root[band], b = one.pressed_root[band] - a;
  const double c = other.pulled_root[band], d = other.pressed_root[band] - c;
  const Vec3 along = response * normal;               // response n
  const Vec3 across = response.transpose() * normal;  // n^T response
  return a * c * response + a * d * along * normal.transpose() +
         b * normal * (c * across + d * normal.dot(along) * normal).transpose();
}

/// Bands of a disc: at least one.
std::size_t bands_of(double sigma, double area) {
  const double least = kNarrowest * std::sqrt(area / std::numbers::pi);
  std::size_t bands = 1;
  while (bands < NearModulus::kBands && std::ldexp(sigma, -static_cast<int>(bands)) >= least)
    ++bands;
  return bands;
}

/// Whether a band meets the same tissue as the next wider one.
bool same_as_wider(const NearModulus& modulus, std::size_t band) {
  const auto same = [&](const std::array<double, NearModulus::kBands>& of) {
    return std::abs(of[band] - of[band - 1]) < kSameModulus * of[band];
  };
  return same(modulus.pressed) && same(modulus.pulled);
}

}  // namespace

void note_modulus(TouchableSurface& surface, const IsotropicMaterial& material, double spread,
                  const std::function<double(const Vec3& x, double edge)>& relative_modulus) {
  constexpr std::size_t kScales = TouchableSurface::kModulusScales;
  surface.modulus.assign(2 * kScales * surface.size(), 1.0f);
  const double nu = material.poisson_ratio;
  for (std::size_t t = 0; t < surface.size(); ++t) {
    const double h = surface.spacings[t];
    std::array<double, kScales> pressed{}, pulled{};
    double top = 0.0, bottom = kFirstDepth * h;
    for (int d = 0; d < kDepths; ++d) {
      const double thickness = bottom - top;
      const Vec3 x = surface.positions[t] - (top + 0.5 * thickness) * surface.normals[t];
      const double logarithm = std::log(relative_modulus(x, thickness));
      for (std::size_t s = 0; s < kScales; ++s) {
        const double q = kWaveNumber / (share_of_scale(s) * spread * h);
        const bool last = d + 1 == kDepths;
        pressed[s] +=
            logarithm * ((last ? 1.0 : pressed_above(q * bottom, nu)) - pressed_above(q * top, nu));
        pulled[s] +=
            logarithm * ((last ? 1.0 : pulled_above(q * bottom, nu)) - pulled_above(q * top, nu));
      }
      top = bottom;
      bottom *= kGrowth;
    }
    for (std::size_t s = 0; s < kScales; ++s) {
      surface.modulus[2 * (kScales * t + s)] = static_cast<float>(std::exp(pressed[s]));
      surface.modulus[2 * (kScales * t + s) + 1] = static_cast<float>(std::exp(pulled[s]));
    }
  }
}

NearModulus near_modulus_at(const TouchableSurface& surface, const Vec3& position,
                            const Vec3& normal, double spread, double sigma) {
  constexpr std::size_t kScales = TouchableSurface::kModulusScales;
  const auto table = modulus_about(surface, position, normal);
  const double usual = spread * spacing_at(surface, position);
  NearModulus modulus;
  for (std::size_t band = 0; band < NearModulus::kBands; ++band) {
    // Place of its scale in the table, in halvings from the widest.
    const double place = std::clamp(std::log2(2.0 * usual / sigma) + static_cast<double>(band), 0.0,
                                    static_cast<double>(kScales - 1));
    const auto low = std::min(static_cast<std::size_t>(place), kScales - 2);
    const double rest = place - static_cast<double>(low);
    const auto at = [&](std::size_t component) {
      return (1.0 - rest) * table[2 * low + component] + rest * table[2 * low + 2 + component];
    };
    modulus.pressed[band] = at(0);
    modulus.pulled[band] = at(1);
    modulus.pressed_root[band] = 1.0 / std::sqrt(modulus.pressed[band]);
    modulus.pulled_root[band] = 1.0 / std::sqrt(modulus.pulled[band]);
  }
  return modulus;
}

Mat3 near_response(const IsotropicMaterial& material, double sigma, const Vec3& offset,
                   const Vec3& normal, double area, const NearModulus& one,
                   const NearModulus& other) {
  const double r = offset.norm();
  const HalfSpace half_space(material);
  std::size_t bands = bands_of(sigma, area);
  while (bands > 1 && same_as_wider(one, bands - 1) && same_as_wider(other, bands - 1)) --bands;
  Mat3 sum = Mat3::Zero();
  RadialKernels wide = NearField(material, sigma).cell_kernels(r, area);
  for (std::size_t band = 0; band < bands; ++band) {
    // Narrower ones end nearer: beyond, this is the last.
    RadialKernels narrow;
    if (band + 1 < bands) {
      sigma *= 0.5;
      narrow = NearField(material, sigma).cell_kernels(r, area);
    }
    const RadialKernels kernels = wide - narrow;
    if (!is_nothing(kernels))
      sum += between_roots(one, other, band, normal, half_space.response(kernels, offset, normal));
    if (is_nothing(narrow)) break;
    wide = narrow;
  }
  return sum;
}

double effective_modulus(const IsotropicMaterial& material, double sigma, double radius,
                         const NearModulus& modulus) {
  const Vec3 normal = Vec3::UnitZ();
  const double area = std::numbers::pi * radius * radius;
  return NearField(material, sigma).cell_response(Vec3::Zero(), normal, area)(2, 2) /
         near_response(material, sigma, Vec3::Zero(), normal, area, modulus, modulus)(2, 2);
}

}  // namespace viscera
