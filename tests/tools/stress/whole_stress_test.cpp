#include <gtest/gtest.h>

#include <filesystem>
#include <sstream>

#include "engine/features/touching/touching_balls.h"
#include "engine/scene/load_scene.h"
#include "engine/simulation/world.h"
#include "tests/support/paths.h"
#include "tests/support/small_world.h"
#include "tools/stress/cut_scene.h"
#include "tools/stress/whole_bodies.h"
#include "tools/stress/whole_run.h"
#include "tools/stress/whole_scene.h"

namespace viscera {
namespace {

std::string failures_of(const WholeOutcome& outcome) {
  std::string all = outcome.description;
  for (const std::string& failure : outcome.failures) all += "\n  " + failure;
  return all;
}

TEST(WholeStress, RandomScenesHoldUnderEveryCheckOrAreRefusedWithWhatWasExpected) {
  const test::TemporaryFolder folder;
  int stepped = 0;
  for (int number = 0; number < 8; ++number) {
    const WholeOutcome outcome = run_whole_case({.seed = 1, .number = number}, folder.path());
    EXPECT_TRUE(outcome.passed()) << failures_of(outcome);
    stepped += outcome.refused.empty();
    if (outcome.refused.empty()) continue;
    EXPECT_NE(outcome.refused.find("expected"), std::string::npos) << outcome.refused;
  }
  EXPECT_GE(stepped, 5);
}

TEST(WholeStress, OrgansThatBladesCutAtRandomHoldUnderEveryCheckAndKeepTheirMass) {
  const test::TemporaryFolder folder;
  std::uint64_t bodies = 0;
  for (const int number : {3, 7}) {
    const WholeOutcome outcome =
        run_whole_case({.seed = 1, .number = number, .cuts = true}, folder.path());
    EXPECT_TRUE(outcome.passed()) << failures_of(outcome);
    EXPECT_EQ(outcome.refused, "") << number;
    EXPECT_LT(outcome.mass_residual, 1e-6);
    bodies += outcome.bodies;
  }
  EXPECT_GE(bodies, 3u);
}

TEST(WholeStress, ANumberThatIsNotFiniteIsSeenInEveryCaseThatIsStepped) {
  const test::TemporaryFolder folder;
  for (int number = 0; number < 4; ++number) {
    const WholeOutcome outcome =
        run_whole_case({.seed = 1, .number = number, .fault = true}, folder.path());
    EXPECT_EQ(outcome.passed(), !outcome.refused.empty()) << failures_of(outcome);
  }
}

TEST(WholeStress, ACaseIsTheSameSceneEveryTimeAndNoTwoAreAlike) {
  const test::TemporaryFolder folder;
  const auto text = [&](std::uint64_t seed, int number) {
    const auto scene = write_whole_scene(seed, number, folder.path());
    EXPECT_TRUE(scene) << scene.error().text();
    return test::file_text(scene->file);
  };
  const std::string first = text(7, 3);
  EXPECT_NE(text(7, 4), first);
  EXPECT_NE(text(8, 3), first);
  EXPECT_EQ(text(7, 3), first);
}

TEST(WholeStress, ACaseOfCutsIsTheSameSceneEveryTimeAndNoTwoAreAlike) {
  const test::TemporaryFolder folder;
  const auto text = [&](int number) {
    const auto scene = write_cut_scene(7, number, folder.path());
    EXPECT_TRUE(scene) << scene.error().text();
    return test::file_text(scene->file);
  };
  const std::string first = text(3);
  EXPECT_NE(text(4), first);
  EXPECT_EQ(text(3), first);
}

TEST(WholeStress, AFailureIsToldWithItsCommandAndTheRunFails) {
  std::ostringstream out;
  // Of so many, some are stepped: the first test holds it of the same ones.
  const auto sound = run_whole_stress({.seed = 1, .cases = 8, .fault = true, .quiet = true}, out);
  ASSERT_TRUE(sound) << sound.error().text();
  EXPECT_FALSE(*sound);
  EXPECT_NE(out.str().find("viscera stress --whole --seed 1 --case"), std::string::npos)
      << out.str();
}

TEST(WholeStress, AnOrganThatCameToLieInAnotherIsSeen) {
  auto world = test::build(touching_balls(0.0, Response::kLinear));
  ASSERT_TRUE(world);
  const Insides insides(*world);
  EXPECT_EQ(insides.deepest(*world).depth, 0.0);
  for (Vec3f& position : world->all<OrganState>()[1].positions) position.z() -= 2e-3f;
  const Insides::Deepest found = insides.deepest(*world);
  EXPECT_NEAR(found.depth, 2e-3, 0.2e-3);
  EXPECT_FALSE(found.what.empty());
}

TEST(WholeStress, EnergyThatRisesWithoutAnythingThatMovesIsSeenAndThatWhichFallsIsnt) {
  EnergyWatch falls, rises;
  for (int frame = 0; frame < 10; ++frame) {
    falls.add(static_cast<std::uint64_t>(frame), 1e-3 / (1 + frame));
    rises.add(static_cast<std::uint64_t>(frame), 1e-3 * (frame < 5 ? 1.0 : 1.2));
  }
  EXPECT_FALSE(falls.failure());
  ASSERT_TRUE(rises.failure());
  EXPECT_NE(rises.failure()->find("at frame 5"), std::string::npos) << *rises.failure();
}

TEST(WholeStress, SomeScenesTouchSomeFallAndSomeComeToStandStill) {
  const test::TemporaryFolder folder;
  int touching = 0, falling = 0, still = 0;
  for (int number = 0; number < 40; ++number) {
    const auto scene = write_whole_scene(1, number, folder.path());
    ASSERT_TRUE(scene);
    touching += scene->description.find("organs touch") != std::string::npos;
    falling += scene->description.find("one falls") != std::string::npos;
    still += scene->still_from.has_value();
  }
  EXPECT_GT(touching, 10);
  EXPECT_GT(falling, 1);
  EXPECT_GT(still, 1);
}

}  // namespace
}  // namespace viscera
