#include "engine/io/smoke_file.h"

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <numeric>
#include <string>

#include "engine/io/foreign_files.h"
#include "kernels/base/stopwatch.h"
#include "tests/engine/io/file_size_limit.h"
#include "tests/support/paths.h"

namespace viscera {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;

// A puff of 1e-7 kg in a box that isn't at the origin.
SmokeGrid puff() {
  SmokeParameters parameters;
  parameters.domain = Box(Vec3(0.1, -0.05, 0.2), Vec3(0.16, 0.01, 0.28));
  SmokeVolume smoke(parameters);
  smoke.emit(
      {.position = Vec3(0.13, -0.02, 0.23), .radius = 8e-3, .mass = 1e-7, .particles = 2000});
  SmokeGrid grid;
  splat(smoke, 2e-3, grid);
  return grid;
}

double mass_of(const SmokeGrid& grid) {
  return std::accumulate(grid.density.begin(), grid.density.end(), 0.0) * std::pow(grid.voxel, 3);
}

std::size_t files_in(const fs::path& folder) {
  return std::distance(fs::directory_iterator(folder), fs::directory_iterator());
}

// First of all the tests of this program, so that nothing has called OpenVDB yet.
TEST(AASmokeFile, OpenVdbIsInitialisedByTheFirstWriterOnly) {
  EXPECT_EQ(openvdb_initialisations(), 0);
  {
    SmokeWriter first;
    EXPECT_EQ(openvdb_initialisations(), 1);
  }
  SmokeWriter second;
  EXPECT_EQ(openvdb_initialisations(), 1);
}

TEST(SmokeFile, HoldsTheGridsMassTimePlaceAndName) {
  const TemporaryFolder folder;
  const SmokeGrid grid = puff();
  SmokeWriter writer;
  writer.write(folder / "0001.vdb", grid, 1.25, "plume", "laparoscopic_cautery");
  ASSERT_TRUE(writer.finish()) << writer.finish().error().text();
  EXPECT_EQ(writer.written(), 1);
  EXPECT_EQ(files_in(folder.path()), 1u);

  const Result<SmokeFileInfo> info = read_smoke_info(folder / "0001.vdb");
  ASSERT_TRUE(info) << info.error().text();
  EXPECT_EQ(info->volume, "plume");
  EXPECT_EQ(info->time, 1.25);
  EXPECT_NEAR(info->voxel, 2e-3, 1e-12);
  EXPECT_NEAR(info->mass, 1e-7, 5e-4 * 1e-7);
  EXPECT_NEAR(info->mass, mass_of(grid), 5e-4 * mass_of(grid));

  // Where the grid has smoke, and nowhere else.
  Box filled;
  std::size_t cells = 0;
  for (std::size_t c = 0; c < grid.density.size(); ++c) {
    if (grid.density[c] <= 0x1p-24f) continue;
    const Eigen::Vector3i cell(static_cast<int>(c) % grid.size.x(),
                               static_cast<int>(c) / grid.size.x() % grid.size.y(),
                               static_cast<int>(c) / (grid.size.x() * grid.size.y()));
    const Vec3 least = grid.domain.min() + grid.voxel * cell.cast<double>();
    filled.extend(least).extend(Vec3(least.array() + grid.voxel));
    ++cells;
  }
  EXPECT_EQ(info->active_voxels, cells);
  EXPECT_LT((info->active_bounds().min() - filled.min()).norm(), 1e-9);
  EXPECT_LT((info->active_bounds().max() - filled.max()).norm(), 1e-9);
}

TEST(SmokeFile, TheSameSmokeIsTheSameFile) {
  const TemporaryFolder folder;
  const SmokeGrid grid = puff();
  SmokeGrid other = grid;
  for (float& density : other.density) density *= 2.0f;
  SmokeWriter writer;
  writer.write(folder / "a.vdb", grid, 0.5, "plume", "scene");
  writer.write(folder / "b.vdb", grid, 0.5, "plume", "scene");
  writer.write(folder / "c.vdb", other, 0.5, "plume", "scene");
  ASSERT_TRUE(writer.finish());
  const auto text = [&](const char* name) {
    std::ifstream in(folder / name, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  EXPECT_TRUE(text("a.vdb") == text("b.vdb"));
  EXPECT_FALSE(text("a.vdb").substr(0, 64) == text("c.vdb").substr(0, 64)) << "its identity";
  EXPECT_TRUE(read_smoke_info(folder / "a.vdb"));
}

TEST(SmokeFile, OpenVdbsOwnToolReadsIt) {
  if (std::system("command -v vdb_print >/dev/null 2>&1") != 0) {
    GTEST_SKIP() << "vdb_print isn't installed";
  }
  const TemporaryFolder folder;
  SmokeWriter writer;
  writer.write(folder / "0001.vdb", puff(), 1.25, "plume", "a_scene");
  ASSERT_TRUE(writer.finish());
  const std::string command = "vdb_print -m '" + (folder / "0001.vdb").string() + "' 2>&1";
  FILE* pipe = ::popen(command.c_str(), "r");
  ASSERT_NE(pipe, nullptr);
  std::string text;
  char buffer[512];
  while (std::fgets(buffer, sizeof(buffer), pipe)) text += buffer;
  EXPECT_EQ(::pclose(pipe), 0) << text;
  for (const char* part : {"density", "temperature", "fog volume", "kg/m3", "K above the gas",
                           "is_saved_as_half_float: true", "plume", "a_scene", "time_s: 1.25"}) {
    EXPECT_NE(text.find(part), std::string::npos) << part << " not in\n" << text;
  }
}

TEST(SmokeFile, WritesASeriesInOrderThroughAShortQueue) {
  const TemporaryFolder folder;
  const SmokeGrid grid = puff();
  SmokeWriter writer;
  for (int i = 0; i < 12; ++i) {
    writer.write(folder / (std::to_string(i) + ".vdb"), grid, 0.1 * i, "plume", "scene");
  }
  ASSERT_TRUE(writer.finish());
  EXPECT_EQ(writer.written(), 12);
  EXPECT_EQ(files_in(folder.path()), 12u);
  const Result<SmokeFileInfo> last = read_smoke_info(folder / "11.vdb");
  ASSERT_TRUE(last) << last.error().text();
  EXPECT_NEAR(last->time, 1.1, 1e-12);
}

TEST(SmokeFile, TheWriterFinishesWhatIsQueuedBeforeItEnds) {
  const TemporaryFolder folder;
  {
    SmokeWriter writer;
    writer.write(folder / "a.vdb", puff(), 0.0, "plume", "scene");
    writer.write(folder / "b.vdb", puff(), 0.0, "plume", "scene");
  }
  EXPECT_TRUE(read_smoke_info(folder / "a.vdb"));
  EXPECT_TRUE(read_smoke_info(folder / "b.vdb"));
}

TEST(SmokeFile, AVolumeWithoutSmokeIsAWholeEmptyFile) {
  const TemporaryFolder folder;
  SmokeGrid grid = puff();
  std::ranges::fill(grid.density, 0.0f);
  SmokeWriter writer;
  writer.write(folder / "empty.vdb", grid, 0.0, "plume", "scene");
  ASSERT_TRUE(writer.finish());
  const Result<SmokeFileInfo> info = read_smoke_info(folder / "empty.vdb");
  ASSERT_TRUE(info) << info.error().text();
  EXPECT_EQ(info->active_voxels, 0u);
  EXPECT_EQ(info->mass, 0.0);
  EXPECT_TRUE(info->active_bounds().isEmpty());
}

TEST(SmokeFile, AMissingFolderIsReportedWithTheFile) {
  const TemporaryFolder folder;
  SmokeWriter writer;
  writer.write(folder / "nowhere/0001.vdb", puff(), 0.0, "plume", "scene");
  writer.write(folder / "0002.vdb", puff(), 0.0, "plume", "scene");
  const Result<void> finished = writer.finish();
  ASSERT_FALSE(finished);
  EXPECT_NE(finished.error().text().find("nowhere/0001.vdb"), std::string::npos)
      << finished.error().text();
  EXPECT_EQ(writer.written(), 1);
}

TEST(SmokeFile, AFullDiskNamesTheFileAndLeavesNothing) {
  const TemporaryFolder folder;
  const SmokeGrid grid = puff();
  SmokeWriter writer;
  {
    const test::FileSizeLimit limit(2000);
    writer.write(folder / "0001.vdb", grid, 0.0, "plume", "scene");
    const Result<void> finished = writer.finish();
    ASSERT_FALSE(finished);
    EXPECT_NE(finished.error().text().find("0001.vdb"), std::string::npos);
  }
  EXPECT_EQ(files_in(folder.path()), 0u);
  if (fs::exists("/dev/full")) {
    SmokeWriter full;
    full.write("/dev/full", grid, 0.0, "plume", "scene");
    EXPECT_FALSE(full.finish());
  }
}

// A figure, not a bound: what a frame waits for, and what the worker does meanwhile.
TEST(SmokeFileCost, AFrameWaitsForTheCopyOf128CubedVoxelsAlone) {
  const TemporaryFolder folder;
  SmokeGrid grid;
  grid.size = Eigen::Vector3i::Constant(128);
  grid.voxel = 1e-3;
  grid.domain = Box(Vec3::Zero(), Vec3::Constant(0.128));
  const std::size_t cells = 128 * 128 * 128;
  grid.density.resize(cells);
  for (std::size_t c = 0; c < cells; ++c)
    grid.density[c] = 1e-3f * (1.0f + std::sin(0.01f * static_cast<float>(c % 4099)));
  grid.temperature.assign(cells, 20.0f);
  grid.velocity.assign(cells, Vec3f(0.0f, 0.1f, 0.0f));
  SmokeWriter writer;
  double waited = 0.0;
  constexpr int kVolumes = 3;
  for (int i = 0; i < kVolumes; ++i) {
    const Stopwatch watch;
    writer.write(folder / (std::to_string(i) + ".vdb"), grid, 0.0, "plume", "scene");
    waited += watch.seconds();
    ASSERT_TRUE(writer.finish());
  }
  RecordProperty("frame_ms", std::to_string(1e3 * waited / kVolumes));
  RecordProperty("worker_ms", std::to_string(1e3 * writer.seconds() / kVolumes));
  std::cout << "128^3 voxels, all filled: the frame " << 1e3 * waited / kVolumes
            << " ms, the worker " << 1e3 * writer.seconds() / kVolumes << " ms\n";
  EXPECT_EQ(writer.written(), kVolumes);
}

TEST(SmokeFile, AGridWhoseArraysDoNotFitItsSizeIsRefused) {
  const TemporaryFolder folder;
  SmokeGrid grid = puff();
  grid.density.pop_back();
  SmokeWriter writer;
  writer.write(folder / "0001.vdb", grid, 0.0, "plume", "scene");
  const Result<void> finished = writer.finish();
  ASSERT_FALSE(finished);
  EXPECT_NE(finished.error().text().find("0001.vdb"), std::string::npos);
  EXPECT_EQ(files_in(folder.path()), 0u);
}

TEST(SmokeFile, ReadingRefusesWhatIsNotAWholeSmokeVolume) {
  const TemporaryFolder folder;
  EXPECT_FALSE(read_smoke_info(folder / "missing.vdb"));
  EXPECT_FALSE(read_smoke_info(folder.path()));

  std::ofstream(folder / "empty.vdb");
  EXPECT_FALSE(read_smoke_info(folder / "empty.vdb"));
  std::ofstream(folder / "text.vdb") << "This isn't a volume, it is a sentence of some length.";
  const Result<SmokeFileInfo> text = read_smoke_info(folder / "text.vdb");
  ASSERT_FALSE(text);
  EXPECT_NE(text.error().text().find("text.vdb"), std::string::npos);

  SmokeWriter writer;
  writer.write(folder / "whole.vdb", puff(), 0.0, "plume", "scene");
  ASSERT_TRUE(writer.finish());
  // Cut anywhere, or with a byte changed, it is known before OpenVDB sees it, which would believe
  // the sizes it then finds and ask for as much memory.
  const auto size = fs::file_size(folder / "whole.vdb");
  const auto refusal = [&] {
    const Result<SmokeFileInfo> info = read_smoke_info(folder / "cut.vdb");
    return info ? std::string("read") : info.error().text();
  };
  for (int part = 0; part < 200; ++part) {
    fs::copy_file(folder / "whole.vdb", folder / "cut.vdb", fs::copy_options::overwrite_existing);
    fs::resize_file(folder / "cut.vdb", size * part / 200);
    EXPECT_NE(refusal().find("cut off"), std::string::npos) << refusal() << part;
  }
  fs::resize_file(folder / "cut.vdb", size - 1);
  EXPECT_NE(refusal().find("cut off"), std::string::npos) << refusal();
  for (int part = 0; part < 20; ++part) {
    fs::copy_file(folder / "whole.vdb", folder / "cut.vdb", fs::copy_options::overwrite_existing);
    std::fstream changed(folder / "cut.vdb", std::ios::in | std::ios::out | std::ios::binary);
    const auto at = static_cast<std::streamoff>(size * part / 20);
    changed.seekg(at);
    const auto byte = static_cast<char>(changed.get() ^ 0x40);
    changed.seekp(at);
    changed.put(byte);
    changed.close();
    EXPECT_NE(refusal().find("damaged"), std::string::npos) << refusal() << part;
  }
}

}  // namespace
}  // namespace viscera
