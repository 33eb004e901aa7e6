// Spring and damper between device and tool, by figures worked out by hand.
#include "haptics/virtual_coupling.h"

#include <gtest/gtest.h>

namespace viscera {
namespace {

/// Along x alone.
TactileForce tissue(double force, double stiffness) {
  TactileForce felt;
  felt.force.x() = force;
  felt.stiffness(0, 0) = stiffness;
  return felt;
}

// K = 1000 N/m, B / dt = 2 N s/m / 1 ms = 2000 N/m, tissue of 3000 N/m: they share a stretch by
// 1000 + 2000 + 3000.
TEST(VirtualCoupling, SpringDamperAndTissueAreInBalanceWhereTheToolComesTo) {
  VirtualCoupling coupling({1000.0, 2.0});
  coupling.reset(Vec3::Zero());
  const double dt = 1e-3;
  Vec3 device(3e-3, 0.0, 0.0);
  Vec3 asked = coupling.predict(device, dt);
  EXPECT_NEAR(asked.x(), 3e-3, 1e-15) << "nothing has been touched";
  Vec3 hand = coupling.settle(device, asked, tissue(-6.0, 3000.0), dt);
  // 6000 e = 6 N.
  EXPECT_NEAR(coupling.tool().x(), 2e-3, 1e-15);
  EXPECT_NEAR(hand.x(), -(1.0 + 2.0), 1e-12);
  EXPECT_NEAR(coupling.energy(), 0.5e-3, 1e-15);

  device.x() = 4e-3;
  asked = coupling.predict(device, dt);
  // 6000 e = 3000 (4 - 3) mm + 6 N + 2000 x 1 mm.
  EXPECT_NEAR(asked.x(), 4e-3 - 11e-3 / 6.0, 1e-15);
  // The tissue is as it said, so the tool stays where it was asked: -3.5 N.
  const double felt = -6.0 - 3000.0 * (asked.x() - 3e-3);
  hand = coupling.settle(device, asked, tissue(felt, 3000.0), dt);
  EXPECT_NEAR(coupling.tool().x(), asked.x(), 1e-15);
  EXPECT_NEAR(hand.x(), felt, 1e-12);
  EXPECT_NEAR(hand.x(), -(1000.0 * 11e-3 / 6.0 + 2000.0 * 5e-3 / 6.0), 1e-12);
}

}  // namespace
}  // namespace viscera
