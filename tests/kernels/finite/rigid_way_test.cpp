// What of a way moves and turns all of a piece.
#include "kernels/finite/rigid_way.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <vector>

namespace viscera::test {
namespace {

struct Body {
  std::vector<Vec3> positions;
  std::vector<double> masses;
  std::vector<int> all;
  VectorX u, way;
  Body() {
    for (int i = 0; i < 27; ++i) {
      positions.emplace_back(1e-2 * (i % 3), 7e-3 * ((i / 3) % 3), 5e-3 * (i / 9));
      masses.push_back(1e-3 * (1 + i % 4));
      all.push_back(i);
    }
    u.resize(3 * 27);
    way.resize(3 * 27);
    for (Eigen::Index i = 0; i < u.size(); ++i) {
      u[i] = 1e-3 * static_cast<double>((7 * i) % 11);
      way[i] = 1e-4 * static_cast<double>((5 * i) % 13);
    }
  }
  FreeNodes nodes() const { return {all, positions, masses}; }
  VectorX gone_by(const VectorX& by, bool rigidly = false) const {
    VectorX next = u;
    go_by(nodes(), u, by, rigidly, next);
    return next;
  }
  Vec3 place(const VectorX& displacements, std::size_t node) const {
    return positions[node] + displacements.segment<3>(static_cast<Eigen::Index>(3 * node));
  }
};

TEST(RigidWay, IsAllOfAWayThatIsOne) {
  Body body;
  const Vec3 shift(1e-3, -2e-3, 3e-3), turn(0.2, -0.1, 0.3);
  const Vec3 centre = rigid_part(body.nodes(), body.u, body.way).centre;
  for (std::size_t node = 0; node < 27; ++node)
    body.way.segment<3>(static_cast<Eigen::Index>(3 * node)) =
        shift + turn.cross(Vec3(body.place(body.u, node) - centre));
  const RigidWay rigid = rigid_part(body.nodes(), body.u, body.way);
  EXPECT_LT((rigid.shift - shift).norm(), 1e-15);
  EXPECT_LT((rigid.turn - turn).norm(), 1e-12);
  // No two nodes come nearer to each other, as they would along straight ways.
  const VectorX next = body.gone_by(body.way);
  for (std::size_t i = 0; i < 27; ++i)
    for (std::size_t j = 0; j < i; ++j)
      EXPECT_NEAR((body.place(next, i) - body.place(next, j)).norm(),
                  (body.place(body.u, i) - body.place(body.u, j)).norm(), 1e-14);
  EXPECT_LT((next - body.gone_by(body.way, true)).norm(), 1e-13);
}

TEST(RigidWay, LeavesWhatStrainsTheBodyWithoutMomentum) {
  const Body body;
  const RigidWay rigid = rigid_part(body.nodes(), body.u, body.way);
  Vec3 momentum = Vec3::Zero(), spin = Vec3::Zero();
  for (std::size_t node = 0; node < 27; ++node) {
    const Vec3 arm = body.place(body.u, node) - rigid.centre;
    const Vec3 rest = body.way.segment<3>(static_cast<Eigen::Index>(3 * node)) - rigid.shift -
                      rigid.turn.cross(arm);
    momentum += body.masses[node] * rest;
    spin += body.masses[node] * arm.cross(rest);
  }
  EXPECT_LT(momentum.norm(), 1e-16);
  EXPECT_LT(spin.norm(), 1e-18);
}

TEST(RigidWay, OfAShortWayIsThatWayToItsSquare) {
  const Body body;
  const auto beyond = [&](double share) {
    return (body.gone_by(share * body.way) - body.u - share * body.way).norm();
  };
  EXPECT_GT(beyond(1.0), 0.0);
  EXPECT_NEAR(beyond(0.1) / beyond(1.0), 0.01, 0.002);
}

}  // namespace
}  // namespace viscera::test
