// Contact on hives alone: the conditions of every contact, on a body of which nothing is prepared.
#include "kernels/hive/hive_contact.h"

#include <gtest/gtest.h>

#include <cmath>

#include "kernels/base/archive.h"
#include "kernels/contact/cell_pattern.h"
#include "tests/support/shapes.h"

namespace viscera {
namespace {

const IsotropicMaterial kTissue{1e4, 0.45};
constexpr double kTop = 0.03, kBall = 4e-3;

const WalkableSurface& ground() {
  static const WalkableSurface one =
      WalkableSurface::make(test::box(Vec3(0.12, 0.12, 2.0 * kTop), 20)).value();
  return one;
}

HiveSettings settings() {
  HiveSettings hive;
  hive.material = kTissue;
  hive.radius = 4.0 * kBall;
  hive.nodes = 120;
  return hive;
}

std::unique_ptr<HiveContact> contact() {
  return HiveContact::create(ground(), settings()).value();
}

/// A ball pressed `depth` deep at (x, y) of the top.
std::vector<ContactCell> ball(double x, double y, double depth) {
  const double across = std::sqrt(kBall * depth);
  const double pitch = 1.25 * across / 3.1;
  std::vector<ContactCell> cells;
  for (const Vec2& place : hexagonal_grid(pitch, 3).places) {
    ContactCell cell;
    cell.position = Vec3(x + place.x(), y + place.y(), kTop);
    cell.area = std::sqrt(0.75) * pitch * pitch;
    cell.depth = depth - (kBall - std::sqrt(kBall * kBall - place.squaredNorm()));
    cells.push_back(cell);
  }
  return cells;
}

std::vector<ContactCell> jaw(double x, double y, double radius, const Vec3& lift) {
  const CellPattern pattern =
      fitted_to_punch(hexagonal_grid(1.0, 2), radius, kTissue.poisson_ratio, true);
  std::vector<ContactCell> cells;
  for (std::size_t k = 0; k < pattern.places.size(); ++k) {
    ContactCell cell;
    cell.held = true;
    cell.position = Vec3(x + pattern.places[k].x(), y + pattern.places[k].y(), kTop);
    cell.area = pattern.areas[k];
    cell.displacement = lift;
    cells.push_back(cell);
  }
  return cells;
}

std::vector<ContactCell> both(std::vector<ContactCell> one, const std::vector<ContactCell>& two) {
  one.insert(one.end(), two.begin(), two.end());
  return one;
}

Vec3 sum(const ContactSolution& solution, std::size_t begin, std::size_t end) {
  Vec3 all = Vec3::Zero();
  for (std::size_t k = begin; k < end; ++k) all += solution.forces[k];
  return all;
}

struct Answer {
  ContactSolution solution;
  ContactResponse response;
};
Answer solve(HiveContact& on, const std::vector<ContactCell>& cells) {
  Answer answer;
  on.solve(cells, answer.solution, answer.response);
  EXPECT_TRUE(answer.solution.converged);
  return answer;
}

TEST(HiveContact, ABallOnADeepBodyIsHertzs) {
  const auto tissue = contact();
  const double depth = 0.6e-3;
  const Answer answer = solve(*tissue, ball(1e-3, 2e-3, depth));
  const double hertz = 4.0 / 3.0 * kTissue.contact_modulus() * std::sqrt(kBall * depth) * depth;
  // The body is 60 mm deep and 120 wide: a per cent or two softer or stiffer than a half-space.
  EXPECT_NEAR(-sum(answer.solution, 0, 37).z(), hertz, 0.04 * hertz);
  EXPECT_EQ(tissue->without_hive(), 0);
}

TEST(HiveContact, AJawHoldsLiftsAndTurnsTissue) {
  const auto tissue = contact();
  const double lift = 1e-3, radius = 3e-3, nu = kTissue.poisson_ratio;
  const Answer up = solve(*tissue, jaw(0, 0, radius, Vec3(0, 0, lift)));
  const double bonded =
      4.0 * kTissue.shear_modulus() * radius * lift * std::log(3.0 - 4.0 * nu) / (1.0 - 2.0 * nu);
  EXPECT_NEAR(sum(up.solution, 0, 19).z(), bonded, 0.04 * bonded);
  const Answer aside = solve(*tissue, jaw(0, 0, radius, Vec3(lift, 0, 0)));
  EXPECT_GT(sum(aside.solution, 0, 19).x(), 0.5 * bonded);
}

TEST(HiveContact, ToolsFeelEachOtherAcrossHives) {
  const auto tissue = contact();
  const double alone = -sum(solve(*tissue, ball(0, 0, 0.6e-3)).solution, 0, 37).z();
  // A jaw that lifts beside brings the tissue up under the ball; one that holds still keeps it.
  const auto beside = [&](double away, const Vec3& lift) {
    return -sum(solve(*tissue, both(ball(0, 0, 0.6e-3), jaw(away, 0, 2e-3, lift))).solution, 0, 37)
                .z();
  };
  EXPECT_GT(beside(20e-3, Vec3(0, 0, 1e-3)), 1.02 * alone);
  EXPECT_GT(beside(6e-3, Vec3::Zero()), 1.01 * alone);
  EXPECT_NEAR(beside(20e-3, Vec3::Zero()), alone, 0.02 * alone);
  const MatrixX& response = tissue->cell_response();
  EXPECT_LT((response - response.transpose()).cwiseAbs().maxCoeff(),
            1e-12 * response.cwiseAbs().maxCoeff());
}

TEST(HiveContact, ATipThatRubsDragsTissueWithinItsCone) {
  const auto tissue = contact();
  auto cells = ball(0, 0, 0.6e-3);
  for (ContactCell& cell : cells) {
    cell.friction = 0.3;
    cell.displacement = Vec3(5e-3, 0, 0);
  }
  const Vec3 force = sum(solve(*tissue, cells).solution, 0, 37);
  EXPECT_NEAR(force.x(), -0.3 * force.z(), 1e-3 * force.norm());
}

TEST(HiveContact, SpringsMayEndOnIt) {
  const auto tissue = contact();
  auto cells = jaw(0, 0, 3e-3, Vec3(0, 0, 1e-3));
  const auto stiff = solve(*tissue, cells);
  ContactSolution soft;
  ContactResponse response;
  const auto size = static_cast<Eigen::Index>(3 * cells.size());
  tissue->solve(cells, soft, response, 10.0 * MatrixX::Identity(size, size));
  ASSERT_TRUE(soft.converged);
  EXPECT_LT(sum(soft, 0, 19).z(), 0.9 * sum(stiff.solution, 0, 19).z());
  EXPECT_TRUE(tissue->abilities().springs);
  EXPECT_FALSE(tissue->abilities().shapes);
}

TEST(HiveContact, WhatIsDrawnFollowsTheCellsAndLeavesTheFarSideAlone) {
  const auto tissue = contact();
  const auto cells = jaw(0, 0, 4e-3, Vec3(0, 0, 2e-3));
  const Answer answer = solve(*tissue, cells);
  std::vector<float> places;
  std::vector<Vec3f> positions;
  tissue->place_displacements(answer.response, places);
  EXPECT_TRUE(places.empty());
  tissue->draw(places, cells, answer.solution, positions);
  const std::vector<Vec3>& rest = ground().surface().vertices;
  double under = 0.0, below = 0.0;
  for (std::size_t v = 0; v < rest.size(); ++v) {
    const double rise = static_cast<double>(positions[v].z()) - rest[v].z();
    if (rest[v].z() > 0.0 && rest[v].head<2>().norm() < 3e-3) under = std::max(under, rise);
    if (rest[v].z() < -0.9 * kTop) below = std::max(below, std::abs(rise));
  }
  EXPECT_NEAR(under, 2e-3, 0.15e-3);
  EXPECT_LT(below, 1e-8);  // single precision
}

TEST(HiveContact, AnyMomentGoesOnToTheSameBits) {
  const auto frame = [](HiveContact& on, int i) {
    const auto cells =
        both(ball(1e-3 * i, 0, 0.6e-3), jaw(12e-3, 5e-3, 2e-3, Vec3(0, 0, 1e-4 * i)));
    const Answer answer = solve(on, cells);
    Hasher hasher;
    write(hasher, answer.solution.forces);
    write(hasher, on.state());
    std::vector<Vec3f> positions;
    on.draw({}, cells, answer.solution, positions);
    write(hasher, positions);
    return hasher.hex();
  };
  const auto first = contact(), other = contact();
  for (int i = 0; i < 4; ++i) frame(*first, i);
  const auto bytes = saved(*first);
  const std::string next = frame(*first, 4);
  frame(*other, 9);
  ByteReader reader(bytes);
  HiveContact::State state;
  read(reader, state);
  ASSERT_FALSE(reader.failed());
  ASSERT_TRUE(other->fits(state));
  other->restore(std::move(state));
  EXPECT_EQ(frame(*other, 4), next);
}

TEST(HiveContact, SettingsOutOfRangeAreRefused) {
  HiveSettings wrong = settings();
  wrong.radius = -1.0;
  EXPECT_FALSE(HiveContact::create(ground(), wrong));
}

}  // namespace
}  // namespace viscera
