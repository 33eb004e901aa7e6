// Smoke volumes as programs that aren't ours read them; each is skipped where its program is
// absent.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>
#include <string>

#include "engine/io/smoke_file.h"
#include "tests/support/paths.h"

namespace viscera {
namespace {

using test::TemporaryFolder;

SmokeGrid puff() {
  SmokeParameters parameters;
  parameters.domain = Box(Vec3(0.1, -0.05, 0.2), Vec3(0.14, -0.01, 0.25));
  SmokeVolume smoke(parameters);
  smoke.emit({.position = Vec3(0.12, -0.03, 0.22), .radius = 6e-3, .mass = 1e-7, .particles = 500});
  SmokeGrid grid;
  splat(smoke, 2e-3, grid);
  return grid;
}

/// What a command prints to both streams, and whether it ended well.
std::pair<std::string, bool> output_of(const std::string& command) {
  FILE* pipe = ::popen((command + " 2>&1").c_str(), "r");
  if (pipe == nullptr) return {"", false};
  std::string text;
  char buffer[4096];
  while (std::fgets(buffer, sizeof buffer, pipe)) text += buffer;
  return {text, ::pclose(pipe) == 0};
}

bool succeeds(const std::string& command) {
  return std::system((command + " >/dev/null 2>&1").c_str()) == 0;
}

class SmokeReaders : public ::testing::Test {
 protected:
  void SetUp() override {
    SmokeWriter writer;
    writer.write(file_, grid_, 1.25, "plume", "a_scene");
    ASSERT_TRUE(writer.finish());
  }

  std::string script(const std::string& text) const {
    std::ofstream(folder_ / "read.py") << text;
    return (folder_ / "read.py").string();
  }

  const TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_ / "0001.vdb";
  const SmokeGrid grid_ = puff();
};

TEST_F(SmokeReaders, OpenVdbsPythonModuleReadsEveryValueWithinHalfPrecision) {
  const std::string python = "/usr/bin/python3";
  if (!succeeds(python + " -c 'import pyopenvdb'"))
    GTEST_SKIP() << "python3-openvdb isn't installed";
  const std::string code = script(R"(
import sys, pyopenvdb
grids = {name: pyopenvdb.read(sys.argv[1], name) for name in ('density', 'temperature', 'velocity')}
nx, ny, nz = map(int, sys.argv[2:5])
readers = {name: grid.getConstAccessor() for name, grid in grids.items()}
for z in range(nz):
  for y in range(ny):
    for x in range(nx):
      at = (x, y, z)
      values = [readers['density'].getValue(at), readers['temperature'].getValue(at)]
      print(*values, *readers['velocity'].getValue(at))
)");
  const auto [text, ended] =
      output_of(python + " " + code + " " + file_.string() + " " + std::to_string(grid_.size.x()) +
                " " + std::to_string(grid_.size.y()) + " " + std::to_string(grid_.size.z()));
  ASSERT_TRUE(ended) << text;
  constexpr float kHalf = 0x1p-11f;  // relative rounding of half precision
  std::istringstream in(text);
  std::size_t smoky = 0;
  for (std::size_t c = 0; c < grid_.density.size(); ++c) {
    float density = 0.0f, temperature = 0.0f;
    Vec3f velocity;
    ASSERT_TRUE(in >> density >> temperature >> velocity.x() >> velocity.y() >> velocity.z());
    EXPECT_NEAR(density, grid_.density[c], kHalf * grid_.density[c] + 0x1p-24f);
    if (grid_.density[c] <= 0x1p-24f) continue;
    ++smoky;
    EXPECT_NEAR(temperature, grid_.temperature[c], kHalf * std::abs(grid_.temperature[c]) + 0.05f);
    EXPECT_LT((velocity - grid_.velocity[c]).norm(), 2 * kHalf * grid_.velocity[c].norm() + 2e-5f);
  }
  EXPECT_GT(smoky, 100u);
}

TEST_F(SmokeReaders, BlenderLoadsTheGridsWhereTheSmokeIs) {
  if (!succeeds("command -v blender")) GTEST_SKIP() << "blender isn't installed";
  const std::string code = script(R"(
import sys, bpy
volume = bpy.data.volumes.new('plume')
volume.filepath = sys.argv[-1]
assert volume.grids.load(), volume.grids.error_message
for grid in volume.grids:
  assert grid.load()
  corner = [grid.matrix_object[i][3] for i in range(3)]
  print('grid', grid.name, grid.data_type, grid.matrix_object[0][0], *corner)
)");
  const auto [text, ended] =
      output_of("blender -b --factory-startup --python-exit-code 3 --python " + code + " -- " +
                file_.string());
  ASSERT_TRUE(ended) << text;
  std::istringstream lines(text);
  std::string line;
  std::map<std::string, std::string> types;
  while (std::getline(lines, line)) {
    std::istringstream words(line);
    std::string word, name, type;
    double voxel = 0.0, x = 0.0, y = 0.0, z = 0.0;
    if (!(words >> word >> name >> type >> voxel >> x >> y >> z) || word != "grid") continue;
    types[name] = type;
    EXPECT_NEAR(voxel, grid_.voxel, 1e-7);
    const Vec3 first = grid_.domain.min().array() + 0.5 * grid_.voxel;
    EXPECT_LT((Vec3(x, y, z) - first).norm(), 1e-6) << line;
  }
  const std::map<std::string, std::string> expected = {
      {"density", "FLOAT"}, {"temperature", "FLOAT"}, {"velocity", "VECTOR_FLOAT"}};
  EXPECT_EQ(types, expected) << text;
}

}  // namespace
}  // namespace viscera
