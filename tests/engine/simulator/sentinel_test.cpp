#include "engine/simulation/sentinel.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <map>
#include <set>
#include <string>

#include "engine/features/cautery/cautery.h"
#include "engine/features/coagulation/coagulation.h"
#include "engine/features/deformation/deformation_flags.h"
#include "engine/features/features.h"
#include "engine/features/gas/gas.h"
#include "engine/features/gravity/gravity.h"
#include "engine/features/links/links.h"
#include "engine/features/pulsation/pulsation.h"
#include "engine/features/smoke/smoke.h"
#include "engine/simulator/build.h"
#include "tests/engine/simulator/busy_scene.h"
#include "tests/support/small_world.h"

namespace viscera {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr float kNanf = std::numeric_limits<float>::quiet_NaN();

/// Stepped so far that tissue burns, has coagulated, is held, and that smoke is in the air.
constexpr std::uint64_t kFrames = 40;

std::unique_ptr<World> busy_world() {
  auto world = start_world(test::busy_model().scene());
  EXPECT_TRUE(world) << world.error().text();
  Trace trace(stage_names());
  while ((*world)->frame() < kFrames) step_frame(**world, trace);
  return *std::move(world);
}

/// How each type of state is spoilt in one of its owners, who is returned.
using Spoil = std::function<Entity(World&)>;

template <class T, class Change>
Spoil spoil(Change change) {
  return [change](World& world) {
    Pool<T>& pool = world.all<T>();
    EXPECT_GT(pool.size(), 0u) << T::kName;
    change(pool[0]);
    return pool.owner(0);
  };
}

const std::map<std::string_view, Spoil>& spoils() {
  static const std::map<std::string_view, Spoil> all{
      {OrganPose::kName, spoil<OrganPose>([](OrganPose& s) { s.pose.position.x() = kNan; })},
      {OrganState::kName,
       spoil<OrganState>([](OrganState& s) { s.positions[5].y() = s.displacements[4] = kNanf; })},
      {FreeShape::kName, spoil<FreeShape>([](FreeShape& s) { s.places[7] = kNanf; })},
      {OrganTouch::kName, spoil<OrganTouch>([](OrganTouch& s) {
         if (!s.ranges.empty()) s.ranges[0].centre.x() = kNan;
         s.bounds.min().x() = kNan;
       })},
      {InstrumentState::kName,
       spoil<InstrumentState>([](InstrumentState& s) { s.shaft_direction.y() = kNan; })},
      {InstrumentContact::kName,
       [](World& world) {
         for (std::size_t i = 0; i < world.all<InstrumentContact>().size(); ++i) {
           InstrumentContact& contact = world.all<InstrumentContact>()[i];
           if (!contact.grasp) continue;
           contact.force.x() = contact.grasp->slipped.y() = kNan;
           return world.all<InstrumentContact>().owner(i);
         }
         ADD_FAILURE() << "expected a closed jaw";
         return Entity();
       }},
      {OrganBurn::kName,
       [](World& world) {
         for (std::size_t i = 0; i < world.all<OrganBurn>().size(); ++i) {
           Bioheat& heat = world.all<OrganBurn>()[i].heat;
           if (heat.bricks().count() == 0 || !heat.bricks().brick(0).warm) continue;
           heat.bricks().brick(0).warm->excess[3] = kNanf;
           return world.all<OrganBurn>().owner(i);
         }
         ADD_FAILURE() << "expected warm tissue";
         return Entity();
       }},
      {BurnTrace::kName, spoil<BurnTrace>([](BurnTrace& s) { s.book.generated = kNan; })},
      {OrganChange::kName, spoil<OrganChange>([](OrganChange& s) { s.stiffened = kNan; })},
      {GasBody::kName, spoil<GasBody>([](GasBody& s) {
         GasGrid::State state = s.grid->state();
         state.potential.at(11) = kNanf;
         s.grid->restore(std::move(state));
       })},
      {OrganSag::kName, spoil<OrganSag>([](OrganSag& s) { s.change.z() = kNan; })},
      {LinkState::kName, spoil<LinkState>([](LinkState& s) { s.springs[0].force.x() = kNan; })},
      {Pulse::kName, spoil<Pulse>([](Pulse& s) { s.strain = kNan; })},
      {SmokeBody::kName, spoil<SmokeBody>([](SmokeBody& s) {
         SmokeVolume::State state = s.volume.state();
         state.particles.positions.at(1).x = kNanf;
         state.particles.velocities.at(4).w = kNanf;
         s.volume.restore(std::move(state));
       })},
      {SmokeTools::kName, spoil<SmokeTools>([](SmokeTools& s) { s.tools[0].radius = kNan; })},
  };
  return all;
}

bool is_finite(const World& world) {
  for (const StateType& type : world.state_types())
    if (type.strays.become != Strays::Become::kUnwatched &&
        !type.first_strays(world.states_of(type)).empty())
      return false;
  return true;
}

TEST(Sentinel, NamesContainsAndFlagsWhateverIsNotFiniteAndTheWorldGoesOn) {
  for (const Stage& stage : step_schedule().stages())
    for (const std::string_view name : stage.changes) {
      const auto spoiler = spoils().find(name);
      if (spoiler == spoils().end()) continue;  // of a scene that this isn't
      SCOPED_TRACE(std::string(stage.name) + ", " + std::string(name));
      const std::unique_ptr<World> world = busy_world();
      Sentinel sentinel;
      sentinel.keep(*world);
      const Entity owner = spoiler->second(*world);
      ASSERT_FALSE(is_finite(*world));
      FrameReport report;
      sentinel.look(*world, stage, report);
      EXPECT_TRUE(is_finite(*world));
      EXPECT_TRUE(report.flags.has(kNotFinite));
      ASSERT_EQ(report.strays.size(), 1u);
      EXPECT_TRUE(report.strays[0].starts_with(std::string(stage.name) + ": " + std::string(name)))
          << report.strays[0];
      EXPECT_NE(report.strays[0].find("nan"), std::string::npos) << report.strays[0];
      const OrganBody* organ = world->find<OrganBody>(owner);
      const std::string its_name = organ ? organ->name : "of ";
      EXPECT_NE(report.strays[0].find(its_name), std::string::npos) << report.strays[0];

      Trace trace(stage_names());
      for (int frame = 0; frame < 3; ++frame) {
        const FrameReport later = step_frame(*world, trace);
        EXPECT_TRUE(later.strays.empty()) << later.strays.front();
        EXPECT_TRUE(is_finite(*world));
      }
    }
}

TEST(Sentinel, EveryStateOfEveryFeatureIsWatchedAfterSomeStageOrSaysWhoDoes) {
  std::set<std::string_view> watched, states;
  for (const Stage& stage : step_schedule().stages())
    watched.insert(stage.changes.begin(), stage.changes.end());
  for (const Feature& feature : all_features())
    for (const StateType& type : feature.states) {
      states.insert(type.name);
      EXPECT_TRUE(watched.contains(type.name)) << type.name;
    }
  for (const std::string_view name : watched) EXPECT_TRUE(states.contains(name)) << name;
}

/// The states that a stage changed, by their hashes.
std::set<std::string_view> changed_by(const Stage& stage, World& world,
                                      const FrameContext& context) {
  const auto hashes = [&] {
    std::map<std::string_view, std::string> all;
    for (const StateType& type : world.state_types()) {
      Hasher hasher;
      type.hash(world.states_of(type), hasher);
      all[type.name] = hasher.hex();
    }
    return all;
  };
  const auto before = hashes();
  stage.run(world, context);
  std::set<std::string_view> changed;
  for (const auto& [name, hash] : hashes())
    if (before.at(name) != hash) changed.insert(name);
  return changed;
}

TEST(Sentinel, StagesSayWhichStatesTheyChange) {
  auto world = start_world(test::busy_model().scene());
  ASSERT_TRUE(world);
  std::set<std::string_view> seen;
  for (std::uint64_t frame = 1; frame <= kFrames; ++frame) {
    FrameReport report;
    Aside aside;
    const Controls controls = controls_of_paths(**world, end_of_step(**world));
    FrameContext context{.frame = frame,
                         .time = end_of_step(**world),
                         .dt = end_of_step(**world) - (*world)->time(),
                         .report = &report,
                         .controls = &controls,
                         .aside = &aside};
    for (const Stage& stage : step_schedule().stages()) {
      if (stage.needed && !stage.needed(**world)) continue;
      for (const std::string_view name : changed_by(stage, **world, context)) {
        seen.insert(name);
        EXPECT_NE(std::ranges::find(stage.changes, name), stage.changes.end())
            << stage.name << " changes " << name << ", frame " << frame;
      }
    }
    (*world)->set_clock({StepRate().last_tick(frame), frame});
  }
  EXPECT_GE(seen.size(), 14u) << "the scene has nearly every feature";
}

TEST(Sentinel, ASoundRunHasNothingToTell) {
  auto world = start_world(test::busy_model().scene());
  ASSERT_TRUE(world);
  Trace trace(stage_names());
  while ((*world)->frame() < kFrames) {
    const FrameReport report = step_frame(**world, trace);
    EXPECT_TRUE(report.strays.empty()) << report.strays.front();
  }
}

TEST(Sentinel, AnOrganWhoseShapeIsNotFiniteIsFrozenWithItsFlag) {
  const std::unique_ptr<World> world = busy_world();
  Sentinel sentinel;
  FrameReport report;
  const Entity organ = spoils().at(OrganState::kName)(*world);
  sentinel.keep(*world);
  for (const Stage& stage : step_schedule().stages())
    if (stage.name == "deform organs") sentinel.look(*world, stage, report);
  EXPECT_TRUE(world->find<OrganState>(organ)->frozen);
  Trace trace(stage_names());
  EXPECT_TRUE(step_frame(*world, trace).flags.has(kOrganFrozen));
}

TEST(Sentinel, SmokeThatIsNotFiniteJoinsTheBackgroundAndItsMassIsKept) {
  const std::unique_ptr<World> world = busy_world();
  const Entity volume = spoils().at(SmokeBody::kName)(*world);
  SmokeVolume& smoke = world->find<SmokeBody>(volume)->volume;
  const std::size_t particles = smoke.particles().size();
  const double owed = smoke.book().owed_airborne();
  smoke.end_strays();
  EXPECT_EQ(smoke.particles().size(), particles - 2);
  EXPECT_LT(smoke.book().owed_airborne(), owed);
  EXPECT_NEAR(smoke.airborne(), smoke.book().owed_airborne(), 1e-6 * owed);
}

}  // namespace
}  // namespace viscera
