#include "engine/verification/smooth_solution.h"

#include <cmath>

#include "engine/verification/bodies.h"

namespace viscera {
namespace {

const std::array<Vec3, 4> kWave = {{{1.5, 2, .7}, {-2, 1, 1.8}, {.8, -1.2, 2.2}, {1.9, 1.3, -1.1}}};
constexpr std::array<double, 4> kPhase = {.3, 1.1, -.7, .5};
const std::array<Vec3, 4> kAcross = {{{1, .3, -.5}, {.2, 1, .4}, {-.6, .5, 1}, {.7, -.4, .3}}};
constexpr std::array<double, 4> kAlong = {.3, .3, .3, 1.0};

double phase(std::size_t i, const Vec3& x) {
  return kWave[i].dot(x + Vec3::Constant(0.5)) + kPhase[i];
}

}  // namespace

SmoothSolution::SmoothSolution(const IsotropicMaterial& material) : material_(material) {
  for (std::size_t i = 0; i < 4; ++i) {
    const Vec3 e = kWave[i].normalized();
    amplitude_[i] =
        kAcross[i] - kAcross[i].dot(e) * e + kAlong[i] * (1.0 - 2.0 * material.poisson_ratio) * e;
  }
}

Vec3 SmoothSolution::displacement(const Vec3& x) const {
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < 4; ++i) sum += std::sin(phase(i, x)) * amplitude_[i];
  return sum;
}

Mat3 SmoothSolution::gradient(const Vec3& x) const {
  Mat3 sum = Mat3::Zero();
  for (std::size_t i = 0; i < 4; ++i) {
    sum += std::cos(phase(i, x)) * amplitude_[i] * kWave[i].transpose();
  }
  return sum;
}

Mat3 SmoothSolution::stress(const Vec3& x) const {
  const Mat3 g = gradient(x);
  return material_.lame_lambda() * g.trace() * Mat3::Identity() +
         material_.shear_modulus() * (g + g.transpose());
}

Vec3 SmoothSolution::body_force(const Vec3& x) const {
  const double lambda = material_.lame_lambda(), mu = material_.shear_modulus();
  Vec3 force = Vec3::Zero();
  for (std::size_t i = 0; i < 4; ++i) {
    const Vec3& a = amplitude_[i];
    force += std::sin(phase(i, x)) *
             ((lambda + mu) * kWave[i].dot(a) * kWave[i] + mu * kWave[i].squaredNorm() * a);
  }
  return force;
}

StaticLoads SmoothSolution::loads() const {
  const SmoothSolution self = *this;
  return {.body_force = [self](const Vec3& x) { return self.body_force(x); },
          .traction = [self](const Vec3& x, const Vec3& n) { return Vec3(self.stress(x) * n); },
          .held_displacement = [self](const Vec3& x) { return self.displacement(x); }};
}

double smooth_solution_error(const SmoothSolution& exact, const Formulation& formulation,
                             const PointCloud& cloud, const std::vector<double>& unknowns) {
  return nodal_error([&](const Vec3& x) { return exact.displacement(x); }, formulation, cloud,
                     unknowns);
}

}  // namespace viscera
