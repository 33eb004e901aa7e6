// Pieces of a body that nothing holds, beside what something does.
#include "kernels/finite/loose_pieces.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <vector>

#include "kernels/finite/finite_limits.h"
#include "kernels/finite/warped_factor.h"

namespace viscera::test {
namespace {

/// Two cubes of eight nodes, of which nothing holds the second.
struct TwoCubes {
  static constexpr std::size_t kNodes = 16;
  std::vector<Vec3> positions;
  std::vector<int> piece_of;
  std::vector<double> masses = std::vector<double>(kNodes, 1e-3);
  TwoCubes() {
    for (int i = 0; i < 16; ++i) {
      positions.emplace_back(1e-2 * (i & 1) + (i < 8 ? 0.0 : 5e-2), 1e-2 * ((i >> 1) & 1),
                             1e-2 * ((i >> 2) & 1));
      piece_of.push_back(i < 8 ? -1 : 0);
    }
  }
  LoosePieces pieces() const { return {piece_of, positions, masses}; }
  static auto of(VectorX& u, int node) { return u.segment<3>(Eigen::Index{3} * node); }
};

TEST(LoosePieces, TurnAsOneWhereTheRestGoesStraight) {
  const TwoCubes cubes;
  VectorX u = VectorX::Zero(48), way = VectorX::Zero(48);
  const Vec3 turn(0, 0, 0.5), middle(5.5e-2, 5e-3, 5e-3);
  for (int node = 0; node < 16; ++node)
    TwoCubes::of(way, node) =
        node < 8 ? Vec3(1e-3, 0, 0)
                 : Vec3(turn.cross(Vec3(cubes.positions[static_cast<std::size_t>(node)] - middle)));
  VectorX next = cubes.pieces().gone_by(u, way);
  const Mat3 rotation = Eigen::AngleAxisd(0.5, Vec3::UnitZ()).toRotationMatrix();
  for (int node = 0; node < 16; ++node) {
    const Vec3 arm = cubes.positions[static_cast<std::size_t>(node)] - middle;
    const Vec3 expected = node < 8 ? Vec3(1e-3, 0, 0) : Vec3(rotation * arm - arm);
    EXPECT_LT((TwoCubes::of(next, node) - expected).norm(), 1e-15) << node;
  }
}

TEST(LoosePieces, TakeTheirShapeAtRestAgainWhereTheyLieAndAsTheyHaveTurned) {
  const TwoCubes cubes;
  const Mat3 rotation = Eigen::AngleAxisd(2.0, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  const Vec3 shift(0.1, -0.2, 0.3), middle(5.5e-2, 5e-3, 5e-3);
  const auto moved = [&](int node) {
    const Vec3& rest = cubes.positions[static_cast<std::size_t>(node)];
    return Vec3(rotation * (rest - middle) + middle + shift - rest);
  };
  VectorX u = VectorX::Zero(48);
  for (int node = 0; node < 16; ++node) {
    // Stretched by a third about its middle, along all of its axes.
    const Vec3 arm = cubes.positions[static_cast<std::size_t>(node)] - middle;
    TwoCubes::of(u, node) = node < 8 ? Vec3(0, 0, 1e-3) : Vec3(moved(node) + rotation * arm / 3.0);
  }
  VectorX next = cubes.pieces().as_at_rest(u);
  for (int node = 0; node < 16; ++node) {
    const Vec3 expected = node < 8 ? Vec3(0, 0, 1e-3) : moved(node);
    EXPECT_LT((TwoCubes::of(next, node) - expected).norm(), 1e-12) << node;
  }
}

TEST(LoosePieces, GoFartherThanTissueStretchesAndLeaveTheView) {
  const TwoCubes cubes;
  const LoosePieces pieces = cubes.pieces();
  EXPECT_FALSE(pieces.whole());
  EXPECT_FALSE(pieces.has(7));
  EXPECT_TRUE(pieces.has(8));
  VectorX u = VectorX::Zero(48);
  for (int node = 8; node < 16; ++node) TwoCubes::of(u, node).z() = -1.2 * kInView;
  EXPECT_TRUE(pieces.is_tissue(u));
  EXPECT_EQ(pieces.out_of_view(u), (std::vector<int>{8, 9, 10, 11, 12, 13, 14, 15}));
  TwoCubes::of(u, 12).z() = -0.9 * kInView;
  EXPECT_TRUE(pieces.out_of_view(u).empty()) << "a part of it is still seen";
  TwoCubes::of(u, 0).x() = 1.01 * kFarthest;
  EXPECT_FALSE(pieces.is_tissue(u)) << "something holds that node";
}

TEST(LoosePieces, AreAllOfABodyThatNothingHoldsAndNoneOfOneThatIsHeld) {
  const TwoCubes cubes;
  const std::vector<int> none(TwoCubes::kNodes, -1);
  const LoosePieces whole = LoosePieces::of_free_body(cubes.positions, cubes.masses);
  EXPECT_TRUE(whole.whole());
  VectorX far = VectorX::Constant(48, 0.4);
  EXPECT_TRUE(whole.out_of_view(far).empty()) << "its scene watches it";
  EXPECT_TRUE(LoosePieces(none, cubes.positions, cubes.masses).empty());
  EXPECT_TRUE(LoosePieces({}, cubes.positions, cubes.masses).empty());
}

TEST(LoosePieces, KnowTheirNodesAndWhatTheseWeigh) {
  const LoosePieces pieces = TwoCubes().pieces();
  EXPECT_EQ(pieces.piece_of(3), -1);
  EXPECT_EQ(pieces.piece_of(11), 0);
  EXPECT_NEAR(pieces.mass(0), 8e-3, 1e-12);
  EXPECT_EQ(LoosePieces().piece_of(3), -1);
}

TEST(LoosePieces, GiveAllTheirNodesOneRotation) {
  const TwoCubes cubes;
  NodalRotations rotations = no_rotations(TwoCubes::kNodes);
  const Mat3 turned = Eigen::AngleAxisd(0.7, Vec3::UnitX()).toRotationMatrix();
  cubes.pieces().set(std::vector<Mat3>{turned}, rotations);
  for (std::size_t node = 0; node < TwoCubes::kNodes; ++node)
    EXPECT_EQ(Mat3(rotation_of(rotations, node)), node < 8 ? Mat3(Mat3::Identity()) : turned);
}

}  // namespace
}  // namespace viscera::test
