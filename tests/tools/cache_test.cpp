// The cache of prepared organs, from outside: taken, rebuilt when it is broken or foreign, and
// never in the way.
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>

#include "tests/tools/tiny_scene.h"

namespace viscera::test {
namespace {

namespace fs = std::filesystem;

/// The tiny scene, pressed and pulled less: nothing warns but the cache.
Json gentle_scene() {
  Json scene = tiny_scene();
  for (const int key : {1, 2}) scene["instruments"][0]["path"][key]["tip_mm"][2] = 15.9;
  scene["instruments"][1]["path"][2]["tip_mm"] = {-9.2, 0, 12.8};
  return scene;
}

fs::path only_cache_file(const SceneFolder& folder) {
  const auto files = files_of(folder.cache(), ".h5");
  EXPECT_EQ(files.size(), 1u);
  return files.empty() ? fs::path() : files.front();
}

/// A first run; the state hash that later ones must repeat.
std::string prepare(const SceneFolder& folder) {
  const ProgramResult result = folder.run({"--no-render"});
  EXPECT_EQ(result.code, 0) << result.told();
  const Json report = folder.report();
  EXPECT_EQ(report["organs"][0]["cache_hit"], false);
  EXPECT_TRUE(report["warnings"].empty()) << report;
  return report["state_hash"];
}

/// The run rebuilds with a warning that names file and reason; the one after it takes the cache.
void expect_rebuilt(const SceneFolder& folder, const std::string& reason,
                    const std::string& state_hash) {
  const fs::path file = only_cache_file(folder);
  const ProgramResult result = folder.run({"--no-render"});
  ASSERT_EQ(result.code, 0) << result.told();
  for (const std::string& word : {std::string("warning: ball: cache "), file.string(),
                                  std::string("rebuilt because"), reason})
    EXPECT_NE(result.err.find(word), std::string::npos) << word << " isn't in " << result.told();
  Json report = folder.report();
  ASSERT_EQ(report["warnings"].size(), 1u) << report;
  EXPECT_NE(report["warnings"][0].get<std::string>().find("rebuilt because"), std::string::npos);
  EXPECT_EQ(report["organs"][0]["cache_hit"], false);
  EXPECT_EQ(report["state_hash"], state_hash);

  const ProgramResult again = folder.run({"--no-render"});
  EXPECT_EQ(again.code, 0);
  EXPECT_EQ(again.err.find("warning"), std::string::npos) << again.err;
  report = folder.report();
  EXPECT_EQ(report["organs"][0]["cache_hit"], true);
  EXPECT_EQ(report["state_hash"], state_hash);
  expect_whole_files(folder.cache());
}

TEST(Cache, SecondRunTakesItAndStepsTheSame) {
  const SceneFolder folder(gentle_scene());
  const std::string hash = prepare(folder);
  const ProgramResult result = folder.run({"--no-render"});
  ASSERT_EQ(result.code, 0) << result.told();
  EXPECT_EQ(folder.report()["organs"][0]["cache_hit"], true);
  EXPECT_EQ(folder.report()["state_hash"], hash);
}

TEST(Cache, AShorterRunTakesIt) {
  const SceneFolder folder(gentle_scene());
  prepare(folder);
  ASSERT_EQ(folder.run({"--no-render", "--duration", "0.1"}).code, 0);
  EXPECT_EQ(folder.report()["organs"][0]["cache_hit"], true);
}

TEST(Cache, OneOfAnotherTissueIsntTaken) {
  const SceneFolder folder(gentle_scene());
  prepare(folder);
  ASSERT_EQ(folder.run({"--no-render", "--set", "organs/ball/youngs_modulus_kPa=9"}).code, 0);
  EXPECT_EQ(folder.report()["organs"][0]["cache_hit"], false);
  EXPECT_EQ(files_of(folder.cache(), ".h5").size(), 2u);
}

TEST(Cache, ForgetsWhatItsQuotaHasNoRoomForAndKeepsWhatThisRunUses) {
  const SceneFolder folder(gentle_scene());
  prepare(folder);
  const fs::path older = only_cache_file(folder);
  const auto hours_ago = fs::file_time_type::clock::now() - std::chrono::hours(3);
  for (const auto& entry : fs::directory_iterator(folder.cache()))
    fs::last_write_time(entry.path(), hours_ago);
  ProgramCall call = folder.call({"--no-render", "--set", "organs/ball/youngs_modulus_kPa=9"});
  call.variables = {"VISCERA_CACHE_GB=0"};
  const ProgramResult result = run_program(call);
  ASSERT_EQ(result.code, 0) << result.told();
  EXPECT_FALSE(fs::exists(older));
  EXPECT_TRUE(fs::exists(only_cache_file(folder)));
  EXPECT_EQ(files_of(folder.cache(), ".shape").size(), 1u) << "read by this run";
  call.variables = {"VISCERA_CACHE_GB=much"};
  EXPECT_NE(run_program(call).err.find("warning: VISCERA_CACHE_GB: found \"much\""),
            std::string::npos);
}

TEST(Cache, TruncatedIsRebuiltWithAWarning) {
  const SceneFolder folder(gentle_scene());
  const std::string hash = prepare(folder);
  const fs::path file = only_cache_file(folder);
  fs::resize_file(file, fs::file_size(file) / 2);
  expect_rebuilt(folder, "truncated or damaged", hash);
}

TEST(Cache, OneFlippedByteIsRebuiltWithAWarning) {
  const SceneFolder folder(gentle_scene());
  const std::string hash = prepare(folder);
  const fs::path file = only_cache_file(folder);
  const auto middle = static_cast<std::streamoff>(fs::file_size(file) / 2);
  std::fstream bytes(file, std::ios::in | std::ios::out | std::ios::binary);
  bytes.seekg(middle);
  const char was = static_cast<char>(bytes.get());
  bytes.seekp(middle);
  bytes.put(static_cast<char>(was ^ 0x10));
  bytes.close();
  expect_rebuilt(folder, "truncated or damaged", hash);
}

TEST(Cache, EmptyIsRebuiltWithAWarning) {
  const SceneFolder folder(gentle_scene());
  const std::string hash = prepare(folder);
  fs::resize_file(only_cache_file(folder), 0);
  expect_rebuilt(folder, "wasn't written by Viscera", hash);
}

TEST(Cache, AnotherProgramsFileIsRebuiltWithAWarning) {
  const SceneFolder folder(gentle_scene());
  const std::string hash = prepare(folder);
  std::ofstream(only_cache_file(folder), std::ios::binary) << "\x89HDF\r\n\x1a\n of somebody else";
  expect_rebuilt(folder, "wasn't written by Viscera", hash);
}

TEST(Cache, AnotherOrgansFileIsRebuiltWithAWarning) {
  const SceneFolder folder(gentle_scene());
  const std::string hash = prepare(folder);
  SceneFolder other;
  ASSERT_EQ(other.run({"--no-render", "--set", "organs/ball/youngs_modulus_kPa=9"}).code, 0);
  fs::copy_file(only_cache_file(other), only_cache_file(folder),
                fs::copy_options::overwrite_existing);
  expect_rebuilt(folder, "it was made for other inputs", hash);
}

TEST(Cache, OneThatCantBeWrittenIsAWarning) {
  const SceneFolder folder(gentle_scene());
  ProgramCall call = folder.call({"--no-render"});
  call.cache = "/proc/x";
  const ProgramResult result = run_program(call);
  ASSERT_EQ(result.code, 0) << result.told();
  EXPECT_NE(result.err.find("warning: cache not written: /proc/x"), std::string::npos)
      << result.told();
  EXPECT_EQ(folder.report()["warnings"].size(), 1u);
}

TEST(Cache, AFullDiskIsAWarningAndLeavesNoFile) {
  const SceneFolder folder(gentle_scene());
  ProgramCall call = folder.call({"--no-render", "--set", "smoke/plume/voxel_mm=4"});
  call.greatest_file = 100000;  // room for every output but the cache
  const ProgramResult result = run_program(call);
  ASSERT_EQ(result.code, 0) << result.told();
  EXPECT_NE(result.err.find("warning: cache not written: "), std::string::npos) << result.told();
  EXPECT_TRUE(files_of(folder.cache(), ".h5").empty());
  expect_whole_files(folder.cache());
  expect_whole_files(folder.out());
}

TEST(Cache, NoCacheNeitherReadsNorWrites) {
  const SceneFolder folder(gentle_scene());
  ASSERT_EQ(folder.run({"--no-render", "--no-cache"}).code, 0);
  EXPECT_FALSE(fs::exists(folder.cache()));
  prepare(folder);
  ASSERT_EQ(folder.run({"--no-render", "--no-cache"}).code, 0);
  EXPECT_EQ(folder.report()["organs"][0]["cache_hit"], false);
}

}  // namespace
}  // namespace viscera::test
