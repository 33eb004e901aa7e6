// Small tips on tissue whose modulus changes under them, against the same body on far finer nodes.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/organ/part_shapes.h"
#include "kernels/hive/hive.h"
#include "tests/kernels/contact/bodies.h"
#include "tests/support/shapes.h"

namespace viscera {
namespace {

using Modulus = std::function<double(const Vec3&, double)>;

constexpr double kTop = 8e-3;
const Vec3 kEdges(28e-3, 28e-3, 2.0 * kTop);
const IsotropicMaterial kSoft{10e3, 0.45};

/// So many times as stiff within a distance that is negative there.
Modulus stiffer(SignedDistance where, double ratio) {
  return [share = share_inside(std::move(where)), ratio](const Vec3& x, double edge) {
    return 1.0 + share(x, edge) * (ratio - 1.0);
  };
}

Modulus layer(double thickness, double ratio) {
  return stiffer([=](const Vec3& x) { return kTop - thickness - x.z(); }, ratio);
}

Modulus lesion(double radius, double depth, double ratio) {
  return stiffer([=](const Vec3& x) { return (x - Vec3(0, 0, kTop - depth)).norm() - radius; },
                 ratio);
}

test::PressedBody block_of(const Modulus& modulus, double finest, double coarsest) {
  const double hair = 1e-9;
  return test::prepare_body(
      test::box(kEdges, 16), kSoft,
      [=](const Vec3& x) {
        const double from = std::max(0.0, (x - Vec3(0, 0, kTop)).norm() - 3e-3);
        return std::min(coarsest, finest + 0.25 * from);
      },
      [=](const Vec3& x) { return x.z() < -kTop + hair; },
      [=](const Vec3& x) {
        return x.z() > kTop - hair && std::abs(x.x()) < 7e-3 && std::abs(x.y()) < 7e-3;
      },
      false, modulus);
}

const std::vector<Vec2>& places() {
  static const std::vector<Vec2> all = {
      {0, 0}, {0.9e-3, 0.4e-3}, {-0.7e-3, 1.3e-3}, {1.6e-3, -1.1e-3}};
  return all;
}

/// Of a ball of this radius pressed by a third of it.
std::vector<ContactCell> ball_cells(const Vec2& at, double radius) {
  return test::plane_cells(Vec3(at.x(), at.y(), kTop), radius / 3.5, 3, radius, radius / 3);
}

/// At each place [N].
std::vector<double> forces_of(const test::PressedBody& body, double radius, bool with_modulus) {
  TouchableSurface touch = body.touch;
  if (!with_modulus) touch.modulus.clear();
  PatchContact contact(body.compliance, touch, body.material);
  std::vector<double> forces;
  for (const Vec2& at : places()) {
    ContactSolution solution;
    ContactResponse response;
    contact.solve(ball_cells(at, radius), solution, response);
    EXPECT_TRUE(solution.converged);
    forces.push_back(-test::total_force(solution).z());
  }
  return forces;
}

/// A ball as wide as the nodes are apart, and a much smaller one.
struct Bounds {
  double small, wide;
};

/// Greatest errors over spacings of 2 and 3 mm; `missed`: at least what leaving the near field's
/// modulus out errs by somewhere.
void expect_forces(const Modulus& modulus, const Bounds& bounds, double missed) {
  const test::PressedBody fine = block_of(modulus, 0.45e-3, 3.5e-3);
  double worst_without = 0.0;
  for (const double h : {2e-3, 3e-3}) {
    const test::PressedBody coarse = block_of(modulus, h, 3.5e-3);
    for (const auto& [radius, bound] :
         {std::pair{1e-3, bounds.small}, std::pair{2.5e-3, bounds.wide}}) {
      const std::vector<double> exact = forces_of(fine, radius, true);
      const std::vector<double> with = forces_of(coarse, radius, true);
      const std::vector<double> without = forces_of(coarse, radius, false);
      for (std::size_t i = 0; i < exact.size(); ++i) {
        EXPECT_NEAR(with[i] / exact[i], 1.0, bound)
            << "ball of " << 1e3 * radius << " mm, nodes " << 1e3 * h << " mm apart, place " << i;
        worst_without = std::max(worst_without, std::abs(without[i] / exact[i] - 1.0));
      }
    }
  }
  EXPECT_GE(worst_without, missed);
}

// The reference is the same body with nodes .45 mm apart. The layers are thinner than the nodes of
// the other two are apart.
TEST(LayeredContact, AStiffSkinThinnerThanTheNodesAreApartIsFelt) {
  expect_forces(layer(1e-3, 5.0), {0.07, 0.13}, 0.5);
}

TEST(LayeredContact, ASoftLayerOverStifferTissueIsFelt) {
  expect_forces(layer(1e-3, 0.2), {0.08, 0.06}, 2.0);
}

TEST(LayeredContact, AHardLumpUnderTheSurfaceIsFelt) {
  expect_forces(lesion(3e-3, 4.5e-3, 10.0), {0.07, 0.09}, 0.25);
}

TEST(LayeredContact, OneModulusIsWhatItWas) {
  const test::PressedBody body = block_of(layer(1e-3, 1.0), 2e-3, 3.5e-3);
  const std::vector<double> with = forces_of(body, 1e-3, true),
                            without = forces_of(body, 1e-3, false);
  for (std::size_t i = 0; i < with.size(); ++i) EXPECT_NEAR(with[i], without[i], 1e-6 * without[i]);
}

/// Of what presses at the first place [N].
double hand_force(const test::PressedBody& body, const WalkableSurface& surface, double radius) {
  HiveSettings settings;
  settings.material = body.material;
  settings.periphery = HivePeriphery::kCoupled;
  settings.radius = std::max(4.0 * radius, 6e-3);
  settings.nodes = 120;
  auto hive = Hive::create({&surface, &body.compliance, &body.touch}, settings, 37);
  if (!hive) return -1.0;
  EXPECT_EQ(hive->build(surface.nearest(Vec3(0, 0, kTop))), HiveVerdict::kSound);
  const auto cells = ball_cells(places()[0], radius);
  EXPECT_EQ(hive->seat(cells), HiveVerdict::kSound);
  std::vector<double> depths;
  for (const ContactCell& cell : cells) depths.push_back(cell.depth);
  return hive->press(depths).force.z();
}

TEST(LayeredContact, AHandFeelsWhatTheFrameFinds) {
  for (const Modulus& modulus : {layer(1e-3, 5.0), layer(1e-3, 0.2), lesion(3e-3, 4.5e-3, 10.0)}) {
    const test::PressedBody body = block_of(modulus, 2e-3, 3.5e-3);
    const auto surface = WalkableSurface::make(body.surface);
    ASSERT_TRUE(surface);
    for (const double radius : {1e-3, 2.5e-3}) {
      const double frame = forces_of(body, radius, true).front();
      const double hand = hand_force(body, *surface, radius);
      EXPECT_NEAR(hand, frame, 0.05 * frame) << radius;
    }
  }
}

}  // namespace
}  // namespace viscera
