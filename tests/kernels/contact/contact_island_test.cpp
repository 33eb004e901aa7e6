// Bodies that touch each other.
#include "kernels/contact/contact_island.h"

#include <gtest/gtest.h>

#include "engine/verification/two_balls.h"
#include "kernels/base/progress.h"
#include "tests/kernels/contact/bodies.h"

namespace viscera {
namespace {

TwoBalls& balls() {
  static const std::unique_ptr<TwoBalls> made = [] {
    auto prepared = TwoBalls::prepare({}, no_progress());
    EXPECT_TRUE(prepared) << (prepared ? "" : prepared.error().text());
    return std::move(*prepared);
  }();
  return *made;
}

TEST(ContactIsland, TwoBallsPressEachOtherAsHertzFound) {
  const auto give = give_of_base(balls().material(), kHemisphereRadius);
  ASSERT_TRUE(give);
  for (const double approach : {0.5e-3, 1e-3, 2e-3}) {
    const TwoBallsAnswer answer = balls().press(approach);
    const HertzAnswer exact = hertz_held(balls().material(), kHemisphereRadius, approach, *give);
    ASSERT_TRUE(answer.island.converged);
    EXPECT_NEAR(answer.force, exact.force, 0.04 * exact.force) << approach;
    EXPECT_NEAR(answer.radius, exact.radius, 0.10 * exact.radius) << approach;
    EXPECT_LT(answer.unbalanced, 1e-12);
    EXPECT_LT(answer.greatest_overlap, 1e-5 * approach);
  }
}

}  // namespace
}  // namespace viscera
