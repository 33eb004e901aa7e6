// A smooth solution on a cube with body force, tractions and a held face: the error and its order.
#include <gtest/gtest.h>

#include "tests/kernels/paff/elastic_bodies.h"

namespace viscera {
namespace {

/// u = sum_i a_i sin(k_i . x + p_i), four waves, each with a shear part and a part along k_i that
/// shrinks with 1 - 2 nu, so that the pressure stays bounded near incompressibility.
class FourWaves {
 public:
  explicit FourWaves(const IsotropicMaterial& material) : material_(material) {
    const Vec3 shear[4] = {{1, .3, -.5}, {.2, 1, .4}, {-.6, .5, 1}, {.7, -.4, .3}};
    const double along[4] = {.3, .3, .3, 1.0};
    for (int i = 0; i < 4; ++i) {
      const Vec3 e = kWave[i].normalized();
      amplitude_[i] =
          shear[i] - shear[i].dot(e) * e + along[i] * (1.0 - 2.0 * material.poisson_ratio) * e;
    }
  }

  /// The cube of the definition spans [0, 1]^3; the tests' cube is centred.
  static double phase(int i, const Vec3& x) {
    return kWave[i].dot(x + Vec3::Constant(0.5)) + kPhase[i];
  }

  Vec3 displacement(const Vec3& x) const {
    Vec3 sum = Vec3::Zero();
    for (int i = 0; i < 4; ++i) sum += std::sin(phase(i, x)) * amplitude_[i];
    return sum;
  }

  StaticLoads loads() const {
    const FourWaves self = *this;
    StaticLoads loads;
    loads.held_displacement = [self](const Vec3& x) { return self.displacement(x); };
    loads.traction = [self](const Vec3& x, const Vec3& n) {
      Mat3 gradient = Mat3::Zero();
      for (int i = 0; i < 4; ++i) {
        gradient += std::cos(phase(i, x)) * self.amplitude_[i] * kWave[i].transpose();
      }
      return Vec3(test::stress(self.material_, gradient) * n);
    };
    loads.body_force = [self](const Vec3& x) {
      const double lambda = self.material_.lame_lambda(), mu = self.material_.shear_modulus();
      Vec3 force = Vec3::Zero();
      for (int i = 0; i < 4; ++i) {
        const Vec3& a = self.amplitude_[i];
        force += std::sin(phase(i, x)) *
                 ((lambda + mu) * kWave[i].dot(a) * kWave[i] + mu * kWave[i].squaredNorm() * a);
      }
      return force;
    };
    return loads;
  }

 private:
  static inline const Vec3 kWave[4] = {
      {1.5, 2, .7}, {-2, 1, 1.8}, {.8, -1.2, 2.2}, {1.9, 1.3, -1.1}};
  static constexpr double kPhase[4] = {.3, 1.1, -.7, .5};

  IsotropicMaterial material_;
  Vec3 amplitude_[4];
};

/// Relative L2 error of the displacement over the nodes.
double error_of(int cells, double poisson_ratio, double support_factor) {
  const IsotropicMaterial material{1.0, poisson_ratio};
  const FourWaves exact(material);
  const test::Body body = test::jittered_cube(cells, 0.2);
  const auto system = GalerkinSystem::assemble(
      body.problem(material, [](const Vec3& x) { return x.z() < -0.5 + 1e-9; }), support_factor,
      no_progress());
  if (!system) return std::numeric_limits<double>::infinity();
  const auto unknowns = system->solve(exact.loads());
  if (!unknowns) return std::numeric_limits<double>::infinity();
  double error = 0.0, size = 0.0;
  for (const Vec3& x : body.cloud.positions) {
    error += (system->displacement(*unknowns, x) - exact.displacement(x)).squaredNorm();
    size += exact.displacement(x).squaredNorm();
  }
  return std::sqrt(error / size);
}

TEST(SmoothSolution, ConvergesAtSecondOrderWithNarrowSupport) {
  const double coarse = error_of(7, 0.3, 1.6), fine = error_of(10, 0.3, 1.6);
  RecordProperty("error_8_nodes", std::to_string(coarse));
  RecordProperty("error_11_nodes", std::to_string(fine));
  EXPECT_LT(coarse, 0.0080);
  EXPECT_LT(fine, 0.0034);
  EXPECT_GT(std::log(coarse / fine) / std::log(10.0 / 7.0), 1.8);
}

TEST(SmoothSolution, IsAccurateWithTheFormulationsOwnSupport) {
  EXPECT_LT(error_of(10, 0.30, galerkin_formulation().support_factor()), 0.0022);
}

TEST(SmoothSolution, StaysAccurateNearIncompressibility) {
  EXPECT_LT(error_of(10, 0.49, galerkin_formulation().support_factor()), 0.008);
}

}  // namespace
}  // namespace viscera
