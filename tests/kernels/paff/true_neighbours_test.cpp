#include "kernels/paff/true_neighbours.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "kernels/base/random.h"
#include "kernels/paff/cut_cells.h"
#include "kernels/paff/local_spacing.h"
#include "tests/kernels/paff/elastic_bodies.h"
#include "tests/support/blocks.h"

namespace viscera {
namespace {

constexpr double kSupport = 1.8;

test::Body folded_body() {
  return test::placed_body(test::leaves({16.0, 6.0, 4.0}, 0.6, 4.0, 2.0),
                           [](const Vec3&) { return 2.0; });
}

/// Places in the body, about the end of the gap too, some of them on its walls.
std::vector<Vec3> places_in(const test::Body& body) {
  std::vector<Vec3> places = body.cloud.positions;
  const VolumeQuadrature volume =
      background_quadrature(body.surface, LocalSpacing(body.cloud)).value();
  const TissuePaths paths(body.surface);
  for (std::size_t q = 0; q < volume.size(); q += 3)
    if (paths.tree().signed_distance(volume.positions[q]) < -1e-3)
      places.push_back(volume.positions[q]);
  return places;
}

TEST(TrueNeighbours, AreAllThereAreInBodiesWithoutFoldsToTheBit) {
  for (const test::Body& body :
       {test::placed_body(test::cube(10.0, 4), [](const Vec3&) { return 2.0; }),
        test::placed_body(test::icosphere(6.0, 3), [](const Vec3&) { return 2.0; }),
        // A gap that no support crosses.
        test::placed_body(test::two_cubes(6.0, 6.0, 3), [](const Vec3&) { return 2.0; })}) {
    ASSERT_GT(body.cloud.size(), 50u);
    const ShapeFunctions plain(body.cloud, kSupport), fields(body.surface, body.cloud, kSupport);
    ASSERT_EQ(fields.true_neighbours(), nullptr);
    ShapeValues expected, found;
    for (const Vec3& x : body.cloud.positions) {
      ASSERT_TRUE(plain.evaluate(x, true, expected) && fields.evaluate(x, true, found));
      EXPECT_EQ(found.nodes, expected.nodes);
      EXPECT_EQ(found.values, expected.values);
      EXPECT_EQ(found.weights, expected.weights);
      EXPECT_EQ(found.gradients, expected.gradients);
    }
  }
}

TEST(TrueNeighbours, LeaveGentlyConcaveBodiesAlone) {
  // A thick shell: its inner side is a hollow of five spacings' radius.
  TriangleSurface shell = test::icosphere(16.0, 3);
  const TriangleSurface inner = test::icosphere(10.0, 3);
  const int first = static_cast<int>(shell.vertices.size());
  shell.vertices.insert(shell.vertices.end(), inner.vertices.begin(), inner.vertices.end());
  for (const auto& [a, b, c] : inner.triangles)
    shell.triangles.push_back({first + a, first + c, first + b});
  const test::Body body = test::placed_body(std::move(shell), [](const Vec3&) { return 2.0; });
  ASSERT_GT(body.cloud.size(), 200u);
  EXPECT_EQ(TrueNeighbours::find(body.surface, body.cloud, kSupport), nullptr);
}

TEST(TrueNeighbours, HaveTheirTwinsAtTheirOwnPlaces) {
  const test::Body body = folded_body();
  const auto neighbours = TrueNeighbours::find(body.surface, body.cloud, kSupport);
  ASSERT_NE(neighbours, nullptr);
  ASSERT_GT(neighbours->twins(), 0u);
  EXPECT_EQ(neighbours->cloud().size(), body.cloud.size() + neighbours->twins());
  EXPECT_EQ(neighbours->cloud().surface_count, body.cloud.surface_count);
  for (std::size_t t = 0; t < neighbours->twins(); ++t) {
    const auto parent = static_cast<std::size_t>(neighbours->parent(t));
    ASSERT_LT(parent, body.cloud.size());
    EXPECT_EQ(neighbours->cloud().positions[body.cloud.size() + t], body.cloud.positions[parent]);
    EXPECT_EQ(neighbours->cloud().spacings[body.cloud.size() + t], body.cloud.spacings[parent]);
  }
}

TEST(TrueNeighbours, AddUpToTheFieldsWithoutThemAndReproduceLinearOnes) {
  const test::Body body = folded_body();
  const ShapeFunctions fields(body.surface, body.cloud, kSupport);
  ASSERT_NE(fields.true_neighbours(), nullptr);
  std::size_t shared = 0;
  ShapeValues at;
  for (const Vec3& x : places_in(body)) {
    ASSERT_TRUE(fields.evaluate(x, true, at)) << x.transpose();
    EXPECT_TRUE(std::is_sorted(at.nodes.begin(), at.nodes.end()));
    double sum = 0.0;
    Vec3 place = Vec3::Zero(), slope = Vec3::Zero();
    Mat3 gradient = Mat3::Zero();
    for (std::size_t j = 0; j < at.nodes.size(); ++j) {
      const Vec3& node = fields.cloud().positions[static_cast<std::size_t>(at.nodes[j])];
      shared += at.nodes[j] >= static_cast<int>(body.cloud.size());
      sum += at.values[j];
      place += at.values[j] * node;
      slope += at.gradients[j];
      gradient += node * at.gradients[j].transpose();
    }
    EXPECT_NEAR(sum, 1.0, 1e-10);
    EXPECT_LT((place - x).norm(), 1e-9);
    EXPECT_LT(slope.norm(), 1e-8);
    EXPECT_LT((gradient - Mat3::Identity()).norm(), 1e-8);
  }
  EXPECT_GT(shared, 100u);
}

TEST(TrueNeighbours, AnswerAViewThatWasTakenOftenAsTheyAnswerAFreshOne) {
  const test::Body body = folded_body();
  const test::Body wider = test::placed_body(test::leaves({12.0, 6.0, 3.0}, 0.9, 4.0, 2.0),
                                             [](const Vec3&) { return 1.5; });
  const auto one = TrueNeighbours::find(body.surface, body.cloud, kSupport);
  const auto other = TrueNeighbours::find(wider.surface, wider.cloud, kSupport);
  ASSERT_TRUE(one && other);
  TrueNeighbours::View often;
  std::size_t hidden = 0;
  const std::vector<Vec3> places = places_in(body), elsewhere = places_in(wider);
  for (std::size_t p = 0; p < std::min(places.size(), elsewhere.size()); ++p)
    for (const bool first : {true, false}) {
      const TrueNeighbours& asked = first ? *one : *other;
      const Vec3& place = (first ? places : elsewhere)[p];
      const std::size_t nodes = (first ? body : wider).cloud.size();
      often.take(asked, place);
      for (std::size_t node = 0; node < nodes; ++node) {
        TrueNeighbours::View fresh;
        fresh.take(asked, place);
        TrueNeighbours::Shadow by_often, by_fresh;
        const int number = static_cast<int>(node);
        const bool shadow = asked.shadow(number, fresh, by_fresh);
        ASSERT_EQ(asked.shadow(number, often, by_often), shadow);
        if (!shadow) continue;
        ++hidden;
        EXPECT_EQ(by_often.way, by_fresh.way);
        EXPECT_EQ(by_often.gradient, by_fresh.gradient);
        EXPECT_EQ(by_often.twin, by_fresh.twin);
      }
    }
  EXPECT_GT(hidden, 100u);
}

TEST(TrueNeighbours, HaveNothingOfTheOtherLeafFarFromTheRoot) {
  const test::Body body = folded_body();
  const ShapeFunctions fields(body.surface, body.cloud, kSupport);
  ShapeValues at;
  std::size_t asked = 0;
  for (const Vec3& x : places_in(body)) {
    if (x.x() < 4.0) continue;
    ++asked;
    ASSERT_TRUE(fields.evaluate(x, false, at));
    for (const int node : at.nodes) {
      const Vec3& from = fields.cloud().positions[static_cast<std::size_t>(node)];
      const bool twin = node >= static_cast<int>(body.cloud.size());
      EXPECT_EQ(from.z() * x.z() < 0.0, twin) << from.transpose() << " to " << x.transpose();
    }
  }
  EXPECT_GT(asked, 100u);
}

TEST(TrueNeighbours, HaveGradientsThatMatchDifferencesOfTheValues) {
  const test::Body body = folded_body();
  const ShapeFunctions fields(body.surface, body.cloud, kSupport);
  constexpr double kStep = 1e-6;
  std::size_t asked = 0, off = 0;
  ShapeValues here, ahead, behind;
  const auto value = [](const ShapeValues& at, int node) {
    const auto found = std::lower_bound(at.nodes.begin(), at.nodes.end(), node);
    if (found == at.nodes.end() || *found != node) return 0.0;
    return at.values[static_cast<std::size_t>(found - at.nodes.begin())];
  };
  for (const Vec3& x : places_in(body)) {
    // About the end of the gap, where fields are shared.
    if (std::abs(x.x()) > 2.0 || std::abs(x.y()) > 2.5 || std::abs(x.z()) > 2.5 ||
        std::abs(std::abs(x.z()) - 0.3) < 1e-3)
      continue;
    ASSERT_TRUE(fields.evaluate(x, true, here));
    for (int axis = 0; axis < 3; ++axis) {
      ASSERT_TRUE(fields.evaluate(x + kStep * Vec3::Unit(axis), false, ahead));
      ASSERT_TRUE(fields.evaluate(x - kStep * Vec3::Unit(axis), false, behind));
      for (std::size_t j = 0; j < here.nodes.size(); ++j) {
        const int node = here.nodes[j];
        const double difference = (value(ahead, node) - value(behind, node)) / (2.0 * kStep);
        ++asked;
        off += std::abs(difference - here.gradients[j][axis]) > 1e-5;
      }
    }
  }
  // Where another bend becomes the nearest, the way has a kink, and just there the two differ.
  EXPECT_GT(asked, 1000u);
  EXPECT_LT(static_cast<double>(off), 0.002 * static_cast<double>(asked)) << off << " of " << asked;
}

TEST(TrueNeighbours, CountTheirWaysContinuouslyAroundTheEndOfAGap) {
  const test::Body body = folded_body();
  const ShapeFunctions fields(body.surface, body.cloud, kSupport);
  ShapeValues before, after;
  // Along a line in the lower leaf, past the gap's end into the root.
  constexpr int kSteps = 4000;
  double greatest = 0.0;
  for (int i = 0; i <= kSteps; ++i) {
    const Vec3 x(4.0 - 7.0 * i / kSteps, 0.37, -0.8);
    ASSERT_TRUE(fields.evaluate(x, false, after));
    if (i > 0) {
      for (std::size_t j = 0; j < after.nodes.size(); ++j) {
        const auto found =
            std::lower_bound(before.nodes.begin(), before.nodes.end(), after.nodes[j]);
        const bool had = found != before.nodes.end() && *found == after.nodes[j];
        const double old =
            had ? before.values[static_cast<std::size_t>(found - before.nodes.begin())] : 0.0;
        greatest = std::max(greatest, std::abs(after.values[j] - old));
      }
    }
    std::swap(before, after);
  }
  EXPECT_LT(greatest, 0.02);  // 7 / 4000 of a length at slopes of about one
}

TEST(PartedQuadrature, KeepsPointsOutOfAirAndTheVolumeOfEachPiece) {
  const double gap = 0.3;
  const test::Body body =
      test::placed_body(test::two_cubes(10.0, gap, 4), [](const Vec3&) { return 2.0; });
  const TissuePaths paths(body.surface);
  const VolumeQuadrature parted =
      background_quadrature(body.surface, LocalSpacing(body.cloud), 1, &paths).value();
  double first = 0.0, second = 0.0;
  for (std::size_t q = 0; q < parted.size(); ++q) {
    const double x = parted.positions[q].x();
    EXPECT_TRUE(x < 0.0 || x > gap) << x;
    (x < 0.5 * gap ? first : second) += parted.weights[q];
  }
  EXPECT_NEAR(first, 1000.0, 1e-9);
  EXPECT_NEAR(second, 1000.0, 1e-9);
}

TEST(PartedQuadrature, KeepsPointsOutOfTheAirOfAFoldWithBothDegrees) {
  const double gap = 0.3;
  const test::Body body = test::placed_body(test::leaves({16.0, 6.0, 4.0}, gap, 4.0, 2.0),
                                            [](const Vec3&) { return 2.0; });
  const TissuePaths paths(body.surface);
  for (const int degree : {1, 2}) {
    const VolumeQuadrature parted =
        background_quadrature(body.surface, LocalSpacing(body.cloud), degree, &paths).value();
    double upper = 0.0, all = 0.0;
    std::size_t in_air = 0;
    for (std::size_t q = 0; q < parted.size(); ++q) {
      const Vec3& x = parted.positions[q];
      all += parted.weights[q];
      if (x.x() < 0.0) continue;
      in_air += std::abs(x.z()) < 0.5 * gap;
      if (x.z() > 0.0) upper += parted.weights[q];
    }
    EXPECT_EQ(in_air, 0u) << degree;
    EXPECT_NEAR(all, volume(body.surface), 1e-9 * all);
    // Cells that lie across x = 0 count by their centroids.
    EXPECT_NEAR(upper, 16.0 * 6.0 * 4.0, 30.0) << degree;
  }
}

}  // namespace
}  // namespace viscera
