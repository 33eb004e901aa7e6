// Bonds between two surfaces, and what of them a step opens.
#include "kernels/contact/cohesive_layer.h"

#include <gtest/gtest.h>

#include <cmath>

namespace viscera {
namespace {

constexpr CohesiveLaw kLaw{6e3, 7e6, 10.0};

TEST(CohesiveLaw, HasItsToughnessUnderItsTraction) {
  double area = 0.0;
  constexpr int kParts = 100'000;
  for (int i = 0; i < kParts; ++i) {
    const double open = (i + 0.5) / kParts * kLaw.last();
    area += kLaw.stiffness * kLaw.left(open) * open * kLaw.last() / kParts;
  }
  EXPECT_NEAR(area, kLaw.toughness, 1e-6 * kLaw.toughness);
  EXPECT_NEAR(kLaw.stiffness * kLaw.left(kLaw.first()) * kLaw.first(), kLaw.strength, 1e-9);
  EXPECT_EQ(kLaw.left(kLaw.last()), 0.0);
  EXPECT_EQ(kLaw.left(2.0 * kLaw.last()), 0.0);
}

TEST(CohesiveLaw, WhatIsSpentDoesntComeBackAsItCloses) {
  for (const double open : {0.5 * kLaw.first(), 2.0 * kLaw.first(), 0.9 * kLaw.last()}) {
    double area = 0.0;
    constexpr int kParts = 100'000;
    for (int i = 0; i < kParts; ++i) {
      const double at = (i + 0.5) / kParts * open;
      area += kLaw.stiffness * kLaw.left(at) * at * open / kParts;
    }
    const double comes_back = 0.5 * kLaw.stiffness * kLaw.left(open) * open * open;
    EXPECT_NEAR(kLaw.spent(open), area - comes_back, 1e-6 * kLaw.toughness) << open;
  }
}

TEST(CohesiveLaw, IsUnsoundWhereItWouldPartBeforeItHasItsStrength) {
  EXPECT_TRUE(kLaw.is_sound());
  EXPECT_FALSE((CohesiveLaw{6e3, 7e6, 2.0}).is_sound());
  EXPECT_FALSE((CohesiveLaw{0.0, 7e6, 2.0}).is_sound());
}

/// Cells 2 mm apart on a plane, bonds 1 mm apart between them.
struct Plane {
  std::vector<Vec3> cells, bonds, normals;
  Plane() {
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 4; ++j) cells.emplace_back(2e-3 * i, 2e-3 * j, 0.0);
    for (int i = 0; i < 11; ++i)
      for (int j = 0; j < 7; ++j) bonds.emplace_back(1e-3 * i, 1e-3 * j, 0.0);
    normals.assign(bonds.size(), Vec3::UnitZ());
  }
  CohesiveLayer layer() const {
    CohesiveLayer layer{kLaw, std::vector<double>(bonds.size(), 1e-6),
                        bond_shares(bonds, normals, cells, 3.8e-3), cells.size()};
    return layer;
  }
};

TEST(BondShares, TakeFieldsThatAreLinearAlongTheSurfaceAsTheyAre) {
  const Plane plane;
  const BondShares shares = plane.layer().shares;
  ASSERT_EQ(shares.bonds(), plane.bonds.size());
  const auto field = [](const Vec3& x) { return 3.0 + 200.0 * x.x() - 70.0 * x.y(); };
  for (std::size_t b = 0; b < shares.bonds(); ++b) {
    double sum = 0.0, whole = 0.0;
    for (std::uint32_t e = shares.begin[b]; e < shares.begin[b + 1]; ++e) {
      sum += shares.values[e] * field(plane.cells[shares.cells[e]]);
      whole += shares.values[e];
    }
    EXPECT_NEAR(whole, 1.0, 1e-12);
    EXPECT_NEAR(sum, field(plane.bonds[b]), 1e-9);
  }
}

TEST(BondShares, OfABondWithTooFewCellsAreTheNearestOnes) {
  const std::vector<Vec3> cells = {Vec3::Zero(), Vec3(1e-3, 0, 0), Vec3(2e-3, 0, 0)};
  const std::vector<Vec3> bonds = {Vec3(1.2e-3, 0.2e-3, 0)}, normals = {Vec3::UnitZ()};
  const BondShares shares = bond_shares(bonds, normals, cells, 3e-3);
  ASSERT_EQ(shares.cells.size(), 1u);
  EXPECT_EQ(shares.cells[0], 1u);
  EXPECT_EQ(shares.values[0], 1.0);
}

TEST(LayerInStep, GivesWayAsItsBondsDo) {
  const CohesiveLayer layer = Plane().layer();
  const BondStates whole = whole_bonds(layer);
  LayerInStep step(layer, whole);
  ASSERT_EQ(step.joined().size(), layer.cells);
  // All cells pulled apart alike: every bond opens by that, and the pull is the traction's sum.
  const auto count = static_cast<Eigen::Index>(layer.cells);
  const double open = 0.3 * kLaw.first();
  const VectorX pull = step.softness().llt().solve(VectorX::Constant(count, open));
  const double exact = open * kLaw.stiffness * 1e-6 * static_cast<double>(layer.areas.size());
  EXPECT_NEAR(pull.sum(), exact, 1e-5 * exact);
  EXPECT_FALSE(step.follow(std::vector<Vec3>(layer.cells, Vec3(0, open, 0))));
  EXPECT_NEAR(step.after().opened[0], open, 1e-12);
}

TEST(LayerInStep, SoftensAsFarAsItIsOpenedAndNoFarther) {
  const CohesiveLayer layer = Plane().layer();
  const BondStates whole = whole_bonds(layer);
  LayerInStep step(layer, whole);
  const auto apart = [&](double by) { return std::vector<Vec3>(layer.cells, Vec3(0, 0, by)); };
  EXPECT_TRUE(step.follow(apart(0.9 * kLaw.last())));
  EXPECT_TRUE(step.follow(apart(2.0 * kLaw.first()))) << "what was only tried leaves nothing";
  EXPECT_NEAR(step.after().opened[3], 2.0 * kLaw.first(), 1e-12);
  const VectorX pull = step.softness().llt().solve(
      VectorX::Constant(static_cast<Eigen::Index>(layer.cells), 2.0 * kLaw.first()));
  const double traction = kLaw.stiffness * kLaw.left(2.0 * kLaw.first()) * 2.0 * kLaw.first();
  const double exact = traction * 1e-6 * static_cast<double>(layer.areas.size());
  EXPECT_NEAR(pull.sum(), exact, 1e-4 * exact);
  // The next step begins there, and doesn't heal as it closes.
  const BondStates before = step.after();
  LayerInStep next(layer, before);
  EXPECT_FALSE(next.follow(apart(0.0)));
  EXPECT_EQ(next.after().opened, before.opened);
}

TEST(LayerEdges, AreWhereBondsHaveNoneBesideThem) {
  // 12 x 7 bonds a millimetre apart.
  std::vector<Vec3> bonds, normals;
  for (int y = 0; y < 7; ++y)
    for (int x = 0; x < 12; ++x) {
      bonds.push_back(1e-3 * Vec3(x, y, 0));
      normals.push_back(Vec3::UnitZ());
    }
  const std::vector<double> areas(bonds.size(), 1e-6);
  const std::vector<double> edges = layer_edges(bonds, normals, areas, 1.9e-3);
  for (std::size_t b = 0; b < bonds.size(); ++b) {
    const bool outermost = bonds[b].x() < 0.5e-3 || bonds[b].x() > 10.5e-3 ||
                           bonds[b].y() < 0.5e-3 || bonds[b].y() > 5.5e-3;
    EXPECT_DOUBLE_EQ(edges[b], outermost ? 1e-3 : 0.0) << bonds[b].transpose();
  }
}

TEST(LayerInStep, HasTheFilmOverItsEdgeUntilThatIsOpenedTooFar) {
  CohesiveLayer layer = Plane().layer();
  layer.film = {20.0, 20e3, 0.06};  // whole up to 1 mm, gone at 6 mm
  layer.edges.assign(layer.areas.size(), 0.0);
  layer.edges[0] = layer.edges[1] = 1e-3;
  const BondStates whole = whole_bonds(layer);
  LayerInStep step(layer, whole);
  const auto count = static_cast<Eigen::Index>(layer.cells);
  const double open = 0.3 * kLaw.first();
  const VectorX pull = step.softness().llt().solve(VectorX::Constant(count, open));
  const double exact = open * (kLaw.stiffness * 1e-6 * static_cast<double>(layer.areas.size()) +
                               2.0 * 1e-3 * layer.film.stiffness);
  EXPECT_NEAR(pull.sum(), exact, 1e-5 * exact);
  // Farther than bonds go, the film alone holds.
  constexpr double kFar = 4e-3;
  ASSERT_LT(kLaw.last(), kFar);
  EXPECT_NEAR(layer.stiffness(0, kFar), 1e-3 * layer.film.stiffness * layer.film.left(kFar), 1e-12);
  BondStates far = whole;
  far.opened.assign(far.opened.size(), kFar);
  EXPECT_TRUE(holds(layer, far, 0));
  EXPECT_FALSE(holds(layer, far, 5));
  EXPECT_NEAR(layer.spent(0, 1.0), 1e-6 * kLaw.toughness + 1e-3 * layer.film.toughness, 1e-12);
}

TEST(LayerInStep, LeavesOutCellsThatNoBondHoldsAnyMore) {
  const Plane plane;
  const CohesiveLayer layer = plane.layer();
  BondStates states = whole_bonds(layer);
  for (std::size_t b = 0; b < plane.bonds.size(); ++b) {
    if (plane.bonds[b].x() < 5.5e-3) states.opened[b] = 2.0 * kLaw.last();
    if (plane.bonds[b].x() > 8.5e-3) states.parted_by[b] = 1;
  }
  EXPECT_FALSE(holds(layer, states, 0));
  EXPECT_FALSE(holds(layer, states, plane.bonds.size() - 1));
  LayerInStep step(layer, states);
  EXPECT_LT(step.joined().size(), layer.cells);
  for (const std::size_t cell : step.joined()) EXPECT_GT(plane.cells[cell].x(), 1.9e-3);
  EXPECT_EQ(step.softness().rows(), static_cast<Eigen::Index>(step.joined().size()));
  EXPECT_EQ(step.softness().llt().info(), Eigen::Success);
  EXPECT_FALSE(step.follow(std::vector<Vec3>(step.joined().size(), Vec3::Zero())));
  EXPECT_EQ(step.after().parted_by, states.parted_by);
}

}  // namespace
}  // namespace viscera
