// A hand on tissue at finite strain that a jaw has lifted, or is lifting.
#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "engine/features/contact/first_order.h"
#include "engine/features/held_tools/held_tools.h"
#include "engine/simulator/build.h"
#include "engine/simulator/simulation.h"
#include "kernels/contact/finite_contact.h"
#include "tests/support/dense_matrix.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

const Vec3 kUp(-1.0 / 3.0, 0, 1.0), kAlong(1.0, 0, 0);
constexpr double kTip = 4e-3, kThick = 24e-3, kTopOfBar = 0.5 * kThick;

/// A bar that is held at its left end; a jaw takes it near the other and moves it so far within the
/// time that `lifts` names. Second, a probe that is where its keys say.
SceneDescription lifted_scene(const Vec3& way, std::pair<double, double> lifts,
                              std::vector<InstrumentKey> probe, double thick = kThick) {
  const Vec3 bar(80e-3, 24e-3, thick);
  SceneDescription scene =
      held_bar_scene(bar, 3e-3, 20e-3, thick < kThick ? 5e-3 : 7e-3, thick < kThick ? 5e-3 : 6e-3);
  scene.organs[0].response = Response::kFinite;
  scene.duration = 6.0;
  const Vec3 at(0.5 * bar.x() - 10e-3, 0, 0.5 * thick + 2e-3);
  InstrumentDescription jaw = straight_tool("jaw", InstrumentKind::kGrasper, 2e-3,
                                            {{0.0, at, 0.0, 1.0},
                                             {0.1, at, 0.0, 1.0},
                                             {0.15, at, 0.0, 0.0},
                                             {lifts.first, at, 0.0, 0.0},
                                             {lifts.second, at + way, 0.0, 0.0},
                                             {10.0, at + way, 0.0, 0.0}});
  jaw.grip_radius = 5e-3;
  jaw.grip_limit = 100.0;
  scene.instruments = {straight_tool("probe", InstrumentKind::kProbe, kTip, std::move(probe)), jaw};
  return scene;
}

const CellRange& pressed_range(const World& world) {
  return *std::ranges::find_if(world.all<OrganTouch>()[0].ranges,
                               [](const CellRange& range) { return !range.held; });
}

/// A probe and a jaw on a body that has been deformed: how the probe's force grows as it goes
/// deeper, its cells and their directions staying.
class Pressed {
 public:
  Pressed(const OrganModel& model, const TissueContact::State& state,
          std::vector<ContactCell> cells, const CellRange& range, std::vector<Vec3> forces)
      : model_(model),
        tissue_({model.compliance, model.step_compliance, model.touchable, model.places,
                 *model.finite, model.hold_loads},
                model.material),
        cells_(std::move(cells)),
        range_(range) {
    tissue_.restore(state);
    std::vector<Vec3> places;
    Vec3 normal = Vec3::Zero();
    for (std::size_t k = range.begin; k < range.end; ++k) {
      places.push_back(cells_[k].position);
      normal += cells_[k].normal;
      if (forces[k].dot(cells_[k].direction) > 0.0)
        pressed_.push_back(static_cast<Eigen::Index>(k));
    }
    shares_ = FirstOrder(places, normal).shares();
    first_ = static_cast<Eigen::Index>(range.begin);
  }

  /// By what a hand meets: the response of the body at rest, less what is taken off it.
  double slope_met() {
    const auto hold = tissue_.hold_of_others(cells_, range_.begin, range_.end, shares_);
    EXPECT_TRUE(hold);
    MatrixX response = tissue_.cell_response();
    const MatrixX fields = shares_.completeOrthogonalDecomposition().pseudoInverse();
    const Eigen::Index own = shares_.cols();
    if (hold->taken.size() > 0)
      for (Eigen::Index k = 0; k < own; ++k)
        for (Eigen::Index l = 0; l < own; ++l)
          for (Eigen::Index c = 0; c < 3; ++c)
            for (Eigen::Index d = 0; d < 3; ++d)
              response.block<3, 3>(3 * (first_ + k), 3 * (first_ + l)) -=
                  fields(k, c) * fields(l, d) * hold->taken.block<3, 3>(3 * c, 3 * d);
    return slope(response);
  }

  /// By the tangent, put together and factored, with what the jaw holds.
  double slope_exact() {
    const TissueContact::State state = tissue_.state();
    tissue_.hold_of_others(cells_, range_.begin, range_.end, shares_);
    const MatrixX at_rest = tissue_.cell_response();  // turned
    const auto n = static_cast<Eigen::Index>(state.motion.displacements.size()),
               count = static_cast<Eigen::Index>(3 * cells_.size());
    MatrixX loads = MatrixX::Zero(n, count), turned = loads;
    const SparseWeights& fields = model_.places.fields;
    for (std::size_t k = 0; k < cells_.size(); ++k) {
      std::vector<Vec3> forces(cells_.size(), Vec3::Zero());
      forces[k] = Vec3::UnitX();
      ContactSolution solution;
      ContactResponse response;
      tissue_.load(cells_, forces, solution, response);
      for (std::size_t i = 0; i < response.touched.size(); ++i) {
        const auto row = static_cast<std::size_t>(
            model_.touchable.places[static_cast<std::size_t>(response.touched[i])]);
        for (auto e = static_cast<std::size_t>(fields.row_begin[row]);
             e < static_cast<std::size_t>(fields.row_begin[row + 1]); ++e) {
          const Eigen::Index node = fields.nodes[e];
          const double share = response.loads[i].x() * static_cast<double>(fields.values[e]);
          const auto column = static_cast<Eigen::Index>(3 * k);
          loads.block<3, 3>(3 * node, column).diagonal().array() += share;
          turned.block<3, 3>(3 * node, column) +=
              share *
              rotation_of(state.motion.rotations, static_cast<std::size_t>(node)).transpose();
        }
      }
    }
    tissue_.restore(state);
    const FiniteBody& body = model_.finite->body();
    const std::vector<double> rest(static_cast<std::size_t>(n), 0.0);
    const MatrixX nodal = dense(body.tangent(state.motion.displacements)).ldlt().solve(loads),
                  nodal_rest = dense(body.tangent(rest)).ldlt().solve(turned);
    MatrixX response = at_rest - turned.transpose() * nodal_rest + loads.transpose() * nodal;
    std::vector<Eigen::Index> held;
    for (std::size_t k = 0; k < cells_.size(); ++k)
      for (Eigen::Index a = 0; a < 3 && cells_[k].held; ++a)
        held.push_back(static_cast<Eigen::Index>(3 * k) + a);
    const MatrixX mixed = response(Eigen::all, held);
    response -= mixed * MatrixX(response(held, held)).ldlt().solve(mixed.transpose());
    return slope(response);
  }

  /// As if the body weren't strained.
  double slope_at_rest() {
    const TissueContact::State state = tissue_.state();
    TissueContact::State rest = state;
    std::ranges::fill(rest.motion.displacements, 0.0);
    tissue_.restore(rest);
    const double found = slope_met();
    tissue_.restore(state);
    return found;
  }

  std::size_t refused() const { return tissue_.tangents_refused(); }

 private:
  double slope(const MatrixX& response) const {
    const auto n = static_cast<Eigen::Index>(pressed_.size());
    MatrixX matrix(n, n);
    VectorX deeper(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const Eigen::Index k = pressed_[static_cast<std::size_t>(i)];
      const Vec3& way = cells_[static_cast<std::size_t>(k)].direction;
      deeper[i] = -way.z();
      for (Eigen::Index j = 0; j < n; ++j) {
        const Eigen::Index l = pressed_[static_cast<std::size_t>(j)];
        matrix(i, j) = way.dot(response.block<3, 3>(3 * k, 3 * l) *
                               cells_[static_cast<std::size_t>(l)].direction);
      }
    }
    return deeper.dot(matrix.ldlt().solve(deeper));
  }

  const OrganModel& model_;
  FiniteContact tissue_;
  std::vector<ContactCell> cells_;
  CellRange range_;
  std::vector<Eigen::Index> pressed_;
  MatrixX shares_;
  Eigen::Index first_ = 0;
};

/// A probe presses the bar at `x` after the jaw has moved it.
void press_lifted(const Vec3& way, double x, double thick, const auto& ask) {
  SceneDescription scene = lifted_scene(way, {0.2, 1.2}, {{0.0, Vec3(x, 0, 0.1), 0.0, 1.0}}, thick);
  auto lifted = build(scene);
  ASSERT_TRUE(lifted);
  step_until(*lifted, 1.5);
  double top = -1.0;
  for (const Vec3f& p : lifted->all<OrganState>()[0].positions)
    if (std::hypot(p.x() - x, p.y()) < 6e-3) top = std::max(top, static_cast<double>(p.z()));
  const Vec3 down(x, 0, top + kTip - 6e-3);
  scene.instruments[0].path = {{0.0, down + Vec3(0, 0, 40e-3), 0.0, 1.0},
                               {1.3, down + Vec3(0, 0, 10e-3), 0.0, 1.0},
                               {1.7, down, 0.0, 1.0},
                               {5.0, down, 0.0, 1.0}};
  auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 2.2);
  ASSERT_GT(force_on(*world, 0).z(), 5e-3) << x << " " << top;
  const OrganContact& contact = world->all<OrganContact>()[0];
  Pressed pressed(*world->all<OrganBody>()[0].model, world->all<OrganTouch>()[0].solver->state(),
                  contact.cells, pressed_range(*world), contact.solution.forces);
  ask(pressed);
}

TEST(FiniteHand, WhatItMeetsOnALiftedBarIsTheSlopeOfTheForceThere) {
  struct Case {
    Vec3 way;
    double x, thick = kThick;
  };
  for (const auto& [way, x, thick] :
       {Case{kUp * 30e-3, -8e-3}, Case{kUp * 30e-3, 6e-3}, Case{kAlong * -12e-3, 0.0},
        Case{kUp * 30e-3, 0.0, 10e-3}, Case{kAlong * 20e-3, 0.0, 10e-3}})
    press_lifted(way, x, thick, [&, x = x](Pressed& pressed) {
      const double exact = pressed.slope_exact(), at_rest = pressed.slope_at_rest();
      double met = 0.0;
      for (int frame = 0; frame < 3; ++frame) met = pressed.slope_met();
      EXPECT_NEAR(met, exact, 0.02 * exact) << thick << " " << x;
      // A thin one's bending is what strain stiffens.
      EXPECT_TRUE(thick == kThick || at_rest < 0.75 * exact) << at_rest << " of " << exact;
      EXPECT_EQ(pressed.refused(), 0u);
    });
}

/// A held probe at its way, tick by tick.
struct Tick {
  double time = 0.0;
  Vec3 force = Vec3::Zero(), tool = Vec3::Zero();
};
struct Told {
  std::vector<Tick> ticks;
  std::uint64_t violations = 0;
  std::size_t refused = 0;
  double agreement = 0.0;
};
Told run_hand(SceneDescription scene, double until, double settled = 0.0) {
  scene.instruments[0].extras.get<HapticDescription>().grip = HapticDescription::Grip::kFirm;
  Told told;
  auto world = build(scene);
  if (!world) return told;
  if (const auto hand = hold_tools(*world, {}); !hand) {
    ADD_FAILURE() << hand.error().text();
    return told;
  }
  HapticTool& tool = servos_of(*world)->tools().front();
  Trace trace(stage_names());
  while (world->time() < until - 1e-9) {
    const std::uint64_t end = world->model().steps().last_tick(world->frame() + 1);
    while (tool.lockstep->next() < end) {
      tool.lockstep->advance_to(tool.lockstep->next() + 1);
      const ServoOutput& out = tool.servo->output();
      told.ticks.push_back({1e-3 * static_cast<double>(out.tick), out.tissue, out.tool.position});
    }
    step_frame(*world, trace);
    if (world->time() < settled) tool.agreement = {.tip = tool.agreement.tip};
  }
  // From when it stood still.
  told.violations = tool.servo->passivity_violations();
  told.refused =
      dynamic_cast<FiniteContact&>(*world->all<OrganTouch>()[0].solver).tangents_refused();
  told.agreement = tool.agreement.ratio();
  return told;
}

TEST(FiniteHand, FeelsNoStepAsAJawLiftsTheTissueUnderIt) {
  for (const double thick : {kThick, 10e-3}) {
    const auto at = [&](double time, double deep) {
      return InstrumentKey{time, Vec3(0, 0, 0.5 * thick + kTip - deep), 0.0, 1.0};
    };
    const Told told = run_hand(
        lifted_scene(kUp * 20e-3, {1.0, 2.0},
                     {at(0.0, -6e-3), at(0.3, -6e-3), at(0.7, 2e-3), at(9.0, 2e-3)}, thick),
        3.5, 3.2);
    ASSERT_GT(told.ticks.size(), 2000u);
    // Of what is allowed.
    double worst = 0.0, greatest = 0.0;
    for (std::size_t i = 1; i < told.ticks.size(); ++i) {
      if (told.ticks[i].time < 0.9) continue;
      const double step = (told.ticks[i].force - told.ticks[i - 1].force).norm();
      worst = std::max(worst, step / std::max(5e-3, 0.02 * told.ticks[i].force.norm()));
      greatest = std::max(greatest, step);
    }
    std::printf("%.0f mm thick: %.3f N, from the frame %.1f %%, steps of %.2f mN\n", 1e3 * thick,
                told.ticks.back().force.norm(), 100.0 * told.agreement, 1e3 * greatest);
    EXPECT_GT(told.ticks.back().force.norm(), 2.0 * told.ticks[900].force.norm());
    EXPECT_LT(worst, 1.0);
    // Two radii deep.
    EXPECT_LT(told.agreement, thick == kThick ? 0.12 : 0.3);
    EXPECT_EQ(told.violations, 0u);
    EXPECT_EQ(told.refused, 0u);
  }
}

TEST(FiniteHand, ClosedWaysOnALiftedBarGiveTheHandNoEnergy) {
  // In, along, out and back, five times, on tissue that stands lifted.
  const Vec3 on(2e-3, 0, kTopOfBar + kTip + 5.5e-3);
  std::vector<InstrumentKey> way = {{0.0, on + Vec3(0, 0, 20e-3), 0.0, 1.0},
                                    {1.3, on + Vec3(0, 0, 5e-3), 0.0, 1.0}};
  for (int turn = 0; turn < 60; ++turn) {
    const double angle = 2.0 * std::numbers::pi * turn / 12.0;
    way.push_back({1.5 + 0.05 * turn,
                   on + Vec3(3e-3 * std::sin(angle), 0, -1.5e-3 * std::cos(angle) + 0.5e-3), 0.0,
                   1.0});
  }
  way.push_back({4.6, on + Vec3(0, 0, 10e-3), 0.0, 1.0});
  const Told told = run_hand(lifted_scene(kUp * 20e-3, {0.2, 1.0}, way), 4.8);
  double given = 0.0, passed = 0.0;
  for (std::size_t i = 1; i < told.ticks.size(); ++i) {
    const double work = told.ticks[i - 1].force.dot(told.ticks[i].tool - told.ticks[i - 1].tool);
    given += work;
    passed += std::abs(work);
  }
  EXPECT_GT(passed, 1e-4);
  EXPECT_LT(given, 0.01 * passed);
  EXPECT_EQ(told.violations, 0u);
}

SceneDescription pressed_while_lifted() {
  const auto at = [&](double time, double deep) {
    return InstrumentKey{time, Vec3(0, 0, kTopOfBar + kTip - deep), 0.0, 1.0};
  };
  SceneDescription scene = lifted_scene(
      kUp * 15e-3, {0.3, 1.0}, {at(0.0, -6e-3), at(0.3, 2e-3), at(0.8, 3e-3), at(9.0, 2e-3)});
  scene.instruments[0].extras.get<HapticDescription>().grip = HapticDescription::Grip::kFirm;
  return scene;
}

TEST(FiniteHand, FeelsTheSameBitsOnOneThreadAndOnTwo) {
  std::vector<std::vector<Tick>> ticks;
  for (const std::size_t threads : {1, 2}) {
    const oneapi::tbb::global_control limit(oneapi::tbb::global_control::max_allowed_parallelism,
                                            threads);
    ticks.push_back(run_hand(pressed_while_lifted(), 1.0).ticks);
  }
  ASSERT_EQ(ticks[0].size(), ticks[1].size());
  EXPECT_GT(ticks[0].back().force.norm(), 0.05);
  for (std::size_t i = 0; i < ticks[0].size(); ++i)
    ASSERT_EQ(ticks[0][i].force, ticks[1][i].force) << i;
}

TEST(FiniteHand, GoesOnFromASnapshotWithTheSameBits) {
  const Model model = build_shared(pressed_while_lifted());
  auto whole = Simulation::create(model), other = Simulation::create(model);
  ASSERT_TRUE(whole && other);
  const auto step_to = [](Simulation& simulation, std::uint64_t frame) {
    while (simulation.frame() < frame) simulation.step();
  };
  step_to(*whole, 45);
  const auto snapshot = whole->snapshot();
  ASSERT_TRUE(snapshot) << snapshot.error().text();
  step_to(*whole, 55);
  step_to(*other, 30);  // it has lived another life
  ASSERT_TRUE(other->restore(*snapshot));
  step_to(*other, 55);
  EXPECT_EQ(other->hash(), whole->hash()) << other->world().state_difference(whole->world());
}

}  // namespace
}  // namespace viscera::test
