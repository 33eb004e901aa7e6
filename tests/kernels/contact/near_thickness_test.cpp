#include "kernels/contact/near_thickness.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "kernels/contact/patch_contact.h"
#include "tests/kernels/contact/bodies.h"

namespace viscera {
namespace {

using test::prepare_block;
using test::PressedBody;

constexpr IsotropicMaterial kSoftLayer{10e3, 0.45};
constexpr double kNodesApart = 4e-3;
constexpr std::size_t kModulusScales = TouchableSurface::kModulusScales;

/// A plate pressed on its upper side, `spacings` of nodes thick, on a base.
PressedBody layer_of(double spacings) {
  return prepare_block(Vec3(0.04, 0.04, spacings * kNodesApart), kNodesApart, 0.012, kSoftLayer);
}

void note(TouchableSurface& touch, const PressedBody& body,
          const std::function<bool(const Vec3&)>& is_fixed) {
  note_thickness(touch, kSoftLayer, PatchContact::spread_factor(), body.surface,
                 SurfaceTree(body.surface), is_fixed);
}

TEST(LayerSoftness, IsAHalfSpacesWhereTheLayerIsThick) {
  for (const double nu : {0.0, 0.3, 0.45, 0.49}) {
    EXPECT_NEAR(layer_softness_pressed(8.0, nu), 1.0, 2e-4);
    EXPECT_NEAR(layer_softness_pulled(8.0, nu), 1.0, 2e-4);
    EXPECT_EQ(layer_softness_pressed(1e4, nu), 1.0);
    EXPECT_EQ(layer_softness_pulled(1e4, nu), 1.0);
  }
}

// A thin layer is squeezed without room to the sides, p = M u / t, and sheared, s = G u / t.
TEST(LayerSoftness, IsThatOfConfinedTissueWhereTheLayerIsThin) {
  for (const double nu : {0.0, 0.3, 0.45}) {
    const IsotropicMaterial one{1.0, nu};
    const double x = 1e-3, half_space = 2.0 / (one.contact_modulus() * x);  // of t = 1
    const double confined = one.lame_lambda() + 2.0 * one.shear_modulus();
    EXPECT_NEAR(layer_softness_pressed(x, nu) * half_space * confined, 1.0, 1e-3) << nu;
    // Along the wave (1 - nu) / G of the half-space's (2 - nu), across it 1 / G.
    const double pulled = (2.0 - nu) / (2.0 * (1.0 - nu)) * half_space;
    EXPECT_NEAR(layer_softness_pulled(x, nu) * pulled * one.shear_modulus(), 1.0, 1e-3) << nu;
  }
}

/// A layer of thickness 1 on a rigid base under cos(q x) of pressure or sin(q x) of shear at its
/// top, per unit of it: how far that moves along it. By the equations of plane strain, integrated
/// upwards from what the base may bear; u_x, u_z and the stresses xz and zz at each height.
double moved_by_equations(double q, const IsotropicMaterial& material, bool pressed) {
  const double g = material.shear_modulus(), l = material.lame_lambda(), p = l + 2.0 * g;
  Eigen::Matrix4d rates;
  rates << 0, q, 1 / g, 0,                       //
      -l * q / p, 0, 0, 1 / p,                   //
      q * q * (p - l * l / p), 0, 0, l * q / p,  //
      0, 0, -q, 0;
  Eigen::Matrix<double, 4, 2> state;
  state << 0, 0, 0, 0, 1, 0, 0, 1;
  constexpr int kSteps = 4000;
  for (int i = 0; i < kSteps; ++i) {
    const Eigen::Matrix<double, 4, 2> k1 = rates * state, k2 = rates * (state + k1 / (2 * kSteps)),
                                      k3 = rates * (state + k2 / (2 * kSteps)),
                                      k4 = rates * (state + k3 / kSteps);
    state += (k1 + 2 * k2 + 2 * k3 + k4) / (6 * kSteps);
  }
  const Eigen::Vector2d load = pressed ? Eigen::Vector2d(0, 1) : Eigen::Vector2d(1, 0);
  const Eigen::Vector2d base = state.bottomRows<2>().fullPivLu().solve(load);
  return state.row(pressed ? 1 : 0).dot(base);
}

TEST(LayerSoftness, IsThatOfTheLayersOwnEquations) {
  for (const double nu : {0.0, 0.3, 0.45, 0.49})
    for (const double x : {0.05, 0.3, 1.0, 2.0, 4.0}) {
      const IsotropicMaterial one{1.0, nu};
      const double half_space = 2.0 / (one.contact_modulus() * x);
      EXPECT_NEAR(layer_softness_pressed(x, nu), moved_by_equations(x, one, true) / half_space,
                  1e-6)
          << x << ' ' << nu;
      // Across the wave only shear: tanh(q t) / (G q).
      const double along = moved_by_equations(x, one, false) / half_space;
      EXPECT_NEAR(layer_softness_pulled(x, nu), ((1.0 - nu) * along + std::tanh(x)) / (2.0 - nu),
                  1e-6)
          << x << ' ' << nu;
    }
}

TEST(LayerModulus, GrowsAsTheLayerGetsThinner) {
  double pressed = 1.0, pulled = 1.0;
  for (const double thickness : {16.0, 8.0, 4.0, 2.0, 1.0, 0.5}) {
    const LayerModulus layer = layer_modulus(thickness, 0.45);
    EXPECT_GE(layer.pressed, pressed) << thickness;
    EXPECT_GE(layer.pulled, pulled) << thickness;
    EXPECT_GE(layer.pressed, layer.pulled) << "what can't leave is harder to squeeze than to shear";
    pressed = layer.pressed;
    pulled = layer.pulled;
  }
  EXPECT_LT(layer_modulus(16.0, 0.45).pressed, 1.01);
  EXPECT_GT(pressed, 4.0);
}

TEST(Thickness, IsNotedOverWhatHoldsTheBody) {
  const PressedBody body = layer_of(2.0);
  ASSERT_TRUE(body.ready);
  TouchableSurface touch = body.touch;
  const double bottom = -kNodesApart;
  note(touch, body, [&](const Vec3& x) { return x.z() < bottom + 1e-9; });
  ASSERT_EQ(touch.modulus.size(), 2 * kModulusScales * touch.size());
  for (std::size_t t = 0; t < touch.size(); ++t)
    for (std::size_t s = 0; s < kModulusScales; ++s) {
      const double sigma =
          std::ldexp(2.0, -static_cast<int>(s)) * PatchContact::spread_factor() * touch.spacings[t];
      const LayerModulus layer = layer_modulus(2.0 * kNodesApart / sigma, kSoftLayer.poisson_ratio);
      EXPECT_NEAR(touch.modulus[2 * (kModulusScales * t + s)], layer.pressed, 5e-3 * layer.pressed);
      EXPECT_NEAR(touch.modulus[2 * (kModulusScales * t + s) + 1], layer.pulled,
                  5e-3 * layer.pulled);
    }
  // Of tissue that has parts it is one more factor.
  TouchableSurface twice = touch;
  note(twice, body, [&](const Vec3& x) { return x.z() < bottom + 1e-9; });
  EXPECT_NEAR(twice.modulus[2], touch.modulus[2] * touch.modulus[2], 1e-4);
}

TEST(Thickness, IsNotNotedOverAFreeSideNorWhereHoldIsElsewhereOrDeep) {
  const PressedBody body = layer_of(2.0);
  ASSERT_TRUE(body.ready);
  TouchableSurface touch = body.touch;
  note(touch, body, [](const Vec3&) { return false; });
  EXPECT_TRUE(touch.modulus.empty());
  note(touch, body, [](const Vec3& x) { return x.x() > 0.0199; });
  EXPECT_TRUE(touch.modulus.empty());
  const PressedBody deep = layer_of(12.0);
  ASSERT_TRUE(deep.ready);
  touch = deep.touch;
  note(touch, deep, [](const Vec3& x) { return x.z() < -6.0 * kNodesApart + 1e-9; });
  EXPECT_TRUE(touch.modulus.empty());
}

}  // namespace
}  // namespace viscera
