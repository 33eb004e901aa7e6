#include "kernels/hive/hyperelastic.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

namespace viscera {
namespace {

const IsotropicMaterial kTissue{5e3, 0.45};
constexpr HyperelasticModel kModels[] = {HyperelasticModel::kLinear, HyperelasticModel::kStvk,
                                         HyperelasticModel::kNeoHookean};

Mat3 some_gradient() {
  Mat3 f;
  f << 1.15, 0.21, -0.08, 0.05, 0.83, 0.12, -0.17, 0.09, 1.05;
  return f;
}

Mat3 stretches(double a, double b, double c) {
  return Vec3(a, b, c).asDiagonal();
}

TEST(Hyperelastic, StressIsTheSlopeOfTheEnergyAndTangentThatOfTheStress) {
  const double step = 1e-6;
  Mat3 inside_out = some_gradient();
  inside_out.col(0) *= -0.6;
  Mat3 nearly_flat = some_gradient();
  nearly_flat.col(1) *= 0.08;
  for (const HyperelasticModel model : kModels) {
    const HyperelasticLaw law(model, kTissue);
    for (const Mat3& f : {some_gradient(), nearly_flat, inside_out}) {
      const Mat3 stress = law.stress(f);
      const HyperelasticTangent tangent = law.tangent(f);
      EXPECT_LT((tangent - tangent.transpose()).norm(), 1e-12 * tangent.norm());
      for (int l = 0; l < 3; ++l)
        for (int k = 0; k < 3; ++k) {
          Mat3 more = f, less = f;
          more(k, l) += step;
          less(k, l) -= step;
          const double slope = (law.energy(more) - law.energy(less)) / (2.0 * step);
          EXPECT_NEAR(stress(k, l), slope, 1e-6 * stress.norm()) << name_of(model);
          const Mat3 change = (law.stress(more) - law.stress(less)) / (2.0 * step);
          const Mat3 said = tangent.col(3 * l + k).reshaped(3, 3);
          EXPECT_LT((said - change).norm(), 1e-6 * tangent.norm()) << name_of(model);
        }
    }
  }
}

TEST(Hyperelastic, SmallStrainsAreTheLinearLaws) {
  const HyperelasticLaw linear(HyperelasticModel::kLinear, kTissue);
  const Mat3 f = Mat3::Identity() + 1e-5 * (some_gradient() - Mat3::Identity());
  const Mat3 strain = 0.5 * (f + f.transpose()) - Mat3::Identity();
  const Mat3 hooke = 2.0 * kTissue.shear_modulus() * strain +
                     kTissue.lame_lambda() * strain.trace() * Mat3::Identity();
  EXPECT_LT((linear.stress(f) - hooke).norm(), 1e-12 * hooke.norm());
  for (const HyperelasticModel model : kModels) {
    const HyperelasticLaw law(model, kTissue);
    EXPECT_LT((law.stress(f) - hooke).norm(), 1e-4 * hooke.norm()) << name_of(model);
    EXPECT_LT((law.tangent(Mat3::Identity()) - linear.tangent(Mat3::Identity())).norm(),
              1e-12 * linear.tangent(Mat3::Identity()).norm());
    EXPECT_DOUBLE_EQ(law.energy(Mat3::Identity()), 0.0);
  }
}

TEST(Hyperelastic, TurningTheFrameTurnsTheStressAndStoresNothing) {
  const Mat3 turn = Eigen::AngleAxisd(1.1, Vec3(1, -2, 0.5).normalized()).toRotationMatrix();
  for (const HyperelasticModel model : {HyperelasticModel::kStvk, HyperelasticModel::kNeoHookean}) {
    const HyperelasticLaw law(model, kTissue);
    const Mat3 f = some_gradient();
    EXPECT_NEAR(law.energy(turn * f), law.energy(f), 1e-12 * law.energy(f));
    EXPECT_LT((law.stress(turn * f) - turn * law.stress(f)).norm(), 1e-12 * law.stress(f).norm());
    EXPECT_NEAR(law.energy(turn), 0.0, 1e-12 * law.mu);
    EXPECT_LT(law.stress(turn).norm(), 1e-12 * law.mu);
  }
}

// Nominal stress along a bar stretched by `stretch`, free aside: the sides are found by bisection.
double uniaxial(const HyperelasticLaw& law, double stretch) {
  double low = 0.3, high = 2.0;
  for (int i = 0; i < 100; ++i) {
    const double side = 0.5 * (low + high);
    (law.stress(stretches(stretch, side, side))(1, 1) > 0.0 ? high : low) = side;
  }
  return law.stress(stretches(stretch, low, low))(0, 0);
}

TEST(Hyperelastic, UniaxialStretchIsTheClosedForm) {
  for (const double stretch : {0.75, 0.9, 1.1, 1.4}) {
    // St Venant-Kirchhoff: S = E E_11, P = stretch S.
    const double strain = 0.5 * (stretch * stretch - 1.0);
    EXPECT_NEAR(uniaxial(HyperelasticLaw(HyperelasticModel::kStvk, kTissue), stretch),
                kTissue.youngs_modulus * stretch * strain, 1e-9 * kTissue.youngs_modulus);
    // Neo-Hookean that keeps its volume: P = mu (stretch - stretch^-2).
    const IsotropicMaterial stiff_volume{5e3, 0.49999};
    const double mu = stiff_volume.shear_modulus();
    EXPECT_NEAR(uniaxial(HyperelasticLaw(HyperelasticModel::kNeoHookean, stiff_volume), stretch),
                mu * (stretch - 1.0 / (stretch * stretch)), 1e-4 * mu);
  }
}

TEST(Hyperelastic, SimpleShearIsTheClosedForm) {
  const double shear = 0.6;
  Mat3 f = Mat3::Identity();
  f(0, 1) = shear;
  const double mu = kTissue.shear_modulus(), lambda = kTissue.lame_lambda();
  // Neo-Hookean: Cauchy stress mu (F F^T - 1), the volume stays.
  const Mat3 cauchy =
      HyperelasticLaw(HyperelasticModel::kNeoHookean, kTissue).stress(f) * f.transpose();
  EXPECT_NEAR(cauchy(0, 1), mu * shear, 1e-12 * mu);
  EXPECT_NEAR(cauchy(0, 0), mu * shear * shear, 1e-12 * mu);
  EXPECT_NEAR(cauchy(1, 1), 0.0, 1e-12 * mu);
  // St Venant-Kirchhoff: E_12 = shear / 2, E_22 = shear^2 / 2.
  const Mat3 piola = HyperelasticLaw(HyperelasticModel::kStvk, kTissue).stress(f);
  const double s12 = mu * shear, s22 = (lambda + 2.0 * mu) * 0.5 * shear * shear;
  EXPECT_NEAR(piola(0, 1), s12 + shear * s22, 1e-12 * mu);
  EXPECT_NEAR(piola(1, 1), s22, 1e-12 * mu);
}

TEST(Hyperelastic, EquibiaxialStretchOfTissueThatKeepsItsVolumeIsTheClosedForm) {
  const IsotropicMaterial stiff_volume{5e3, 0.49999};
  const HyperelasticLaw law(HyperelasticModel::kNeoHookean, stiff_volume);
  for (const double a : {0.8, 1.2, 1.5}) {
    double low = 0.1, high = 3.0;
    for (int i = 0; i < 100; ++i) {
      const double c = 0.5 * (low + high);
      (law.stress(stretches(a, a, c))(2, 2) > 0.0 ? high : low) = c;
    }
    EXPECT_NEAR(law.stress(stretches(a, a, low))(0, 0), law.mu * (a - std::pow(a, -5.0)),
                1e-3 * law.mu);
  }
}

TEST(Hyperelastic, NeoHookeanTissueTurnedInsideOutIsPushedBack) {
  const HyperelasticLaw law(HyperelasticModel::kNeoHookean, kTissue);
  double last = 0.0;
  for (double z = 1.0; z > -1.5; z -= 0.01) {
    const double energy = law.energy(stretches(1.0, 1.0, z));
    EXPECT_TRUE(std::isfinite(energy));
    EXPECT_GE(energy, last) << z;
    last = energy;
  }
}

TEST(Hyperelastic, StVenantKirchhoffSoftensWhenPressedAndNeoHookeanStiffens) {
  const HyperelasticLaw stvk(HyperelasticModel::kStvk, kTissue),
      neo(HyperelasticModel::kNeoHookean, kTissue);
  const double linear = kTissue.youngs_modulus * -0.3;
  EXPECT_GT(uniaxial(stvk, 0.7), linear);
  EXPECT_LT(uniaxial(neo, 0.7), linear);
}

}  // namespace
}  // namespace viscera
