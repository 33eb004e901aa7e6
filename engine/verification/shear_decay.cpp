#include "engine/verification/shear_decay.h"

#include <cmath>
#include <numbers>
#include <vector>

#include "kernels/base/random.h"
#include "kernels/smoke/viscosity.h"

namespace viscera {
namespace {

constexpr double kWavelength = 20e-3;  // [m]
constexpr double kViscosity = 1.4e-5;  // [m2/s]
constexpr double kSupportOfSpacing = 2.0;

/// Places in the cube, and the particles with their images; an image's id is its place in `origin`.
struct PeriodicCloud {
  std::vector<Vec3> places;
  SmokeParticles particles;
  std::vector<std::size_t> origin;
  std::vector<bool> image;
};

PeriodicCloud make_cloud(int across, double jitter, std::uint64_t seed, double support) {
  const double spacing = kWavelength / across;
  const Random random(seed, 1);
  std::uint64_t draw = 0;
  PeriodicCloud cloud;
  for (int i = 0; i < across * across * across; ++i) {
    Vec3 at = spacing * (Vec3(i % across, i / across % across, i / across / across).array() + 0.5);
    for (double& x : at) {
      x += jitter * spacing * (2.0 * random.uniform(draw++) - 1.0);
      x -= kWavelength * std::floor(x / kWavelength);
    }
    cloud.places.push_back(at);
    for (int n = 0; n < 27; ++n) {
      const Vec3 shifted = at + kWavelength * Vec3(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
      if (shifted.minCoeff() < -1.01 * support) continue;
      if (shifted.maxCoeff() > kWavelength + 1.01 * support) continue;
      cloud.particles.positions.push_back(Float4::from(shifted.cast<float>()));
      cloud.particles.velocities.emplace_back();
      cloud.particles.masses.push_back(1.0f);
      cloud.particles.ids.push_back(static_cast<std::uint32_t>(cloud.origin.size()));
      cloud.origin.push_back(cloud.places.size() - 1);
      cloud.image.push_back(n != 13);
    }
  }
  return cloud;
}

constexpr double kWaveNumber = 2.0 * std::numbers::pi / kWavelength;  // [1/m]

/// Of a field that shrinks at the rate nu `factor`, by projection onto the field.
template <class Field>
std::optional<double> decay_error(SmokePasses& passes, Laplacian laplacian, int across,
                                  double jitter, std::uint64_t seed, double factor,
                                  const Field& field_at) {
  const double support = kSupportOfSpacing * kWavelength / across;
  const double rate = kViscosity * factor;
  const PeriodicCloud cloud = make_cloud(across, jitter, seed, support);
  std::vector<Vec3> field;
  for (const Vec3& at : cloud.places) field.push_back(1e-2 * field_at((kWaveNumber * at).eval()));
  std::vector<Vec3> velocity = field;

  const double time = 0.1 / rate;
  const int steps = static_cast<int>(time / longest_viscous_step(support, kViscosity)) + 5;
  ViscosityParameters viscosity;
  viscosity.inverse_square = static_cast<float>(1.0 / (support * support));
  viscosity.viscosity = static_cast<float>(kViscosity);
  viscosity.fewest_neighbours = 4;
  viscosity.laplacian = laplacian;
  viscosity.step = static_cast<float>(time / steps);
  IntegrateParameters integration;
  integration.step = viscosity.step;
  integration.gas_temperature = 310.0f;
  integration.open_sides = kOpenAll;
  std::vector<SmokeFate> fates;
  for (int s = 0; s < steps; ++s) {
    SmokeParticles particles = cloud.particles;
    for (std::size_t i = 0; i < particles.size(); ++i) {
      particles.velocities[i] = Float4::from(velocity[cloud.origin[i]].cast<float>());
    }
    if (!passes.start(particles)) return std::nullopt;
    passes.exchange(static_cast<float>(support), viscosity);
    passes.integrate(integration, {}, nullptr);
    if (!passes.finish(particles, fates)) return std::nullopt;
    for (std::size_t i = 0; i < particles.size(); ++i) {
      const std::uint32_t id = particles.ids[i];
      if (!cloud.image[id]) velocity[cloud.origin[id]] = particles.velocity(i).cast<double>();
    }
  }
  double top = 0.0, bottom = 0.0;
  for (std::size_t i = 0; i < field.size(); ++i) {
    top += field[i].dot(velocity[i]);
    bottom += field[i].squaredNorm();
  }
  // An explicit step multiplies by 1 - rate dt.
  const double shrink = std::pow(top / bottom, 1.0 / steps);
  return (1.0 - shrink) * steps / time / rate - 1.0;
}

}  // namespace

std::optional<double> shear_decay_error(SmokePasses& passes, Laplacian laplacian, int across,
                                        double jitter, std::uint64_t seed) {
  return decay_error(passes, laplacian, across, jitter, seed, kWaveNumber * kWaveNumber,
                     [](const Vec3& x) { return Vec3(std::sin(x.z()), 0.0, 0.0); });
}

std::optional<double> vortex_decay_error(SmokePasses& passes, Laplacian laplacian, int across,
                                         double jitter, std::uint64_t seed) {
  return decay_error(
      passes, laplacian, across, jitter, seed, 2.0 * kWaveNumber * kWaveNumber, [](const Vec3& x) {
        return Vec3(std::sin(x.x()) * std::cos(x.y()), -std::cos(x.x()) * std::sin(x.y()), 0.0);
      });
}

}  // namespace viscera
