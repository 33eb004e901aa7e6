// Organs at finite strain in a scene: lifted, pressed, let go, jerked, saved.
#include "engine/features/finite/finite.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <cmath>

#include "engine/features/deformation/deformation_flags.h"
#include "engine/features/gravity/gravity.h"
#include "engine/features/held_tools/held_tools_keys.h"
#include "engine/organ/finite_parts.h"
#include "engine/organ/reach.h"
#include "engine/simulator/build.h"
#include "engine/simulator/simulation.h"
#include "kernels/contact/finite_contact.h"
#include "tests/support/paths.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

using testing::HasSubstr;

const Vec3 kBar(80e-3, 24e-3, 24e-3);           // edges [m]
constexpr double kHeld = 20e-3;                 // of its left end [m]
constexpr double kClosed = 0.2, kLifted = 1.0;  // [s]
constexpr double kAbove = 1e-3;                 // the jaw closes so far over the bar [m]
constexpr int kConverged = 60;                  // iterations

SceneDescription bar_scene(Response response) {
  SceneDescription scene = held_bar_scene(kBar, 3e-3, kHeld, 7e-3, 6e-3);
  scene.organs[0].response = response;
  scene.duration = 3.0;
  return scene;
}

/// A jaw takes it near the other end, moves so far, and opens at `opens`.
SceneDescription lifted_bar(Response response, const Vec3& way, double opens = 1e3) {
  SceneDescription scene = bar_scene(response);
  const Vec3 above(0.5 * kBar.x() - 10e-3, 0, 0.5 * kBar.z() + kAbove);
  InstrumentDescription grasper =
      straight_tool("grasper", InstrumentKind::kGrasper, 2e-3,
                    {{0.0, above + Vec3(0, 0, 1e-3), 0.0, 1.0},
                     {kClosed - 0.1, above + Vec3(0, 0, 1e-3), 0.0, 1.0},
                     {kClosed, above + Vec3(0, 0, 1e-3), 0.0, 0.0},
                     {kLifted, above + Vec3(0, 0, 1e-3) + way, 0.0, 0.0},
                     {opens, above + Vec3(0, 0, 1e-3) + way, 0.0, 0.0},
                     {opens + 0.05, above + Vec3(0, 0, 30e-3) + way, 0.0, 1.0}});
  grasper.grip_radius = 5e-3;
  grasper.grip_limit = 100.0;
  scene.instruments = {grasper};
  return scene;
}

SceneDescription pressed_bar(Response response, double depth) {
  SceneDescription scene = bar_scene(response);
  const double radius = 5e-3;
  const Vec3 above(-0.5 * kBar.x() + kHeld + 15e-3, 0, 0.5 * kBar.z() + radius);
  scene.instruments = {straight_tool(
      "probe", InstrumentKind::kProbe, radius,
      {{0.0, above + Vec3(0, 0, 2e-3), 0.0, 1.0}, {0.5, above - Vec3(0, 0, depth), 0.0, 1.0}})};
  return scene;
}

TissueContact& tissue_of(World& world) {
  return *world.all<OrganTouch>()[0].solver;
}

const FiniteState& motion_of(World& world) {
  return tissue_of(world).state().motion;
}

double greatest(const std::vector<double>& values) {
  double most = 0.0;
  for (const double value : values) most = std::max(most, std::abs(value));
  return most;
}

std::vector<Vec3> forces_of_lift(SceneDescription scene, int iterations) {
  scene.organs[0].finite.iterations = iterations;
  auto world = build(scene);
  std::vector<Vec3> forces;
  if (!world) return forces;
  while (world->time() < kLifted) {
    step_until(*world, world->time() + 1e-3);
    if (world->time() > kClosed + 0.1) forces.push_back(force_on(*world, 0));
  }
  return forces;
}

TEST(Finite, TwoIterationsAFrameLiftWithinAPercentOfConvergedForces) {
  const SceneDescription scene = lifted_bar(Response::kFinite, Vec3(-10e-3, 0, 30e-3));
  const std::vector<Vec3> few = forces_of_lift(scene, 2), many = forces_of_lift(scene, kConverged);
  ASSERT_EQ(few.size(), many.size());
  ASSERT_GT(few.size(), 30u);
  std::vector<double> errors;
  for (std::size_t i = 0; i < few.size(); ++i)
    errors.push_back((few[i] - many[i]).norm() / many[i].norm());
  std::sort(errors.begin(), errors.end());
  const double p90 = errors[errors.size() * 9 / 10];
  RecordProperty("error_p90", std::to_string(p90));
  EXPECT_LT(p90, 1e-2);
  EXPECT_GT(many.back().norm(), 0.2);
}

TEST(Finite, TheWorkOfAToolIsWhatTissueAndContactHaveStored) {
  SceneDescription scene = pressed_bar(Response::kFinite, 3e-3);
  scene.organs[0].finite = {.quasi_static = true, .viscous_time = 0.0, .iterations = 20};
  auto world = build(scene);
  ASSERT_TRUE(world);
  double work = 0.0, force = 0.0, height = world->all<InstrumentState>()[0].tip.z();
  while (world->time() < 0.5 - 1e-6) {
    step_until(*world, world->time() + 1.0 / 60.0);
    const double now = world->all<InstrumentState>()[0].tip.z();
    const double pushed = force_on(*world, 0).z();
    work += 0.5 * (force + pushed) * (height - now);
    force = pushed;
    height = now;
  }
  const auto& contact = dynamic_cast<const FiniteContact&>(tissue_of(*world));
  FiniteBody::Workspace workspace;
  const double body = world->all<OrganBody>()[0].model->finite->body().energy(
      motion_of(*world).displacements, {}, workspace);
  EXPECT_GT(body, 0.02 * work);
  EXPECT_GT(contact.near_energy(), 0.02 * work);
  EXPECT_NEAR(body + contact.near_energy(), work, 0.03 * work);
}

TEST(Finite, AtEquilibriumTheTissuesForcesAreWhatTheJawPulls) {
  SceneDescription scene = lifted_bar(Response::kFinite, Vec3(-10e-3, 0, 25e-3));
  scene.organs[0].finite = {.quasi_static = true, .viscous_time = 0.0, .iterations = 100};
  auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, kLifted + 0.1);
  const FiniteState& motion = motion_of(*world);
  const OrganModel& model = *world->all<OrganBody>()[0].model;
  std::vector<double> gradient(motion.displacements.size(), 0.0);
  FiniteBody::Workspace workspace;
  const double energy = model.finite->body().energy(motion.displacements, gradient, workspace);
  std::vector<double> missing(gradient.size());
  Vec3 pull = Vec3::Zero();
  for (std::size_t i = 0; i < gradient.size(); ++i) {
    missing[i] = gradient[i] - motion.loads[i];
    pull[static_cast<Eigen::Index>(i % 3)] += motion.loads[i];
  }
  // A step ends where a further iteration would gain less than 2e-6 of the energy, and an iteration
  // gains at least half of what there is to gain, which the exact stiffness tells.
  const SymmetricBlockMatrix stiffness = model.finite->body().tangent(motion.displacements);
  const auto factor = StiffnessFactor::factor(stiffness, model.cloud.positions);
  ASSERT_TRUE(factor) << factor.error().text();
  std::vector<double> moved = missing;
  ASSERT_TRUE(factor->solve(stiffness, moved, 1));
  double gain = 0.0;
  for (std::size_t i = 0; i < missing.size(); ++i) gain += 0.5 * missing[i] * moved[i];
  EXPECT_GT(energy, 1e-4);
  EXPECT_GT(gain, 0.0);
  EXPECT_LT(gain, 2.0 * 2e-6 * energy);
  EXPECT_LT((pull + force_on(*world, 0)).norm(), 1e-6 * pull.norm()) << "the jaw feels them";
  // And it holds the tissue where it wants it.
  const OrganContact& contact = world->all<OrganContact>()[0];
  for (std::size_t k = 0; k < contact.cells.size(); ++k)
    EXPECT_LT((tissue_of(*world).cell_displacements()[k] - contact.cells[k].displacement).norm(),
              2e-5);
}

TEST(Finite, LiftedByAFractionOfAMillimetreItPullsAsLinearTissue) {
  const Vec3 way(0, 0, 0.05e-3);
  SceneDescription finite = lifted_bar(Response::kFinite, way);
  finite.organs[0].finite = {.quasi_static = true, .viscous_time = 0.0, .iterations = 100};
  auto one = build(finite), other = build(lifted_bar(Response::kLinear, way));
  ASSERT_TRUE(one && other);
  step_until(*one, kLifted + 0.1);
  step_until(*other, kLifted + 0.1);
  const Vec3 pull = force_on(*one, 0), linear = force_on(*other, 0);
  // On this coarse bar the linear body's further quadrature points make .4 %.
  EXPECT_LT((pull - linear).norm(), 5e-3 * linear.norm())
      << pull.transpose() << " | " << linear.transpose();
}

TEST(Finite, APressedBarPushesBackAsLinearTissueWhereItIsPressedLittle) {
  SceneDescription finite = pressed_bar(Response::kFinite, 0.3e-3);
  auto one = build(finite), other = build(pressed_bar(Response::kLinear, 0.3e-3));
  ASSERT_TRUE(one && other);
  step_until(*one, 1.5);
  step_until(*other, 1.5);
  const Vec3 push = force_on(*one, 0), linear = force_on(*other, 0);
  EXPECT_GT(linear.norm(), 5e-3);
  EXPECT_LT((push - linear).norm(), 0.03 * linear.norm())
      << push.transpose() << " | " << linear.transpose();
}

TEST(Finite, NoToolSinksIntoATissueThatIsPressedDeep) {
  auto world = build(pressed_bar(Response::kFinite, 8e-3));
  ASSERT_TRUE(world);
  FlagSet flags;
  double deepest = 0.0;
  while (world->time() < 1.0) {
    flags.raise(step_until(*world, world->time() + 1e-3));
    const ContactSolution& solution = world->all<OrganContact>()[0].solution;
    if (!solution.forces.empty()) deepest = std::max(deepest, solution.violation);
  }
  EXPECT_LT(deepest, 0.1e-3);
  EXPECT_FALSE(flags.has(kTissueLost));
  EXPECT_FALSE(flags.has(kContactNotConverged));
  EXPECT_GT(force_on(*world, 0).z(), 0.1);
}

TEST(Finite, LetGoABarSwingsBackAndComesToRest) {
  auto world = build(lifted_bar(Response::kFinite, Vec3(0, 0, 20e-3), 1.2));
  ASSERT_TRUE(world);
  step_until(*world, 1.2);
  const double lifted = greatest(motion_of(*world).displacements);
  EXPECT_GT(lifted, 15e-3);
  const auto holds = [&] { return world->all<InstrumentContact>()[0].grasp.has_value(); };
  while (holds()) step_until(*world, world->time() + 1e-3);
  EXPECT_GT(greatest(motion_of(*world).displacements), 0.3 * lifted)
      << "tissue has mass: it doesn't snap back in a frame";
  EXPECT_FALSE(step_until(*world, 6.0).has(kTissueLost));
  EXPECT_FALSE(tissue_of(*world).moving());
  EXPECT_FALSE(world->all<OrganState>()[0].deformed);
  EXPECT_EQ(world->all<OrganState>()[0].positions,
            world->all<OrganBody>()[0].model->rest_positions);
}

TEST(Finite, JerksOfFiveCentimetresAFrameLeaveNoStateBehind) {
  SceneDescription scene = lifted_bar(Response::kFinite, Vec3::Zero());
  InstrumentDescription& grasper = scene.instruments[0];
  const Vec3 at = grasper.path[2].tip;
  grasper.path.resize(3);
  std::uint32_t draw = 12345;
  const auto random = [&] {
    draw = draw * 1664525u + 1013904223u;
    return 2.0 * draw / 4294967296.0 - 1.0;
  };
  for (int jerk = 0; jerk < 30; ++jerk)
    grasper.path.push_back({kClosed + 0.05 + jerk / 60.0,
                            at + 50e-3 * Vec3(random(), random(), random()) / 1.8, 0.0, 0.0});
  const double end = grasper.path.back().time;
  grasper.path.push_back({end + 0.02, at + Vec3(0, 0, 60e-3), 0.0, 1.0});
  auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, end + 5.0);
  EXPECT_LT(greatest(motion_of(*world).displacements), 0.5e-3);
  EXPECT_FALSE(world->all<OrganState>()[0].frozen);
}

TEST(Finite, UnderALittleMoreWeightItSagsAsLinearTissue) {
  const auto tilted = [](Response response) {
    SceneDescription scene = bar_scene(response);
    scene.organs[0].youngs_modulus = 200e3;
    scene.extras.get<GravityDescription>().table = {{0.0, 0.0, 0.0}, {0.5, 0.3, 0.0}};
    return scene;
  };
  auto one = build(tilted(Response::kFinite)), other = build(tilted(Response::kLinear));
  ASSERT_TRUE(one && other);
  step_until(*one, 2.0);
  step_until(*other, 2.0);
  const std::vector<float>&sags = one->all<OrganState>()[0].displacements,
        &linear = other->all<OrganState>()[0].displacements;
  ASSERT_EQ(sags.size(), linear.size());
  float apart = 0.0f, scale = 0.0f;
  for (std::size_t i = 0; i < sags.size(); ++i) {
    apart = std::max(apart, std::abs(sags[i] - linear[i]));
    scale = std::max(scale, std::abs(linear[i]));
  }
  EXPECT_GT(scale, 10e-6f);
  EXPECT_LT(apart, 0.03f * scale);
}

Model make_lift_model(const std::vector<PronyTerm>& prony) {
  SceneDescription scene = lifted_bar(Response::kFinite, Vec3(0, 5e-3, 20e-3), 1.1);
  scene.organs[0].material.prony = prony;
  return build_shared(scene);
}

Simulation lift_simulation(bool relaxes = false) {
  static const Model model = make_lift_model({});
  static const Model relaxing = make_lift_model({{0.3, 0.2}, {0.2, 2.0}});
  auto made = Simulation::create(relaxes ? relaxing : model);
  EXPECT_TRUE(made) << made.error().text();
  return *std::move(made);
}

void step_to(Simulation& simulation, std::uint64_t frame) {
  while (simulation.frame() < frame) simulation.step();
}

class FiniteSnapshot : public testing::TestWithParam<bool> {};

TEST_P(FiniteSnapshot, GoesOnWithTheSameBits) {
  Simulation whole = lift_simulation(GetParam());
  std::vector<Snapshot> snapshots;
  for (const std::uint64_t frame : {5, 13, 30, 50, 68}) {
    step_to(whole, frame);
    auto snapshot = whole.snapshot();
    ASSERT_TRUE(snapshot) << snapshot.error().text();
    snapshots.push_back(*snapshot);
  }
  step_to(whole, 75);
  const std::string end = whole.hash();
  Simulation other = lift_simulation(GetParam());
  step_to(other, 21);  // it has lived another life
  for (const std::size_t i : {3, 0, 4, 1, 2}) {
    ASSERT_TRUE(other.restore(snapshots[i]));
    step_to(other, 75);
    EXPECT_EQ(other.hash(), end) << i << ": " << other.world().state_difference(whole.world());
  }
}

INSTANTIATE_TEST_SUITE_P(Relaxes, FiniteSnapshot, testing::Bool());

TEST(Finite, HasTheSameBitsOnOneThreadAndOnTwo) {
  std::vector<std::string> hashes;
  for (const std::size_t threads : {1, 2}) {
    const oneapi::tbb::global_control limit(oneapi::tbb::global_control::max_allowed_parallelism,
                                            threads);
    Simulation simulation = lift_simulation(true);
    step_to(simulation, 40);
    hashes.push_back(simulation.hash());
  }
  EXPECT_EQ(hashes[0], hashes[1]);
}

/// All of the bar.
PartDescription whole_bar(std::optional<double> modulus, std::optional<double> density = {}) {
  Region region;
  region.shape = Region::Shape::kBox;
  region.a = -kBar;
  region.b = kBar;
  return {region, modulus, density};
}

TEST(FiniteParts, APartThatIsAllOfABarIsTheBarOfItsModulus) {
  SceneDescription scene = lifted_bar(Response::kFinite, Vec3(0, 0, 15e-3));
  scene.organs[0].youngs_modulus = 30e3;
  const std::vector<Vec3> whole = forces_of_lift(scene, 2);
  scene.organs[0].youngs_modulus = 10e3;
  scene.organs[0].parts = {whole_bar(30e3)};
  const std::vector<Vec3> part = forces_of_lift(scene, 2);
  ASSERT_EQ(whole.size(), part.size());
  ASSERT_FALSE(whole.empty());
  for (std::size_t i = 0; i < whole.size(); ++i)
    EXPECT_LT((whole[i] - part[i]).norm(), 1e-4 * whole[i].norm()) << i;
}

TEST(FiniteParts, AStiffCoreIsLiftedHarderAndAsItsEnergySays) {
  SceneDescription scene = lifted_bar(Response::kFinite, Vec3(0, 0, 1e-3));
  const double plain = forces_of_lift(scene, 4).back().norm();
  PartDescription core = whole_bar(100e3);
  std::get<Region>(core.where).a = Vec3(-kBar.x(), -6e-3, -6e-3);
  std::get<Region>(core.where).b = Vec3(kBar.x(), 6e-3, 6e-3);
  scene.organs[0].parts = {core};
  scene.organs[0].finite.quasi_static = true;
  const double finite = forces_of_lift(scene, 20).back().norm();
  scene.organs[0].response = Response::kLinear;
  const double linear = forces_of_lift(scene, 20).back().norm();
  EXPECT_GT(finite, 1.2 * plain);
  EXPECT_NEAR(finite, linear, 0.06 * linear);
}

TEST(FiniteAuto, AsksForItWhereWhatActsStrainsTissueFar) {
  const auto is_finite = [](const SceneDescription& scene) {
    const auto world = build(scene);
    return world && world->all<OrganBody>()[0].model->finite;
  };
  const SceneDescription pressed = pressed_bar(Response::kAuto, 3e-3);
  EXPECT_FALSE(is_finite(pressed));
  EXPECT_TRUE(is_finite(pressed_bar(Response::kAuto, kDeepPush + 0.5e-3)));
  EXPECT_TRUE(is_finite(lifted_bar(Response::kAuto, Vec3(0, 0, 10e-3))));
  SceneDescription scene = pressed;
  scene.organs[0].material.prony = {{0.3, 0.1}};
  EXPECT_TRUE(is_finite(scene)) << "linear tissue relaxes for hands alone";
  scene = pressed;
  scene.organs[0].material.model = HyperelasticModel::kNeoHookean;
  EXPECT_TRUE(is_finite(scene));
  scene = pressed;
  scene.extras.get<GravityDescription>().table = {{0.0, 0.0, 0.0}, {0.5, 0.3, 0.0}};
  EXPECT_TRUE(is_finite(scene)) << "it sags";
  scene = pressed;
  scene.instruments[0].kind = InstrumentKind::kHook;
  EXPECT_FALSE(is_finite(scene)) << "no current";
  for (InstrumentKey& key : scene.instruments[0].path) key.power = 20.0;
  EXPECT_TRUE(is_finite(scene)) << "it coagulates";
  scene.organs[0].displacement_storage = DisplacementStorage::kHalf;
  EXPECT_FALSE(is_finite(scene)) << "it can't be at finite strain";
}

TEST(Finite, WhatItCantCarryYetIsRefusedByName) {
  const auto refused = [](SceneDescription scene, const std::string& why) {
    std::vector<std::string> warnings;
    const auto world = build_world(scene, test_tissues(), {project_file("assets"), false},
                                   no_progress(), warnings);
    ASSERT_FALSE(world) << why;
    EXPECT_THAT(world.error().text(), HasSubstr(why));
  };
  const SceneDescription sound = lifted_bar(Response::kFinite, Vec3(0, 0, 5e-3));
  SceneDescription scene = sound;
  scene.organs[0].material.model = HyperelasticModel::kStvk;
  refused(scene, "material/model: found stvk with response finite, expected neo_hookean");
  scene = sound;
  scene.organs[0].formulation = "gfdm";
  refused(scene, "formulation: found gfdm with response finite, expected galerkin");
  scene = sound;
  scene.organs[0].displacement_storage = DisplacementStorage::kHalf;
  refused(scene, "displacement_storage: found half with response finite");
}

/// The force on the tool after each frame.
std::vector<double> forces_of(SceneDescription scene, const std::vector<PronyTerm>& prony,
                              double end) {
  scene.organs[0].material.prony = prony;
  scene.organs[0].finite.viscous_time = 0.0;
  auto world = build(scene);
  std::vector<double> forces;
  if (!world) return forces;
  while (world->time() < end) {
    step_until(*world, world->time() + 1e-3);
    forces.push_back(force_on(*world, 0).norm());
  }
  return forces;
}

TEST(FiniteRelaxing, APressedBarPushesBackByTheSeriesThatAHandFeels) {
  SceneDescription scene = pressed_bar(Response::kFinite, 1.5e-3);
  scene.organs[0].finite = {.quasi_static = true, .iterations = 40};  // it doesn't swing
  const std::vector<PronyTerm> series = {{0.3, 0.15}, {0.2, 1.0}};
  const std::vector<double> elastic = forces_of(scene, {}, 2.0),
                            relaxing = forces_of(scene, series, 2.0);
  ASSERT_EQ(relaxing.size(), elastic.size());
  PronyForce felt(series);
  double most = 0.0, least = 10.0;
  for (std::size_t i = 0; i < elastic.size(); ++i) {
    const double expected = felt.update(elastic[i], 1.0 / 60.0);
    if (i < 25) continue;  // cells come to it one by one
    EXPECT_NEAR(relaxing[i], expected, 0.005 * expected) << i;
    most = std::max(most, relaxing[i] / elastic[i]);
    least = std::min(least, relaxing[i] / elastic[i]);
  }
  EXPECT_GT(most, 1.4);
  EXPECT_LT(least, 1.2);
}

TEST(FiniteRelaxing, ALiftedBarComesToPullAsOneThatDoesntRelax) {
  const SceneDescription scene = lifted_bar(Response::kFinite, Vec3(-10e-3, 0, 20e-3));
  const std::vector<double> elastic = forces_of(scene, {}, 2.5),
                            relaxing = forces_of(scene, {{0.5, 0.15}}, 2.5);
  ASSERT_EQ(relaxing.size(), elastic.size());
  EXPECT_GT(relaxing[59], 1.1 * elastic[59]);
  EXPECT_NEAR(relaxing.back(), elastic.back(), 0.01 * elastic.back());
}

TEST(FiniteRelaxing, ABodyAtRestHasNothingToRemember) {
  const auto relaxing = [](SceneDescription scene) {
    scene.organs[0].material.prony = {{0.3, 0.05}};
    return build(scene);
  };
  auto untouched = relaxing(pressed_bar(Response::kFinite, 1e-3));
  auto world = relaxing(lifted_bar(Response::kFinite, Vec3(0, 0, 2e-3), 1.1));
  ASSERT_TRUE(untouched && world);
  step_until(*untouched, 0.1);
  EXPECT_TRUE(tissue_of(*untouched).state().memory.empty());
  step_until(*world, 1.0);
  EXPECT_FALSE(tissue_of(*world).state().memory.empty());
  EXPECT_FALSE(tissue_of(*world).state().remembered.empty());
  step_until(*world, 3.0);
  EXPECT_EQ(greatest(motion_of(*world).displacements), 0.0);
  EXPECT_TRUE(tissue_of(*world).state().memory.empty()) << "it came to rest";
  EXPECT_TRUE(tissue_of(*world).state().remembered.empty());
}

bool is_at_finite_strain(const SceneDescription& scene) {
  const auto world = build(scene);
  return world && world->all<OrganBody>()[0].model->finite;
}

TEST(AutoResponse, PutsAtFiniteStrainWhatAJawMayHoldAndNothingElse) {
  const SceneDescription held = lifted_bar(Response::kAuto, Vec3(0, 0, 5e-3));
  EXPECT_TRUE(is_at_finite_strain(held));
  SceneDescription missed = held;
  for (InstrumentKey& key : missed.instruments[0].path) key.tip += Vec3(0, 0, 12e-3);
  EXPECT_FALSE(is_at_finite_strain(missed));
  SceneDescription open = held;
  for (InstrumentKey& key : open.instruments[0].path) key.jaw = 1.0;
  EXPECT_FALSE(is_at_finite_strain(open));
  EXPECT_FALSE(is_at_finite_strain(pressed_bar(Response::kAuto, 2e-3)));
  missed.instruments[0].extras.set(HapticDescription{});
  EXPECT_TRUE(is_at_finite_strain(missed)) << "a hand may close the jaw anywhere";
}

TEST(AutoResponse, LeavesLinearWhatFiniteStrainDoesntKnowYet) {
  const SceneDescription sound = lifted_bar(Response::kAuto, Vec3(0, 0, 5e-3));
  SceneDescription scene = sound;
  scene.organs[0].displacement_storage = DisplacementStorage::kHalf;
  EXPECT_FALSE(is_at_finite_strain(scene));
}

TEST(Finite, TheGuardOfMemoryKnowsWhatABodyTakes) {
  const auto world = build(lifted_bar(Response::kFinite, Vec3(0, 0, 10e-3)));
  ASSERT_TRUE(world);
  const FiniteSolver& solver = *world->all<OrganBody>()[0].model->finite;
  const std::size_t expected =
      finite_bytes(solver.body().nodes(), solver.factor()->factor_bytes() / sizeof(float));
  EXPECT_LE(solver.memory_bytes(), expected);
  EXPECT_GT(2 * solver.memory_bytes(), expected);
}

}  // namespace
}  // namespace viscera::test
