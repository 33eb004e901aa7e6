// What measures is a program of its own, which the user's program starts and doesn't hold.
#include <gtest/gtest.h>

#include <cstdlib>

#include "tests/support/paths.h"
#include "tests/support/program.h"

namespace viscera::test {
namespace fs = std::filesystem;
namespace {

ProgramResult viscera_with(std::vector<std::string> arguments) {
  ProgramCall call;
  call.arguments = std::move(arguments);
  return run_program(call);
}

TEST(MeasuringCommands, StandInTheHelpOfTheUsersProgram) {
  const ProgramResult result = viscera_with({"--help"});
  EXPECT_EQ(result.code, 0) << result.told();
  for (const char* line : {"bench", "measure, with the error beside every speed", "profile",
                           "what a scene's frames cost with more and more organs", "stress",
                           "throw random bodies and tools at the elastic core"})
    EXPECT_NE(result.out.find(line), std::string::npos) << line << '\n' << result.told();
}

TEST(MeasuringCommands, ShowTheirOwnHelp) {
  const ProgramResult bench = viscera_with({"bench", "--help"});
  EXPECT_EQ(bench.code, 0) << bench.told();
  for (const char* word : {"viscera bench", "hemisphere", "convergence", "zwidth"})
    EXPECT_NE(bench.out.find(word), std::string::npos) << word << '\n' << bench.told();
  const ProgramResult stress = viscera_with({"stress", "--help"});
  EXPECT_NE(stress.out.find("--inject-fault"), std::string::npos) << stress.told();
  const ProgramResult profile = viscera_with({"profile", "--help"});
  EXPECT_NE(profile.out.find("--touched"), std::string::npos) << profile.told();
}

TEST(MeasuringCommands, HandOnTheirExitCodes) {
  EXPECT_EQ(viscera_with({"stress", "--seed", "5", "--cases", "1", "--quiet"}).code, 0);
  EXPECT_EQ(viscera_with({"stress", "--cases", "2", "--quiet", "--inject-fault"}).code, 1);
  expect_refused(viscera_with({"bench"}), {"subcommand"});
  expect_refused(viscera_with({"bench", "hemisphere", "--nodes", "many"}), {"--nodes"});
}

TEST(MeasuringCommands, SeeTheEnvironment) {
  setenv("VISCERA_ASSETS", "/nowhere", 1);
  const ProgramResult result =
      viscera_with({"profile", project_file("scenes/sphere_press.json").string()});
  unsetenv("VISCERA_ASSETS");
  expect_refused(result, {"/nowhere"});
}

/// The user's program by itself in a folder.
class ProgramAlone : public testing::Test {
 protected:
  void SetUp() override { fs::copy_file(VISCERA_PROGRAM, folder_ / "viscera"); }
  ProgramResult run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), (folder_ / "viscera").string());
    return run_command(arguments);
  }
  TemporaryFolder folder_;
};

TEST_F(ProgramAlone, SaysWhichProgramItMisses) {
  expect_refused(run({"bench", "convergence", "--quick"}),
                 {(folder_ / "viscera_bench").string(), "found no such program", "tools/setup"});
}

TEST_F(ProgramAlone, StillListsAllCommands) {
  const ProgramResult result = run({"--help"});
  EXPECT_EQ(result.code, 0) << result.told();
  EXPECT_NE(result.out.find("stress"), std::string::npos) << result.told();
}

TEST_F(ProgramAlone, SaysThatWhatStandsThereIsNoProgram) {
  fs::create_directory(folder_ / "viscera_bench");
  expect_refused(run({"stress"}), {(folder_ / "viscera_bench").string(), "can't be started"});
}

TEST(UsersProgram, HoldsNothingThatMeasures) {
  if (run_command({"nm", "--version"}).code != 0) GTEST_SKIP() << "no nm";
  const auto functions_of = [](const fs::path& program) {
    return run_command({"nm", "--demangle", "--defined-only", program.string()}).out;
  };
  const fs::path program = VISCERA_PROGRAM;
  const std::string used = functions_of(program);
  const std::string measures = functions_of(program.parent_path() / "viscera_bench");
  ASSERT_NE(used.find("viscera::run_scene("), std::string::npos);
  for (const char* function :
       {"viscera::run_stress(", "viscera::measure_peers(", "viscera::profile_scene(",
        "viscera::bench_scene(", "viscera::HemisphereBody::", "viscera::shear_decay_error("}) {
    EXPECT_NE(measures.find(function), std::string::npos) << function;
    EXPECT_EQ(used.find(function), std::string::npos) << function;
  }
}

}  // namespace
}  // namespace viscera::test
