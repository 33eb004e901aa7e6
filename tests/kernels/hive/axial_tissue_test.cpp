#include "kernels/hive/axial_tissue.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "kernels/hive/hyperelastic.h"

namespace viscera {
namespace {

constexpr double kStiffVolume = 9.0;  // lambda / mu at Poisson's ratio .45
constexpr HyperelasticModel kModels[] = {HyperelasticModel::kLinear, HyperelasticModel::kStvk,
                                         HyperelasticModel::kNeoHookean};
const std::vector<double> kEnds{0.2, 0.55, 1.0};
using RingVector = AxialTissue::RingVector;

// Every node of a grid with these radii and depths.
template <class Motion>
void move(AxialTissue& tissue, const AxialGrid& grid, const Motion& motion) {
  std::size_t at = 0;
  for (const double r : grid.radii)
    for (const double depth : grid.depths) {
      const Vec2 u = motion(r, -depth);
      tissue.state()[at++] = u.x();
      tissue.state()[at++] = u.y();
    }
}

TEST(AxialTissue, AnEvenDeformationHasAnEvenStressAndNoForceInside) {
  const AxialGrid grid = AxialGrid::graded(kEnds, 80);
  for (const HyperelasticModel model : kModels) {
    AxialTissue tissue(grid, kEnds, model, kStiffVolume);
    const double across = 1.12, along = 0.86;
    move(tissue, grid,
         [&](double r, double z) { return Vec2((across - 1.0) * r, (along - 1.0) * z); });
    const RingVector none = RingVector::Zero(3);
    tissue.linearise(none, none);
    const auto deep = static_cast<int>(grid.depths.size()),
               wide = static_cast<int>(grid.radii.size());
    double greatest = 0.0;
    for (const double f : tissue.forces()) greatest = std::max(greatest, std::abs(f));
    for (int c = 0; c + 1 < wide; ++c)
      for (int k = 1; k + 1 < deep; ++k)
        for (int i = c == 0 ? 1 : 0; i < 2; ++i)
          EXPECT_NEAR(tissue.forces()[static_cast<std::size_t>(2 * (c * deep + k) + i)], 0.0,
                      1e-12 * greatest)
              << name_of(model) << ' ' << c << ' ' << k;
    // At the top it is the stress times the area.
    const double radius = grid.radii.back(),
                 volume = std::numbers::pi * radius * radius * grid.depths.back();
    HyperelasticLaw law(model, {1.0, 0.3});
    law.mu = 1.0;
    law.lambda = kStiffVolume;
    const Mat3 f = Vec3(across, across, along).asDiagonal();
    double top = 0.0;
    for (int c = 0; c < wide; ++c)
      top += tissue.forces()[static_cast<std::size_t>(2 * c * deep + 1)];
    EXPECT_NEAR(top, law.stress(f)(2, 2) * std::numbers::pi * radius * radius,
                1e-9 * std::abs(top));
    EXPECT_NEAR(tissue.energy(), law.energy(f) * volume, 1e-9 * tissue.energy());
  }
}

TEST(AxialTissue, ForcesAreTheSlopeOfTheEnergy) {
  const AxialGrid grid = AxialGrid::graded(kEnds, 40);
  for (const HyperelasticModel model : kModels) {
    AxialTissue tissue(grid, kEnds, model, kStiffVolume);
    const auto dent = [](double r, double z) {
      const double s = std::exp(-r * r + z);
      return Vec2(0.08 * r * s, -0.15 * s);
    };
    move(tissue, grid, dent);
    const RingVector none = RingVector::Zero(3);
    tissue.linearise(none, none);
    const std::vector<double> forces(tissue.forces().begin(), tissue.forces().end());
    const std::size_t deep = grid.depths.size();
    for (std::size_t at = 2 * deep; at < 6 * deep; ++at) {
      const double step = 1e-6, was = tissue.state()[at];
      tissue.state()[at] = was + step;
      tissue.linearise(none, none);
      const double more = tissue.energy();
      tissue.state()[at] = was - step;
      tissue.linearise(none, none);
      const double less = tissue.energy();
      tissue.state()[at] = was;
      EXPECT_NEAR(forces[at], (more - less) / (2.0 * step), 1e-7) << name_of(model) << ' ' << at;
    }
  }
}

// Newton's until the rings are there.
AxialTissue::Linearisation settle(AxialTissue& tissue, const RingVector& v,
                                  const RingVector& load) {
  const RingVector none = RingVector::Zero(v.size());
  for (int i = 0; i < 30; ++i) {
    EXPECT_TRUE(tissue.linearise(load, none));
    double share = 0.0;
    if (tissue.advance(v - tissue.displacement(), none, 0.1, share) < 1e-12) break;
  }
  EXPECT_TRUE(tissue.linearise(load, none));
  return tissue.linearisation();
}

TEST(AxialTissue, ItsLinearisationForetellsReactionsAndLateralMotion) {
  AxialTissue tissue(AxialGrid::graded(kEnds, 60), kEnds, HyperelasticModel::kNeoHookean,
                     kStiffVolume);
  RingVector v(3), load(3), dv(3), dp(3);
  v << 0.3, 0.24, 0.15;
  load << 0.0, 0.05, 0.02;
  dv << 1e-5, -2e-5, 3e-5;
  dp << 0.0, 2e-5, -1e-5;
  const AxialTissue::Linearisation at = settle(tissue, v, load);
  const double energy = tissue.energy();
  EXPECT_LT((tissue.displacement() - v).norm(), 1e-12);
  EXPECT_LT((at.lateral - tissue.lateral()).norm(), 1e-9);
  EXPECT_LT((at.stiffness - at.stiffness.transpose()).norm(), 1e-10 * at.stiffness.norm());
  const AxialTissue::Linearisation next = settle(tissue, v + dv, load + dp);
  const RingVector reaction = at.reaction + at.stiffness * dv - at.cross.transpose() * dp;
  const RingVector lateral = at.lateral + at.cross * dv + at.yield * dp;
  EXPECT_LT((reaction - next.reaction).norm(), 1e-3 * (next.reaction - at.reaction).norm());
  EXPECT_LT((lateral - next.lateral).norm(), 1e-3 * (next.lateral - at.lateral).norm());
  // The work of pressures and loads is what is stored.
  const double work = 0.5 * (at.reaction + next.reaction).dot(dv) +
                      (load + 0.5 * dp).dot(RingVector(next.lateral - at.lateral));
  EXPECT_NEAR(tissue.energy() - energy, work, 1e-3 * std::abs(work));
}

TEST(AxialTissue, ALinearGridIsTheHalfSpaceUnderAnEvenPressure) {
  // Mean displacement of the disc: 16 (1 - nu^2) p a / (3 pi E) [Johnson1985] eq. 3.29; less what
  // lies beyond the grid's end.
  const std::vector<double> disc{1.0};
  const double nu = 0.45, modulus = 2.0 * (1.0 + nu);
  const double exact =
      16.0 * (1.0 - nu * nu) / (3.0 * std::numbers::pi * modulus) / std::numbers::pi;
  for (const auto& [nodes, bound] : {std::pair(80, 0.18), std::pair(1500, 0.12)}) {
    AxialTissue tissue(AxialGrid::graded(disc, nodes), disc, HyperelasticModel::kLinear,
                       kStiffVolume);
    const RingVector none = RingVector::Zero(1);
    ASSERT_TRUE(tissue.linearise(none, none));
    EXPECT_NEAR(1.0 / tissue.linearisation().stiffness(0, 0), exact, bound * exact) << nodes;
  }
}

TEST(AxialTissue, TissueThatGivesWayIsSaidSo) {
  const std::vector<double> disc{1.0};
  AxialTissue tissue(AxialGrid::graded(disc, 60), disc, HyperelasticModel::kStvk, kStiffVolume);
  const RingVector none = RingVector::Zero(1);
  RingVector dv(1);
  dv << 0.05;
  bool sound = true;
  double share = 0.0;
  for (int i = 0; i < 60 && (sound = tissue.linearise(none, none)); ++i)
    tissue.advance(dv, none, 0.2, share);
  EXPECT_FALSE(sound);
}

}  // namespace
}  // namespace viscera
