// `viscera stress` from end to end: exit codes, the replay command, Ctrl-C.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/support/paths.h"
#include "tests/support/program.h"

namespace viscera::test {
namespace fs = std::filesystem;
namespace {

ProgramResult stress(std::vector<std::string> arguments) {
  ProgramCall call;
  call.arguments = std::move(arguments);
  call.arguments.insert(call.arguments.begin(), "stress");
  return run_program(call);
}

std::vector<std::string> words_of(const std::string& command) {
  std::istringstream text(command);
  std::vector<std::string> words;
  for (std::string word; text >> word;) words.push_back(word);
  return words;
}

TEST(StressCommand, FewCasesPassAndTheSummaryCountsThem) {
  const TemporaryFolder folder;
  const fs::path file = folder / "stress.json";
  const ProgramResult result =
      stress({"--seed", "5", "--cases", "12", "--quiet", "--json", file.string()});
  EXPECT_EQ(result.code, 0) << result.told();
  const nlohmann::json summary = nlohmann::json::parse(file_text(file));
  EXPECT_EQ(summary["cases"], 12);
  EXPECT_EQ(summary["failed"], 0);
  EXPECT_EQ(summary["passed"].get<int>() + summary["refused"].get<int>(), 12);
  EXPECT_EQ(summary["kinds"].size(), 12u);
  EXPECT_GE(summary["worst"].size(), 8u);
  for (const auto& refusal : summary["refusals"]) EXPECT_NE(refusal["reason"], "");
}

TEST(StressCommand, InjectedFaultFailsAndItsReplayGivesTheSameFigures) {
  const TemporaryFolder folder;
  const fs::path file = folder / "fault.json", again = folder / "fault_again.json";
  const ProgramResult result =
      stress({"--cases", "3", "--quiet", "--inject-fault", "--json", file.string()});
  EXPECT_EQ(result.code, 1) << result.told();
  const nlohmann::json failure = nlohmann::json::parse(file_text(file))["failures"].at(0);
  const std::string command = failure["replay"];
  EXPECT_NE(result.out.find(command), std::string::npos) << result.told();

  std::vector<std::string> words = words_of(command);
  ASSERT_GE(words.size(), 2u);
  EXPECT_EQ(words[0], "viscera");
  EXPECT_EQ(words[1], "stress");
  words.erase(words.begin(), words.begin() + 2);
  words.insert(words.end(), {"--json", again.string()});
  const ProgramResult replay = stress(words);
  EXPECT_EQ(replay.code, 1) << replay.told();
  EXPECT_EQ(nlohmann::json::parse(file_text(again))["failures"].at(0), failure);
}

TEST(StressCommand, FlippedForceFails) {
  const ProgramResult result = stress({"--cases", "3", "--quiet", "--inject-fault", "force"});
  EXPECT_EQ(result.code, 1) << result.told();
  EXPECT_NE(result.out.find("--inject-fault force"), std::string::npos) << result.told();
}

TEST(StressCommand, BadArgumentsAreRefused) {
  for (const std::vector<std::string>& arguments :
       std::vector<std::vector<std::string>>{{"--cases", "0"},
                                             {"--cases", "many"},
                                             {"--case", "-1"},
                                             {"--seed", "-3"},
                                             {"--inject-fault", "everything"},
                                             {"--threads", "-1"},
                                             {"--speed", "9"}}) {
    const ProgramResult result = stress(arguments);
    EXPECT_EQ(result.code, 2) << result.told();
    EXPECT_NE(result.err, "") << arguments[0];
  }
}

TEST(StressCommand, SummaryThatCannotBeWrittenIsRefused) {
  const ProgramResult result =
      stress({"--cases", "1", "--quiet", "--json", "/nowhere/at/all.json"});
  EXPECT_EQ(result.code, 2) << result.told();
  EXPECT_NE(result.err.find("/nowhere/at"), std::string::npos) << result.told();
}

TEST(StressCommand, InterruptStopsIt) {
  const TemporaryFolder folder;
  const fs::path file = folder / "interrupted.json";
  ProgramCall call;
  call.arguments = {"stress", "--cases", "100000", "--json", file.string()};
  call.interrupt_when = [](const std::string& err) {
    return err.find("running cases") != std::string::npos;
  };
  const ProgramResult result = run_program(call);
  ASSERT_TRUE(result.interrupted) << result.told();
  EXPECT_EQ(result.code, 130) << result.told();
  EXPECT_NE(result.err.find("stopped"), std::string::npos) << result.told();
  EXPECT_FALSE(fs::exists(file));
}

}  // namespace
}  // namespace viscera::test
