// `viscera import` from end to end: listing, organs in files, refusals, a scene from them.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/label_files.h"
#include "tests/support/shapes.h"
#include "tests/tools/tiny_scene.h"

namespace viscera::test {
namespace {

namespace fs = std::filesystem;

ProgramResult import(std::vector<std::string> words) {
  ProgramCall call;
  call.arguments = {"import"};
  call.arguments.insert(call.arguments.end(), words.begin(), words.end());
  return run_program(call);
}

// Two balls side by side, 40 and 24 mm across, at 2 mm; units of the file by `units`.
LabelImage two_balls() {
  LabelImage image = centred_image({40, 24, 24}, {2, 2, 2});
  image.fill(5, [](const Vec3& x) { return (x - Vec3(-15, 0, 0)).norm() < 20.0; });
  image.fill(6, [](const Vec3& x) { return (x - Vec3(20, 0, 0)).norm() < 12.0; });
  return image;
}

std::size_t entries(const fs::path& folder) {
  std::error_code ignored;
  return fs::exists(folder)
             ? static_cast<std::size_t>(std::distance(fs::directory_iterator(folder, ignored), {}))
             : 0;
}

class Import : public testing::Test {
 protected:
  Import() {
    NiftiOptions named;
    named.extension =
        "<Label Key=\"5\"><![CDATA[liver]]></Label><Label Key=\"6\"><![CDATA[Kidney, "
        "left]]></Label>";
    write_bytes(folder_ / "map.nii.gz", gzipped(nifti_bytes(two_balls(), named)));
    NiftiOptions unknown;
    unknown.units = 0;
    write_bytes(folder_ / "no_unit.nii", nifti_bytes(two_balls(), unknown));
  }
  std::string file(const std::string& name) const { return (folder_ / name).string(); }
  std::string out() const { return (folder_ / "out").string(); }
  void refused(std::vector<std::string> words, const std::vector<std::string>& told) const {
    words.insert(words.end(), {"--out", out()});
    expect_refused(import(words), told);
    EXPECT_EQ(entries(folder_ / "out"), 0u) << "nothing is written on bad input";
  }
  TemporaryFolder folder_;
};

TEST_F(Import, ListsLabelsWithNamesVolumesAndBoxes) {
  const ProgramResult result = import({file("map.nii.gz"), "--list"});
  ASSERT_EQ(result.code, 0) << result.told();
  for (const char* word : {"NIfTI-1", "40 x 24 x 24 voxels of 2 x 2 x 2 mm", "orientation RAS",
                           "unit: mm", "liver", "Kidney, left", " ml "})
    EXPECT_NE(result.out.find(word), std::string::npos) << word << result.told();
  const ProgramResult unknown = import({file("no_unit.nii"), "--list"});
  ASSERT_EQ(unknown.code, 0) << unknown.told();
  EXPECT_NE(unknown.out.find("unit: the file doesn't say it"), std::string::npos);
}

TEST_F(Import, WritesSurfaceEntryNodesAndPage) {
  const ProgramResult result =
      import({file("map.nii.gz"), "--label", "5", "--name", "liver", "--out", out()});
  ASSERT_EQ(result.code, 0) << result.told();
  EXPECT_EQ(entries(out()), 4u);
  const std::string obj = file_text(folder_ / "out" / "liver.obj");
  EXPECT_TRUE(obj.starts_with("# written by viscera; unit: mm\n")) << obj.substr(0, 200);
  const Json entry = Json::parse(file_text(folder_ / "out" / "liver.json"));
  EXPECT_EQ(entry["geometry"]["file"], "liver.obj");
  EXPECT_EQ(entry["geometry"]["unit"], "mm");
  EXPECT_EQ(entry["tissue"], "liver");
  const std::string nodes = file_text(folder_ / "out" / "liver_nodes.ply");
  EXPECT_TRUE(nodes.starts_with("ply\nformat ascii 1.0\n"));
  const std::string page = file_text(folder_ / "out" / "liver.html");
  for (const char* word :
       {"<!DOCTYPE html>", "volume", "genus", "smallest angle", "thinnest wall", "node spacings",
        "expected memory", "expected preparation", "data:image/bmp;base64,", "</html>"})
    EXPECT_NE(page.find(word), std::string::npos) << word;
  EXPECT_EQ(page.find("http"), std::string::npos) << "no network";
}

TEST_F(Import, SeveralLabelsAndAllOfThemTakeTheFilesNames) {
  const ProgramResult two = import({file("map.nii.gz"), "--label", "5,6", "--out", out()});
  ASSERT_EQ(two.code, 0) << two.told();
  EXPECT_TRUE(fs::exists(folder_ / "out" / "liver.obj"));
  EXPECT_TRUE(fs::exists(folder_ / "out" / "kidney_left.obj"));
  EXPECT_EQ(Json::parse(file_text(folder_ / "out" / "kidney_left.json"))["tissue"], "kidney");
  const ProgramResult all = import({file("no_unit.nii"), "--all", "--unit", "mm", "--out", out()});
  ASSERT_EQ(all.code, 0) << all.told();
  EXPECT_TRUE(fs::exists(folder_ / "out" / "label_5.obj"));
  EXPECT_TRUE(fs::exists(folder_ / "out" / "label_6.obj"));
}

TEST_F(Import, BadInputIsRefusedAndWritesNothing) {
  refused({file("map.nii.gz"), "--label", "7"},
          {"found no voxel of label 7, expected one of 5, 6"});
  refused({file("map.nii.gz")}, {"found no --label"});
  refused({file("map.nii.gz"), "--label", "5", "--name", "My Liver"}, {"(\"my_liver\"?)"});
  refused({file("map.nii.gz"), "--label", "5,6", "--name", "liver"},
          {"found 1 names for 2 labels"});
  refused({file("map.nii.gz"), "--label", "5", "--unit", "inch"}, {"expected mm, cm or m"});
  refused({file("map.nii.gz"), "--label", "5", "--unit", "m"},
          {"found a volume of 80 m across", "millimetres? --unit mm"});
  refused({file("map.nii.gz"), "--label", "5", "--tissue", "ham"}, {"--tissue: found \"ham\""});
  refused(
      {file("no_unit.nii"), "--label", "5"},
      {"found no unit of length in the file, expected it from --unit (millimetres? --unit mm)"});
  refused({file("absent.nii"), "--label", "5"}, {"found no such file"});
  refused({file("notes.txt")}, {"found another format"});
  expect_refused(import({file("map.nii.gz"), "--label", "5"}), {"found no --out"});
}

TEST_F(Import, FilesOfOtherPeopleAreLeftAlone) {
  fs::create_directory(folder_ / "out");
  write_bytes(folder_ / "out" / "liver.obj", "# made by hand\n");
  expect_refused(import({file("map.nii.gz"), "--label", "5", "--out", out()}),
                 {"found a file that viscera didn't write"});
  EXPECT_EQ(file_text(folder_ / "out" / "liver.obj"), "# made by hand\n");
  EXPECT_EQ(entries(out()), 1u);
}

TEST_F(Import, SurfacesAreWrappedAndTheirUnitAskedFor) {
  // A cube without its lid, in millimetres.
  write_bytes(folder_ / "cup.obj",
              "v 0 0 0\nv 40 0 0\nv 40 40 0\nv 0 40 0\nv 0 0 40\nv 40 0 40\nv 40 40 40\nv 0 40 40\n"
              "f 1 3 2\nf 1 4 3\nf 1 2 6\nf 1 6 5\nf 2 3 7\nf 2 7 6\nf 3 4 8\nf 3 8 7\nf 4 1 5\n"
              "f 4 5 8\n");
  refused({file("cup.obj")}, {"obj files don't say their unit", "--unit"});
  refused({file("cup.obj"), "--unit", "m"}, {"found a body of 40 m across", "\"mm\"?"});
  const ProgramResult result =
      import({file("cup.obj"), "--unit", "mm", "--voxel-mm", "1.5", "--out", out()});
  ASSERT_EQ(result.code, 0) << result.told();
  for (const char* word : {"distance from the original at most", "in the mean",
                           "warning: cup: wrapping closed a gap about", "more than ten voxels"})
    EXPECT_NE(result.out.find(word), std::string::npos) << word << result.told();
  EXPECT_EQ(entries(out()), 4u);
}

TEST(WrappedOrgan, IsToldOfInEveryRunAlsoFromTheCache) {
  Json scene = tiny_scene();
  scene["organs"][0]["geometry"] = {
      {"file", "open.obj"}, {"unit", "mm"}, {"wrap", {{"voxel_mm", 1.5}}}};
  const SceneFolder folder(scene);
  // A ball of 15 mm without the triangles around its lowest vertex.
  const TriangleSurface ball = icosphere(15.0, 4);
  std::string obj;
  for (const Vec3& x : ball.vertices)
    obj += "v " + std::to_string(x.x()) + " " + std::to_string(x.y()) + " " +
           std::to_string(x.z()) + "\n";
  for (const auto& [a, b, c] : ball.triangles) {
    if (std::min({ball.vertices[a].z(), ball.vertices[b].z(), ball.vertices[c].z()}) < -14.9)
      continue;
    obj += "f " + std::to_string(a + 1) + " " + std::to_string(b + 1) + " " +
           std::to_string(c + 1) + "\n";
  }
  write_bytes(folder / "open.obj", obj);
  for (const bool from_cache : {false, true}) {
    const ProgramResult result = folder.run({"--no-render"});
    ASSERT_EQ(result.code, 0) << result.told();
    const Json report = folder.report();
    EXPECT_EQ(report["organs"][0]["cache_hit"], from_cache) << report["organs"];
    ASSERT_FALSE(report["warnings"].empty()) << report;
    EXPECT_NE(report["warnings"][0].get<std::string>().find(
                  "ball: wrapped at voxels of 1.5 mm: distance from the original at most "),
              std::string::npos)
        << report["warnings"];
  }
  const ProgramResult check = folder.check();
  EXPECT_NE(check.out.find("\nball: wrapped at voxels of 1.5 mm"), std::string::npos)
      << check.told();

  // Without the key the surface is refused, and the key named.
  scene["organs"][0]["geometry"].erase("wrap");
  folder.write(scene.dump());
  expect_refused(folder.run(), {"open.obj: open: ", "\"wrap\""});
}

TEST(ImportedScene, OfThreeOrgansFromTheDataFoldersMapRuns) {
  const auto map = shared_data("labelmap/example_seg.nii.gz");
  if (!map) GTEST_SKIP() << "the data folder is absent";
  const TemporaryFolder folder;
  const ProgramResult imported =
      import({map->string(), "--unit", "mm", "--label", "5,6,4", "--name",
              "liver,stomach,gallbladder", "--out", (folder / "organs").string()});
  ASSERT_EQ(imported.code, 0) << imported.told();

  const Json report =
      run_shipped_scene("label_map_palpation", folder,
                        {"--assets", (folder / "organs").string(), "--duration", "1.0"});
  ASSERT_FALSE(report.is_null());
  EXPECT_EQ(report["organs"].size(), 3u);
  EXPECT_EQ(report["complete"], true);
}

}  // namespace
}  // namespace viscera::test
