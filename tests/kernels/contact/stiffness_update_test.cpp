#include "kernels/contact/stiffness_update.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <stdexcept>

#include "engine/verification/changed_body.h"
#include "kernels/contact/deformation.h"
#include "kernels/contact/patch_contact.h"
#include "kernels/paff/compliance_checks.h"
#include "kernels/points/node_placement.h"
#include "kernels/points/surface_tree.h"
#include "tests/kernels/contact/bodies.h"

namespace viscera {
namespace {

constexpr double kSide = 0.04;  // of the cube [m]

NodedBody cube(int cells) {
  NodedBody body = jittered_cube(cells, 0.2);
  for (Vec3& x : body.surface.vertices) x *= kSide;
  for (Vec3& x : body.cloud.positions) x *= kSide;
  for (double& h : body.cloud.spacings) h *= kSide;
  return body;
}

bool at_bottom(const Vec3& x) {
  return x.z() < -0.5 * kSide + 1e-9;
}
bool at_top(const Vec3& x) {
  return x.z() > 0.5 * kSide - 1e-9;
}
std::function<bool(const Vec3&)> ball(const Vec3& centre, double radius) {
  return [=](const Vec3& x) { return (x - centre).norm() < radius; };
}
const Vec3 kPole(2e-3, -1e-3, 0.5 * kSide);

/// Prepared, or the test ends here.
std::unique_ptr<ChangedBody> prepared(NodedBody noded, const IsotropicMaterial& material,
                                      const Where& is_fixed, const Where& is_touchable,
                                      const Where& changes) {
  auto body = ChangedBody::prepare(std::move(noded), material, is_fixed, is_touchable, changes);
  if (!body) throw std::runtime_error(body.error().text());
  return std::move(*body);
}

std::unique_ptr<ChangedBody> prepared_cube(int cells, const IsotropicMaterial& material,
                                           const Where& changes) {
  return prepared(cube(cells), material, at_bottom, at_top, changes);
}

bool everywhere(const Vec3&) {
  return true;
}
bool nowhere(const Vec3&) {
  return false;
}

/// 40 mm, nodes 5 mm apart, tissue that may change in the upper half; prepared once a ratio.
const ChangedBody& block(double poisson_ratio) {
  const auto make = [](double ratio) {
    return prepared_cube(8, {5e3, ratio}, [](const Vec3& x) { return x.z() > 0.0; });
  };
  static const auto soft = make(0.3), stiff = make(0.45);
  return poisson_ratio == 0.3 ? *soft : *stiff;
}

/// The hemisphere of the reference, nodes finest about the pole.
const ChangedBody& hemisphere() {
  static const auto body = [] {
    NodedBody noded{ringed_hemisphere(25e-3, 20), {}};
    const SurfaceTree tree(noded.surface);
    const Vec3 pole(0, 0, 25e-3);
    auto cloud = place_nodes(
        noded.surface, tree, [&](const Vec3& x) { return 3e-3 + 0.15 * (x - pole).norm(); }, {},
        no_progress());
    if (!cloud) throw std::runtime_error(cloud.error().text());
    noded.cloud = std::move(*cloud);
    return prepared(
        std::move(noded), {10e3, 0.45}, [](const Vec3& x) { return x.z() < 1e-9; },
        [](const Vec3& x) { return x.z() > 15e-3; }, ball(pole, 8e-3));
  }();
  return *body;
}

/// So little is dropped that rounding is all that is left.
constexpr double kNothing = 1e-12;

TEST(StiffnessUpdate, AgreesWithTheBodyFactoredAnew) {
  for (const double ratio : {0.3, 0.45}) {
    const ChangedBody& body = block(ratio);
    for (const double factor : {1.5, 4.0, 16.0}) {
      const auto factors = body.factors(factor, ball(kPole, 7e-3));
      const SurfaceCompliance anew = *body.recomputed(factors);
      const StiffnessUpdate exact =
          update_stiffness(body.changeable(), {factors, {}}, body.touchable(), kNothing);
      const StiffnessUpdate update =
          update_stiffness(body.changeable(), {factors, {}}, body.touchable());
      const double error = compliance_distance(body.updated(exact), anew);
      const double dropped = compliance_distance(body.updated(update), anew);
      std::printf(
          "nu %.2f, factor %4.1f: %zu nodes, %zu modes, change %.1e; rank %zu: error %.1e; "
          "rank %zu: %.1e\n",
          ratio, factor, update.nodes, update.modes, compliance_distance(body.sound(), anew),
          exact.rank, error, update.rank, dropped);
      EXPECT_GT(compliance_distance(body.sound(), anew), 0.02);
      EXPECT_LT(error, 1e-6);
      EXPECT_LT(dropped, 2e-5);
      EXPECT_LT(update.rank, exact.rank);
      EXPECT_EQ(update.greatest_stiffness, factor);
    }
  }
}

TEST(StiffnessUpdate, AgreesWithTheHemisphereFactoredAnew) {
  const ChangedBody& body = hemisphere();
  // Graded as a lesion is: stiffest at the pole.
  std::vector<double> factors;
  for (const Vec3& x : body.changeable().tissue.positions) {
    const double r = (x - Vec3(0, 0, 25e-3)).norm();
    factors.push_back(1.0 + 3.0 * std::max(0.0, 1.0 - r / 6e-3));
  }
  const SurfaceCompliance anew = *body.recomputed(factors);
  const StiffnessUpdate exact =
      update_stiffness(body.changeable(), {factors, {}}, body.touchable(), kNothing);
  const StiffnessUpdate update =
      update_stiffness(body.changeable(), {factors, {}}, body.touchable());
  const double error = compliance_distance(body.updated(exact), anew);
  const double dropped = compliance_distance(body.updated(update), anew);
  std::printf(
      "hemisphere: %zu nodes, %zu modes, change %.1e; rank %zu: error %.1e; rank %zu: %.1e\n",
      update.nodes, update.modes, compliance_distance(body.sound(), anew), exact.rank, error,
      update.rank, dropped);
  EXPECT_GT(compliance_distance(body.sound(), anew), 0.02);
  EXPECT_LT(error, 1e-6);
  EXPECT_LT(dropped, 2e-5);
}

TEST(StiffnessUpdate, AgreesWhereLesionsMeet) {
  const ChangedBody& body = block(0.45);
  const auto factors = body.factors(4.0, [](const Vec3& x) {
    return ball(kPole, 6e-3)(x) || ball(kPole + Vec3(9e-3, 3e-3, 0), 5e-3)(x);
  });
  const StiffnessUpdate update =
      update_stiffness(body.changeable(), {factors, {}}, body.touchable(), kNothing);
  EXPECT_LT(compliance_distance(body.updated(update), *body.recomputed(factors)), 1e-6);
}

TEST(StiffnessUpdate, StaysSymmetricAndPositive) {
  for (const double ratio : {0.3, 0.45}) {
    const ChangedBody& body = block(ratio);
    for (const double factor : {4.0, 1000.0}) {
      const auto factors = body.factors(factor, ball(kPole, 12e-3));
      const SurfaceCompliance after =
          body.updated(update_stiffness(body.changeable(), {factors, {}}, body.touchable()));
      EXPECT_GT(smallest_compliance_eigenvalue(after), 0.0) << ratio << " " << factor;
      const auto rows = after.touchable_rows();
      for (std::size_t i = 0; i < rows.size(); ++i) {
        for (std::size_t j = 0; j < i; ++j) {
          ASSERT_NEAR(after.columns[i * after.rows() + rows[j]],
                      after.columns[j * after.rows() + rows[i]], 1e-6f * after.columns[rows[0]]);
        }
      }
    }
  }
}

TEST(StiffnessUpdate, SoundTissueIsNoUpdate) {
  const ChangedBody& body = block(0.3);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double factor : {1.0, 0.2, nan}) {
    const std::vector<double> factors(body.changeable().tissue.size(), factor);
    const std::vector<double> shrinkage(body.changeable().tissue.size(),
                                        factor == 1.0 ? 0.0 : -factor);
    const StiffnessUpdate update =
        update_stiffness(body.changeable(), {factors, shrinkage}, body.touchable());
    EXPECT_EQ(update.rank, 0u);
    EXPECT_EQ(update.memory_bytes(), 0u);
    EXPECT_EQ(update.greatest_stiffness, 1.0);
    EXPECT_EQ(body.updated(update).columns, body.sound().columns);
  }
  EXPECT_EQ(update_stiffness(body.changeable(), {}, body.touchable()).memory_bytes(), 0u);
}

TEST(StiffnessUpdate, WhereNothingMayChangeNothingIsKept) {
  const auto made = prepared_cube(5, {5e3, 0.3}, nowhere);
  const ChangedBody& body = *made;
  EXPECT_TRUE(body.changeable().empty());
  EXPECT_EQ(body.changeable().places.capacity() + body.changeable().nodes.capacity(), 0u);
}

/// All of the tissue, the hold apart, which keeps the sound tissue's values.
TEST(StiffnessUpdate, StifferThroughoutIsABodyOfStifferTissue) {
  for (const double ratio : {0.3, 0.45}) {
    const auto made = prepared_cube(6, {5e3, ratio}, everywhere);
    const auto stiff = prepared_cube(6, {20e3, ratio}, nowhere);
    const ChangedBody& body = *made;
    const StiffnessUpdate update = update_stiffness(
        body.changeable(), {body.factors(4.0, everywhere), {}}, body.touchable(), kNothing);
    const double error = compliance_distance(body.updated(update), stiff->sound());
    std::printf("nu %.2f: four times as stiff throughout, against a body of such tissue: %.1e\n",
                ratio, error);
    EXPECT_LT(error, 0.02);
  }
}

TEST(StiffnessUpdate, ItsCostIsKnownBeforehandAndGrowsWithTheLesion) {
  const ChangedBody& body = block(0.45);
  EXPECT_EQ(update_cost(body.changeable(), {}, body.touchable()), 0.0);
  EXPECT_EQ(update_cost(body.changeable(), {body.factors(1.0, everywhere), {}}, body.touchable()),
            0.0);
  double last = 0.0;
  for (const double radius : {3e-3, 6e-3, 12e-3, 30e-3}) {
    const double cost = update_cost(body.changeable(), {body.factors(2.0, ball(kPole, radius)), {}},
                                    body.touchable());
    EXPECT_GT(cost, last);
    last = cost;
  }
}

TEST(StiffnessUpdate, IsTheSameForAnyNumberOfThreads) {
  const ChangedBody& body = block(0.45);
  TissueChange change{body.factors(4.0, ball(kPole, 7e-3)), {}};
  change.shrinkage.assign(change.stiffness.size(), 0.0);
  for (std::size_t q = 0; q < change.stiffness.size(); ++q)
    change.shrinkage[q] = 0.03 * (change.stiffness[q] - 1.0);
  const StiffnessUpdate many = update_stiffness(body.changeable(), change, body.touchable());
  const oneapi::tbb::global_control one(oneapi::tbb::global_control::max_allowed_parallelism, 1);
  const StiffnessUpdate alone = update_stiffness(body.changeable(), change, body.touchable());
  EXPECT_EQ(many.columns, alone.columns);
  EXPECT_EQ(many.shift, alone.shift);
  EXPECT_EQ(many.stiffness, alone.stiffness);
}

/// Fields are linear, so the patch test: no force is left on any node of a free body that has
/// shrunk uniformly, whatever its stiffness.
TEST(Shrinkage, AFreeBodyShrinksUniformlyToRoundOff) {
  for (const double ratio : {0.3, 0.45, 0.49}) {
    const auto made = prepared_cube(6, {5e3, ratio}, everywhere);
    const ChangedBody& body = *made;
    const ElasticRegion& tissue = body.changeable().tissue;
    // Twice as stiff less once is the body without its hold.
    const std::vector<double> once(tissue.size(), 1.0), twice(tissue.size(), 2.0);
    const AddedStiffness free = added_stiffness(tissue, twice);
    ASSERT_EQ(free.nodes.size(), body.body().cloud.size());
    constexpr double kShrunk = 0.1;
    const VectorX load =
        eigenstrain_load(tissue, once, std::vector<double>(tissue.size(), -kShrunk));
    VectorX uniform(load.size());
    for (std::size_t i = 0; i < tissue.nodes.size(); ++i) {
      uniform.segment<3>(3 * static_cast<Eigen::Index>(i)) =
          -kShrunk * body.body().cloud.positions[static_cast<std::size_t>(tissue.nodes[i])];
    }
    const VectorX left = free.roots.transpose() * (free.roots * uniform) - load;
    EXPECT_LT(left.lpNorm<Eigen::Infinity>(), 1e-11 * load.lpNorm<Eigen::Infinity>()) << ratio;
  }
}

TEST(Shrinkage, AgreesWithTheBodyFactoredAnew) {
  for (const double ratio : {0.3, 0.45}) {
    const ChangedBody& body = block(ratio);
    for (const double factor : {1.0, 4.0}) {
      TissueChange change{body.factors(factor, ball(kPole, 7e-3)), {}};
      // Reaches farther than what has stiffened.
      change.shrinkage = body.factors(1.1, ball(kPole, 9e-3));
      for (double& s : change.shrinkage) s -= 1.0;
      const StiffnessUpdate update = update_stiffness(body.changeable(), change, body.touchable());
      const std::vector<float> anew = *body.recomputed_shape(change);
      ASSERT_EQ(update.shift.size(), anew.size());
      double error = 0.0;
      for (std::size_t i = 0; i < anew.size(); ++i)
        error = std::max(error, static_cast<double>(std::abs(update.shift[i] - anew[i])));
      std::printf(
          "nu %.2f, factor %.0f: shrinkage moves the surface by %.3f mm, error %.1e of that\n",
          ratio, factor, 1e3 * update.greatest_shift, error / update.greatest_shift);
      EXPECT_LT(error, 1e-5 * update.greatest_shift);
      EXPECT_EQ(update.rank > 0, factor > 1.0);
    }
  }
}

TEST(Shrinkage, ALesionDrawsTheSurfaceInAndTogether) {
  const ChangedBody& body = block(0.45);
  TissueChange change{body.factors(4.0, ball(kPole, 7e-3)), body.factors(1.1, ball(kPole, 7e-3))};
  for (double& s : change.shrinkage) s -= 1.0;
  const StiffnessUpdate update = update_stiffness(body.changeable(), change, body.touchable());
  Vec3 sunk = Vec3::Zero();
  double inwards = 0.0, deepest = 0.0;
  for (std::size_t p = 0; p < body.places().size(); ++p) {
    const Vec3 moved = Vec3f::Map(update.shift.data() + 3 * p).cast<double>();
    const Vec3 from = body.places().positions[p] - kPole;
    if (!at_top(body.places().positions[p] + Vec3(0, 0, 1e-9))) continue;
    if (-moved.z() > deepest) {
      deepest = -moved.z();
      sunk = from;
    }
    if (from.norm() > 7e-3 && from.norm() < 12e-3) inwards -= moved.dot(from.normalized());
  }
  // A tenth of a length over some millimetres.
  EXPECT_GT(deepest, 0.2e-3);
  EXPECT_LT(deepest, 1.5e-3);
  EXPECT_LT(sunk.norm(), 6e-3);
  EXPECT_GT(inwards, 0.0);
}

/// Pressed in the middle of the lesion by a flat punch: force over that on sound tissue.
double stiffening(const SurfaceCompliance& compliance, const TouchableSurface& touch,
                  const IsotropicMaterial& material, std::shared_ptr<const StiffnessUpdate> update,
                  const SurfaceCompliance& sound, const Vec3& at) {
  const auto cells = test::plane_cells(at, 0.7e-3, 3, 0.0, 0.5e-3);
  const auto force = [&](const SurfaceCompliance& on, std::shared_ptr<const StiffnessUpdate> by) {
    PatchContact contact(on, touch, material);
    if (by) contact.stiffen(std::move(by));
    ContactSolution solution;
    ContactResponse response;
    contact.solve(cells, solution, response);
    EXPECT_TRUE(solution.converged);
    return -test::total_force(solution).z();
  };
  return force(compliance, std::move(update)) / force(sound, nullptr);
}

TEST(StiffenedContact, ATouchedLesionIsStifferAsTheBodyFactoredAnewIs) {
  const ChangedBody& body = block(0.45);
  const IsotropicMaterial material{5e3, 0.45};
  const auto factors = body.factors(4.0, ball(kPole, 7e-3));
  const auto update = std::make_shared<StiffnessUpdate>(
      update_stiffness(body.changeable(), {factors, {}}, body.touchable()));
  const SurfaceCompliance anew = *body.recomputed(factors);
  // The same near field for both: that of sound tissue.
  auto far_only = std::make_shared<StiffnessUpdate>(*update);
  far_only->stiffness.clear();
  const double one =
      stiffening(body.sound(), body.touchable(), material, far_only, body.sound(), kPole);
  const double other = stiffening(anew, body.touchable(), material, nullptr, body.sound(), kPole);
  const double whole =
      stiffening(body.sound(), body.touchable(), material, update, body.sound(), kPole);
  std::printf(
      "punch of 2.5 mm on a lesion of 7 mm, 4 times as stiff: %.4f updated, %.4f anew; %.4f with "
      "the near field of the lesion\n",
      one, other, whole);
  EXPECT_GT(other, 1.02);
  EXPECT_NEAR(one, other, 1e-4 * other);
  // What is narrower than the nodes feels the lesion the most.
  EXPECT_GT(whole, 1.5);
}

/// What finer nodes would say, by the coarse body's update.
TEST(StiffenedContact, ALesionAsWideAsANodeSpacingIsAsStiffAsFineNodesSay) {
  const IsotropicMaterial material{5e3, 0.45};
  const auto fine = prepared(
      cube(14), material, at_bottom,
      [](const Vec3& x) { return at_top(x) && (x - kPole).norm() < 10e-3; }, ball(kPole, 7e-3));
  const ChangedBody& coarse = block(0.45);
  for (const double radius : {4e-3, 6e-3}) {
    const auto ratio = [&](const ChangedBody& body) {
      const auto factors = body.factors(4.0, ball(kPole, radius));
      return stiffening(body.sound(), body.touchable(), material,
                        std::make_shared<StiffnessUpdate>(
                            update_stiffness(body.changeable(), {factors, {}}, body.touchable())),
                        body.sound(), kPole);
    };
    const double truth = ratio(*fine), found = ratio(coarse);
    std::printf(
        "lesion of %.0f mm: punch of 2.5 mm meets %.3f times the force, with nodes 2.9 mm apart; "
        "%.3f with 5 mm\n",
        1e3 * radius, truth, found);
    EXPECT_NEAR(found, truth, 0.12 * truth);
  }
}

TEST(StiffenedContact, AnUpdateDependsOnNoEarlierOne) {
  const ChangedBody& body = block(0.3);
  const IsotropicMaterial material{5e3, 0.3};
  const auto make = [&](double radius) {
    return std::make_shared<StiffnessUpdate>(update_stiffness(
        body.changeable(), {body.factors(4.0, ball(kPole, radius)), {}}, body.touchable()));
  };
  const auto cells = test::plane_cells(kPole, 0.7e-3, 3, 0.0, 0.5e-3);
  PatchContact fresh(body.sound(), body.touchable(), material),
      used(body.sound(), body.touchable(), material);
  ContactSolution first, second;
  ContactResponse response;
  std::vector<float> one, other;
  used.solve(cells, second, response);
  used.stiffen(make(5e-3));
  used.solve(cells, second, response);
  used.stiffen(make(7e-3));
  used.solve(cells, second, response);
  used.place_displacements(other);
  fresh.stiffen(make(7e-3));
  fresh.solve(cells, first, response);
  fresh.place_displacements(one);
  EXPECT_EQ(first.forces, second.forces);
  EXPECT_EQ(one, other);
  // And taken away again it is the body as it was prepared.
  used.stiffen(nullptr);
  used.solve(cells, second, response);
  PatchContact untouched(body.sound(), body.touchable(), material);
  untouched.solve(cells, first, response);
  EXPECT_EQ(first.forces, second.forces);
}

TEST(StiffenedContact, PlacesMoveAsTheUpdatedComplianceSays) {
  const ChangedBody& body = block(0.3);
  const auto update = std::make_shared<StiffnessUpdate>(update_stiffness(
      body.changeable(), {body.factors(4.0, ball(kPole, 7e-3)), {}}, body.touchable()));
  const SurfaceCompliance after = body.updated(*update);
  PatchContact contact(body.sound(), body.touchable(), {5e3, 0.3});
  contact.stiffen(update);
  const auto cells = test::plane_cells(kPole, 0.7e-3, 2, 0.0, 0.5e-3);
  contact.anchor(test::plane_cells(kPole + Vec3(9e-3, 0, 0), 1e-3, 0, 0.0, 0.0));
  ContactSolution solution;
  ContactResponse response;
  std::vector<float> places, expected;
  // The third time and later the cells' own columns are put together.
  for (int frame = 0; frame < 20; ++frame) {
    contact.solve(cells, solution, response);
    contact.place_displacements(places);
    place_displacements(after, response, expected);
    float most = 0.0f, error = 0.0f;
    for (std::size_t i = 0; i < places.size(); ++i) {
      most = std::max(most, std::abs(expected[i]));
      error = std::max(error, std::abs(places[i] - expected[i]));
    }
    ASSERT_LT(error, 1e-5f * most) << frame;
  }
}

TEST(StiffenedContact, AnchoredCellsFollowTheUpdate) {
  const ChangedBody& body = block(0.3);
  const auto update = std::make_shared<StiffnessUpdate>(update_stiffness(
      body.changeable(), {body.factors(4.0, ball(kPole, 7e-3)), {}}, body.touchable()));
  auto spring = test::plane_cells(kPole + Vec3(4e-3, 0, 0), 1e-3, 0, 0.0, 0.0);
  spring[0].held = true;
  spring[0].displacement = Vec3(0, 0, 1e-3);
  auto cells = test::plane_cells(kPole, 0.7e-3, 2, 0.0, 0.5e-3);
  cells.push_back(spring[0]);
  PatchContact anchored(body.sound(), body.touchable(), {5e3, 0.3}),
      plain(body.sound(), body.touchable(), {5e3, 0.3});
  anchored.anchor(spring);
  anchored.stiffen(update);
  plain.stiffen(update);
  ContactSolution one, other;
  ContactResponse response;
  anchored.solve(cells, one, response);
  plain.solve(cells, other, response);
  for (std::size_t k = 0; k < cells.size(); ++k)
    EXPECT_LT((one.forces[k] - other.forces[k]).norm(), 1e-3 * other.forces.back().norm());
}

}  // namespace
}  // namespace viscera
