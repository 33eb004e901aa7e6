// `viscera run --vtk`: what ParaView opens, read back.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <string>

#include "tests/support/vtu_reader.h"
#include "tests/tools/tiny_scene.h"

namespace viscera::test {
namespace {

namespace fs = std::filesystem;

/// The tiny scene, and a second ball that no tool reaches.
Json two_balls() {
  Json scene = tiny_scene();
  scene["organs"].push_back({{"name", "far"},
                             {"geometry", {{"recipe", "sphere"}, {"radius_mm", 5}, {"edge_mm", 3}}},
                             {"tissue", "liver"},
                             {"pose", {{"position_mm", {0, 60, 0}}}},
                             {"deformable", false}});
  return scene;
}

/// Rows of forces.csv: the sum of the forces on the instruments [N] at each time [ms].
std::map<long, Vec3> forces_on_tools(const fs::path& file) {
  std::map<long, Vec3> forces;
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) {
    std::vector<double> row;
    std::stringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) row.push_back(std::stod(cell));
    Vec3 sum = Vec3::Zero();
    for (std::size_t tool = 0; 6 * tool + 6 < row.size(); ++tool)
      for (int axis = 0; axis < 3; ++axis) sum[axis] += row[6 * tool + 4 + axis];
    forces[std::lround(1e3 * row[0])] = sum;
  }
  return forces;
}

double greatest(const std::vector<Vec3f>& vectors) {
  float most = 0.0f;
  for (const Vec3f& v : vectors) most = std::max(most, v.norm());
  return most;
}

TEST(VtkSeries, HoldsTheDisplacementsAndForcesOfTheRun) {
  const SceneFolder folder(two_balls());
  const ProgramResult result = folder.run({"--no-render", "--vtk"});
  ASSERT_EQ(result.code, 0) << result.told();
  expect_whole_files(folder.out());
  const fs::path vtk = folder.out() / "vtk";
  const auto forces = forces_on_tools(folder.out() / "forces.csv");
  const Json report = folder.report();

  double most = 0.0, strongest = 0.0;
  std::set<double> times;
  std::size_t points = 0;
  for (const PvdContent& entry : read_pvd(vtk / "organs.pvd")) {
    SCOPED_TRACE(entry.file);
    times.insert(entry.time);
    const VtuContent organ = read_vtu(vtk / entry.file);
    ASSERT_TRUE(organ.fields.contains("displacement"));
    ASSERT_TRUE(organ.fields.contains("force"));
    ASSERT_EQ(organ.fields.at("displacement").size(), organ.points.size());
    ASSERT_EQ(organ.fields.at("force").size(), organ.points.size());
    if (entry.name == "far") {
      EXPECT_EQ(entry.file, "far/0000.vtu") << "nothing touches it: it is written once";
      EXPECT_EQ(greatest(organ.fields.at("displacement")), 0.0);
      EXPECT_NEAR(organ.points[0].y(), 0.060, 0.0051) << "in the world";
      continue;
    }
    if (points > 0) {
      EXPECT_EQ(organ.points.size(), points);
    }
    points = organ.points.size();
    EXPECT_EQ(organ.triangles.size(), report["organs"][0]["triangles"].get<std::size_t>());
    EXPECT_NEAR(organ.points[0].norm(), 0.015, 0.0005) << "metres";
    Vec3 sum = Vec3::Zero();
    for (const Vec3f& force : organ.fields.at("force")) sum += force.cast<double>();
    const Vec3& felt = forces.at(std::lround(1e3 * entry.time));
    EXPECT_LT((sum + felt).norm(), 1e-4 * felt.norm() + 1e-9)
        << "found " << sum.transpose() << " N on the organ and " << felt.transpose()
        << " N on the tools";
    strongest = std::max(strongest, sum.norm());
    most = std::max(most, greatest(organ.fields.at("displacement")));
  }
  EXPECT_EQ(times.size(), 6u);
  EXPECT_GT(strongest, 0.01) << "tools do press in this scene";
  const double reported = report["organs"][0]["greatest_displacement_m"];
  EXPECT_GT(most, 0.5 * reported);
  EXPECT_LE(most, reported * 1.0001);
  EXPECT_EQ(report["organs"][1]["greatest_displacement_m"], 0.0);
  EXPECT_EQ(files_of(vtk / "far", ".vtu").size(), 1u);
  EXPECT_GT(files_of(vtk / "ball", ".vtu").size(), 3u);
}

TEST(VtkSeries, AnOrganThatBreathesGoesWithItsBreath) {
  Json scene = two_balls();
  scene["organs"][1]["motion"] = {{"amplitude_mm", 4}, {"period_s", 0.5}};
  const SceneFolder folder(scene);
  const ProgramResult result = folder.run({"--no-render", "--vtk"});
  ASSERT_EQ(result.code, 0) << result.told();
  const auto files = files_of(folder.out() / "vtk" / "far", ".vtu");
  ASSERT_EQ(files.size(), 6u);
  const VtuContent first = read_vtu(files.front()), last = read_vtu(files.back());
  const Vec3f way = last.points[0] - first.points[0];
  EXPECT_GT(way.norm(), 0.001);
  for (std::size_t v = 0; v < first.points.size(); ++v)
    EXPECT_LT((last.points[v] - first.points[v] - way).norm(), 1e-7f);
  EXPECT_EQ(greatest(last.fields.at("displacement")), 0.0);
}

TEST(VtkSeries, IsWrittenAtTheSnapshotsAlone) {
  const SceneFolder folder;
  const ProgramResult result = folder.run({"--no-render", "--vtk", "--snapshots", "0.1,0.19"});
  ASSERT_EQ(result.code, 0) << result.told();
  const auto entries = read_pvd(folder.out() / "vtk" / "organs.pvd");
  ASSERT_EQ(entries.size(), 2u);
  EXPECT_EQ(entries[0].file, "ball/0002.vtu");
  EXPECT_EQ(entries[1].file, "ball/0005.vtu");
}

TEST(VtkSeries, DoesntChangeTheSimulation) {
  const SceneFolder folder;
  ASSERT_EQ(folder.run({"--no-render", "--vtk"}).code, 0);
  const std::string with = folder.report()["state_hash"];
  ASSERT_EQ(folder.run({"--no-render"}).code, 0);
  EXPECT_EQ(folder.report()["state_hash"], with);
}

TEST(VtkSeries, ALaterRunReplacesItsFilesAndNoOthers) {
  const SceneFolder folder;
  const fs::path vtk = folder.out() / "vtk";
  ASSERT_EQ(folder.run({"--no-render", "--vtk"}).code, 0);
  for (const char* mine : {"state.pvsm", "warped.vtu", "ball/notes.txt"})
    std::ofstream(vtk / mine) << "mine";
  ASSERT_EQ(folder.run({"--no-render", "--vtk", "--duration", "0.1"}).code, 0);
  EXPECT_EQ(files_of(vtk / "ball", ".vtu").size(), 3u);
  ASSERT_EQ(folder.run({"--no-render"}).code, 0);
  EXPECT_TRUE(files_of(vtk / "ball", ".vtu").empty());
  EXPECT_FALSE(fs::exists(vtk / "organs.pvd"));
  for (const char* mine : {"state.pvsm", "warped.vtu", "ball/notes.txt"})
    EXPECT_EQ(file_text(vtk / mine), "mine") << mine;
}

TEST(VtkSeries, SurfacesThatNoRunHasMadeAreNotReplaced) {
  const SceneFolder folder;
  fs::create_directories(folder.out() / "vtk" / "ball");
  std::ofstream(folder.out() / "vtk" / "ball" / "0001.vtu") << "mine";
  expect_refused(folder.run({"--no-render", "--vtk"}), {"--out", "0001.vtu", "expected an empty"});
}

TEST(VtkSeries, AFileInTheWayOfAnOrgansFolderEndsTheRunAndStays) {
  const SceneFolder folder;
  fs::create_directories(folder.out() / "vtk");
  std::ofstream(folder.out() / "vtk" / "ball") << "mine";
  expect_failed(folder.run({"--no-render", "--vtk"}), 1,
                {(folder.out() / "vtk" / "ball").string(), "found a file"});
  EXPECT_EQ(file_text(folder.out() / "vtk" / "ball"), "mine");
}

TEST(VtkSeries, ParaViewOpensIt) {
  if (run_command({"pvpython", "--version"}).code != 0)
    GTEST_SKIP() << "there is no pvpython on the PATH (on Debian: paraview, python3-paraview)";
  const SceneFolder folder(two_balls());
  ASSERT_EQ(folder.run({"--no-render", "--vtk"}).code, 0);
  const fs::path script = folder / "open.py";
  std::ofstream(script) << R"(
import sys
from paraview import servermanager, simple
organs = simple.PVDReader(FileName=sys.argv[1])
times = list(organs.TimestepValues)
organs.UpdatePipeline(times[-1])
info = organs.GetDataInformation()
print("times", len(times))
print("points", info.GetNumberOfPoints())
print("cells", info.GetNumberOfCells())
for name in ("displacement", "force"):
    array = info.GetPointDataInformation().GetArrayInformation(name)
    print(name, array.GetNumberOfComponents(), array.GetComponentRange(-1)[1])
warped = simple.WarpByVector(Input=simple.MergeBlocks(Input=organs),
                             Vectors=["POINTS", "displacement"])
warped.UpdatePipeline(times[-1])
print("warped", warped.GetDataInformation().GetNumberOfPoints())
)";
  const ProgramResult opened =
      run_command({"pvpython", script.string(), (folder.out() / "vtk" / "organs.pvd").string()});
  ASSERT_EQ(opened.code, 0) << opened.told();

  const auto entries = read_pvd(folder.out() / "vtk" / "organs.pvd");
  std::size_t points = 0, cells = 0;
  double displacement = 0.0, force = 0.0;
  for (const PvdContent& entry : entries) {
    if (entry.time != entries.back().time) continue;
    const VtuContent organ = read_vtu(folder.out() / "vtk" / entry.file);
    points += organ.points.size();
    cells += organ.triangles.size();
    displacement = std::max(displacement, greatest(organ.fields.at("displacement")));
    force = std::max(force, greatest(organ.fields.at("force")));
  }
  std::map<std::string, std::vector<double>> told;
  std::istringstream lines(opened.out);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string name;
    words >> name;
    for (double value; words >> value;) told[name].push_back(value);
  }
  EXPECT_EQ(told["times"], std::vector<double>{6}) << opened.told();
  EXPECT_EQ(told["points"], std::vector<double>{static_cast<double>(points)}) << opened.told();
  EXPECT_EQ(told["cells"], std::vector<double>{static_cast<double>(cells)}) << opened.told();
  EXPECT_EQ(told["warped"], std::vector<double>{static_cast<double>(points)}) << opened.told();
  ASSERT_EQ(told["displacement"].size(), 2u) << opened.told();
  EXPECT_EQ(told["displacement"][0], 3);
  EXPECT_NEAR(told["displacement"][1], displacement, 1e-5 * displacement);
  ASSERT_EQ(told["force"].size(), 2u) << opened.told();
  EXPECT_NEAR(told["force"][1], force, 1e-5 * force);
}

}  // namespace
}  // namespace viscera::test
