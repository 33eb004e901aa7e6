#include "engine/simulation/key_frames.h"

#include <gtest/gtest.h>

namespace viscera {
namespace {

TEST(KeyFrames, PassThroughTheirKeysAndStayBetweenThem) {
  const KeyFrames path({0.0, 1.0, 2.0, 4.0},
                       {Vec3(0, 0, 0), Vec3(1, 5, 0), Vec3(1, 2, 0), Vec3(3, 2, 0)});
  EXPECT_EQ(path.at(1.0), Vec3(1, 5, 0));
  EXPECT_EQ(path.at(2.0), Vec3(1, 2, 0));
  for (double t = 0.0; t <= 4.0; t += 0.01) {
    EXPECT_LE(path.at(t).y(), 5.0 + 1e-12);
    EXPECT_GE(path.at(t).y(), -1e-12);
  }
}

TEST(KeyFrames, HoldTheFirstAndTheLastValue) {
  const KeyFrames path({1.0, 2.0}, {Vec3(1, 0, 0), Vec3(2, 0, 0)});
  EXPECT_EQ(path.at(-3.0), Vec3(1, 0, 0));
  EXPECT_EQ(path.at(9.0), Vec3(2, 0, 0));
}

TEST(KeyFrames, FindTheKeyThatHolds) {
  const KeyFrames path({0.0, 1.0, 2.0}, {Vec3::Zero(), Vec3::Zero(), Vec3::Zero()});
  EXPECT_EQ(path.key_at(-1.0), 0u);
  EXPECT_EQ(path.key_at(1.0), 1u);
  EXPECT_EQ(path.key_at(1.99), 1u);
  EXPECT_EQ(path.key_at(7.0), 2u);
}

TEST(KeyFrames, OneKeyIsAConstant) {
  const KeyFrames path({0.0}, {Vec3(4, 5, 6)});
  EXPECT_EQ(path.at(0.5), Vec3(4, 5, 6));
}

}  // namespace
}  // namespace viscera
