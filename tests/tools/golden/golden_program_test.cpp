// `viscera_golden`: what it refuses, and that nothing of it stays behind.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/support/paths.h"
#include "tests/support/program.h"
#include "tools/golden/golden.h"

namespace viscera::test {
namespace {

namespace fs = std::filesystem;

/// A project of this golden file alone, and a folder for temporary files.
class GoldenProgram : public testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(folder_ / "project" / "tests" / "scenes");
    fs::create_directories(folder_ / "temporary");
    std::ofstream(file()) << golden_text({{"hemisphere", 0.1, {}}});
  }
  fs::path file() const { return folder_ / "project" / "tests" / "scenes" / "golden.json"; }
  ProgramResult golden(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> words = {"env", "TMPDIR=" + (folder_ / "temporary").string(),
                                      VISCERA_GOLDEN, "--root", (folder_ / "project").string()};
    words.insert(words.end(), more.begin(), more.end());
    return run_command(words);
  }
  bool leaves_nothing() const { return fs::is_empty(folder_ / "temporary"); }

 private:
  const TemporaryFolder folder_;
};

TEST_F(GoldenProgram, RefusesScenesThatAreNotInTheFile) {
  const std::string before = file_text(file());
  expect_refused(golden({"--write", "hemisphere", "hemispere"}),
                 {"golden.json: found no scene \"hemispere\"", "expected one of: hemisphere"});
  EXPECT_EQ(file_text(file()), before);
  EXPECT_TRUE(leaves_nothing());
}

TEST_F(GoldenProgram, LeavesNothingBehindWhereARunCantBegin) {
  expect_refused(golden(), {"hemisphere.json"});
  EXPECT_TRUE(leaves_nothing());
}

TEST_F(GoldenProgram, RefusesAFileThatIsNone) {
  std::ofstream(file()) << R"({"scenes": [{"scene": 3}]})";
  expect_refused(golden(), {"golden.json: scenes/0"});
  EXPECT_TRUE(leaves_nothing());
}

}  // namespace
}  // namespace viscera::test
