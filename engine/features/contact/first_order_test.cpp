#include "engine/features/contact/first_order.h"

#include <gtest/gtest.h>

#include <numbers>

namespace viscera {
namespace {

std::vector<Vec3> disc() {
  std::vector<Vec3> places;
  for (int i = 0; i < 12; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / 12;
    places.push_back(Vec3(0.1, -0.05, 0.02) +
                     (1 + i % 2) * 1e-3 * Vec3(std::cos(angle), std::sin(angle), 0.0));
  }
  return places;
}

std::vector<Vec3> displacements(const std::vector<Vec3>& places, const Pose& motion) {
  std::vector<Vec3> moved;
  for (const Vec3& place : places) moved.push_back(motion.to_world(place) - place);
  return moved;
}

TEST(FirstOrder, FindsARigidMotionItself) {
  const std::vector<Vec3> places = disc();
  const Pose motion{Vec3(3e-3, -1e-3, 8e-3),
                    Quaternion(Eigen::AngleAxisd(0.6, Vec3(1, 2, -0.5).normalized()))};
  const Pose found = FirstOrder(places, Vec3::UnitZ()).motion(displacements(places, motion));
  EXPECT_LT((found.position - motion.position).norm(), 1e-12);
  EXPECT_LT(found.orientation.angularDistance(motion.orientation), 1e-9);
}

TEST(FirstOrder, KnowsNoSlopeOnALineAndTellsTheMeanMotion) {
  std::vector<Vec3> places;
  for (int i = 0; i < 5; ++i) places.emplace_back(1e-3 * i, 0, 0);
  const Pose motion{Vec3::Zero(), Quaternion(Eigen::AngleAxisd(0.3, Vec3::UnitZ()))};
  const Pose found = FirstOrder(places, Vec3::UnitZ()).motion(displacements(places, motion));
  EXPECT_LT(found.orientation.angularDistance(Quaternion::Identity()), 1e-12);
  EXPECT_LT((found.position - (motion.to_world(places[2]) - places[2])).norm(), 1e-12);
}

TEST(FirstOrder, AHoldTakesOffWhatItWasMadeFrom) {
  const std::vector<Vec3> places = disc();
  const FirstOrder about(places, Vec3::UnitZ());
  MatrixX modes(9, 2);  // fewer than nine: the hold is singular
  for (int i = 0; i < 9; ++i) modes.row(i) << std::sin(1.0 + i), std::cos(3.0 * i);
  const MatrixX taken = modes * modes.transpose();
  const FootHold hold = about.hold({.taken = taken}, Quaternion::Identity());
  EXPECT_LT((hold.root * hold.root.transpose() - taken).norm(), 1e-12 * taken.norm());

  // Turned with the tissue: force and displacement are seen in the frame that turned.
  const Quaternion turn(Eigen::AngleAxisd(0.7, Vec3(1, 1, 0).normalized()));
  const FootHold turned = about.hold({.taken = taken}, turn);
  const Vec3 force(0.2, -0.1, 1.0);
  const double there = hold.share(hold.centre, turn * force).squaredNorm();
  EXPECT_NEAR(turned.share(hold.centre, force).squaredNorm(), there, 1e-12 * there);
}

TEST(FirstOrder, WhereABodyHasBecomeSofterAHoldGivesWhatItWasMadeFrom) {
  const FirstOrder about(disc(), Vec3::UnitZ());
  MatrixX modes(9, 3);
  for (int i = 0; i < 9; ++i)
    modes.row(i) << std::sin(1.0 + i), std::cos(3.0 * i), std::sin(5.0 * i);
  const MatrixX taken = modes * Vec3(1.0, -2.0, 0.5).asDiagonal() * modes.transpose();
  const FootHold hold = about.hold({.taken = taken}, Quaternion::Identity());
  EXPECT_TRUE(hold.is_sound());
  EXPECT_LT((hold.root * hold.signs().asDiagonal() * hold.root.transpose() - taken).norm(),
            1e-12 * taken.norm());
}

TEST(NearestRotation, OfAStretchedRotationIsTheRotation) {
  const Quaternion turn(Eigen::AngleAxisd(2.5, Vec3(-1, 0.3, 2).normalized()));
  Mat3 stretch = Vec3(0.2, 1.0, 3.0).asDiagonal();
  stretch(0, 1) = stretch(1, 0) = 0.1;
  EXPECT_LT(nearest_rotation(turn.toRotationMatrix() * stretch).angularDistance(turn), 1e-9);
}

TEST(NearestRotation, OfWhatIsNoneIsNoTurn) {
  EXPECT_EQ(nearest_rotation(Mat3::Zero()).w(), 1.0);
  EXPECT_EQ(nearest_rotation(-Mat3::Identity()).w(), 1.0);
  EXPECT_EQ(nearest_rotation(Mat3::Constant(NAN)).w(), 1.0);
}

}  // namespace
}  // namespace viscera
