// An installed tree stands on its own.
#include <gtest/gtest.h>

#include "tests/support/paths.h"
#include "tests/support/program.h"

namespace viscera::test {
namespace fs = std::filesystem;
namespace {

class Installed : public testing::Test {
 protected:
  void SetUp() override {
    const ProgramResult result =
        run_command({VISCERA_CMAKE, "--install", VISCERA_BUILD_DIR, "--prefix", prefix_.string()});
    ASSERT_EQ(result.code, 0) << result.told();
  }

  /// Runs the program of a tree from another folder, without the variable that names the assets.
  ProgramResult check_sphere_in(const fs::path& tree) {
    return run_command({"env", "--chdir=/", "--unset=VISCERA_ASSETS",
                        "VISCERA_CACHE=" + (folder_ / "cache").string(),
                        (tree / "bin/viscera").string(), "check",
                        (tree / "share/viscera/scenes/sphere_press.json").string()});
  }

  TemporaryFolder folder_;
  fs::path prefix_ = folder_ / "installed";
};

TEST_F(Installed, ProgramChecksAnInstalledScene) {
  const ProgramResult result = check_sphere_in(prefix_);
  EXPECT_EQ(result.code, 0) << result.told();
  EXPECT_NE(result.out.find("sphere_press"), std::string::npos) << result.told();
}

TEST_F(Installed, TreeMayBeMoved) {
  fs::rename(prefix_, folder_ / "moved");
  const ProgramResult result = check_sphere_in(folder_ / "moved");
  EXPECT_EQ(result.code, 0) << result.told();
  const ProgramResult measured =
      run_command({(folder_ / "moved/bin/viscera").string(), "stress", "--cases", "1", "--quiet"});
  EXPECT_EQ(measured.code, 0) << measured.told();
}

TEST_F(Installed, ProgramWithoutTheOneThatMeasuresSaysSo) {
  fs::remove(prefix_ / "bin/viscera_bench");
  const ProgramResult result = run_command({(prefix_ / "bin/viscera").string(), "stress"});
  EXPECT_EQ(result.code, 2) << result.told();
  EXPECT_NE(result.err.find((prefix_ / "bin/viscera_bench").string()), std::string::npos)
      << result.told();
}

TEST_F(Installed, ProgramUsesNoDataOfTheSourceTree) {
  fs::remove(prefix_ / "share/viscera/assets/tissues.json");
  const ProgramResult result = check_sphere_in(prefix_);
  EXPECT_EQ(result.code, 2) << result.told();
  EXPECT_NE(result.err.find((prefix_ / "share/viscera/assets").string()), std::string::npos)
      << result.told();
}

TEST_F(Installed, LicencesComeAlong) {
  for (const char* document : {"LICENSE", "NOTICE", "README.md", "REFERENCES.md"})
    EXPECT_TRUE(fs::exists(prefix_ / "share/doc/viscera" / document)) << document;
}

}  // namespace
}  // namespace viscera::test
