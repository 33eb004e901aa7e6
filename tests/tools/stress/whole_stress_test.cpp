#include <gtest/gtest.h>

#include <filesystem>
#include <sstream>

#include "engine/scene/load_scene.h"
#include "tests/support/paths.h"
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

TEST(WholeStress, AFailureIsToldWithItsCommandAndTheRunFails) {
  std::ostringstream out;
  // Of so many, some are stepped: the first test holds it of the same ones.
  const auto sound = run_whole_stress({.seed = 1, .cases = 8, .fault = true, .quiet = true}, out);
  ASSERT_TRUE(sound) << sound.error().text();
  EXPECT_FALSE(*sound);
  EXPECT_NE(out.str().find("viscera stress --whole --seed 1 --case"), std::string::npos)
      << out.str();
}

}  // namespace
}  // namespace viscera
