// Surface files that a scene refers to and that bound no body: refused with defect and place.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <limits>

#include "tests/support/shapes.h"
#include "tests/tools/tiny_scene.h"

namespace viscera::test {
namespace {

TriangleSurface ball() {
  return icosphere(15.0, 2);
}  // in the file's unit, millimetres

void write_obj(const std::filesystem::path& file, const TriangleSurface& surface) {
  std::ofstream out(file);
  for (const Vec3& v : surface.vertices)
    out << "v " << v.x() << ' ' << v.y() << ' ' << v.z() << '\n';
  for (const auto& t : surface.triangles)
    out << "f " << t[0] + 1 << ' ' << t[1] + 1 << ' ' << t[2] + 1 << '\n';
}

Json scene_with_file(const std::string& file) {
  Json scene = tiny_scene();
  scene["organs"][0]["geometry"] = {{"file", file}, {"unit", "mm"}};
  return scene;
}

/// `check` and `run` both refuse; `run` leaves no files.
void expect_file_refused(const SceneFolder& folder, const std::vector<std::string>& words) {
  expect_refused(folder.check(), words);
  expect_refused(folder.run({"--no-render"}), words);
  EXPECT_TRUE(files_of(folder.out(), ".json").empty());
  EXPECT_TRUE(files_of(folder.cache(), ".h5").empty());
  expect_whole_files(folder.out());
}

void expect_surface_refused(const TriangleSurface& surface, std::vector<std::string> words) {
  const SceneFolder folder(scene_with_file("organ.obj"));
  write_obj(folder / "organ.obj", surface);
  words.insert(words.begin(), {"organs/0 (\"ball\")", "organ.obj"});
  expect_file_refused(folder, words);
}

TEST(SurfaceFile, SoundOneRuns) {
  const SceneFolder folder(scene_with_file("organ.obj"));
  write_obj(folder / "organ.obj", ball());
  const ProgramResult result = folder.run({"--no-render"});
  ASSERT_EQ(result.code, 0) << result.told();
  EXPECT_EQ(folder.report()["organs"][0]["triangles"], 320);
}

TEST(SurfaceFile, ATipThatIsInsideOutIsRefused) {
  Json scene = tiny_scene();
  scene["instruments"][0]["tip"] = {{"shape", "mesh"}, {"file", "tip.obj"}, {"unit", "mm"}};
  const SceneFolder folder(scene);
  TriangleSurface tip = icosphere(1.5, 2);
  write_obj(folder / "tip.obj", tip);
  ASSERT_EQ(folder.run({"--no-render"}).code, 0);
  for (auto& triangle : tip.triangles) std::swap(triangle[0], triangle[1]);
  write_obj(folder / "tip.obj", tip);
  const ProgramResult result = folder.run({"--no-render"});
  expect_refused(result, {"tip.obj", "instrument \"hook\"", "inside-out", "counter-clockwise"});
}

TEST(SurfaceFile, OpenIsRefusedWithItsFirstEdge) {
  TriangleSurface surface = ball();
  surface.triangles.pop_back();
  expect_surface_refused(surface, {"open: 3 boundary edges, the first between vertices"});
}

TEST(SurfaceFile, InsideOutIsRefused) {
  TriangleSurface surface = ball();
  for (auto& t : surface.triangles) std::swap(t[1], t[2]);
  expect_surface_refused(surface, {"inside"});
}

TEST(SurfaceFile, ZeroAreaIsRefused) {
  // A corner moved to the middle of the opposite edge.
  TriangleSurface surface = cube(32.0, 2);
  const auto first = surface.triangles[0];
  surface.vertices[static_cast<std::size_t>(first[0])] =
      0.5 * (surface.vertices[static_cast<std::size_t>(first[1])] +
             surface.vertices[static_cast<std::size_t>(first[2])]);
  expect_surface_refused(surface, {"zero area: ", "the first is"});
}

TEST(SurfaceFile, DisconnectedIsRefused) {
  TriangleSurface surface = ball();
  const TriangleSurface other = ball();
  const int offset = static_cast<int>(surface.vertices.size());
  for (const Vec3& v : other.vertices) surface.vertices.push_back(v + Vec3(60, 0, 0));
  for (auto t : other.triangles) {
    for (int& corner : t) corner += offset;
    surface.triangles.push_back(t);
  }
  expect_surface_refused(surface, {"disconnected: 2 pieces"});
}

TEST(SurfaceFile, NonFiniteIsRefused) {
  TriangleSurface surface = ball();
  surface.vertices[5].x() = std::numeric_limits<double>::quiet_NaN();
  const SceneFolder folder(scene_with_file("organ.obj"));
  write_obj(folder / "organ.obj", surface);
  expect_file_refused(folder, {"organs/0 (\"ball\")", "organ.obj"});
}

class BrokenFile : public testing::TestWithParam<std::pair<const char*, const char*>> {};

TEST_P(BrokenFile, IsRefused) {
  const auto& [name, content] = GetParam();
  const SceneFolder folder(scene_with_file(name));
  std::ofstream(folder / name, std::ios::binary) << content;
  expect_file_refused(folder, {"organs/0 (\"ball\")", name});
}

INSTANTIATE_TEST_SUITE_P(
    Surface, BrokenFile,
    testing::Values(std::pair{"empty.obj", ""}, std::pair{"words.obj", "this is no surface\n"},
                    std::pair{"truncated.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"},
                    std::pair{"binary.stl", "\x7f\x45\x4c\x46\x01\x02\x03"},
                    std::pair{"binary.ply",
                              "ply\nformat binary_little_endian 1.0\nelement vertex "
                              "1000000\nproperty float x\nend_header\n\x01"},
                    std::pair{"truncated.glb", "glTF\x02"},
                    std::pair{"truncated.gltf", "{\"asset"}),
    [](const auto& file) {
      std::string name = file.param.first;
      std::replace(name.begin(), name.end(), '.', '_');
      return name;
    });

TEST(SurfaceFile, MissingSaysWhereItWasSought) {
  const SceneFolder folder(scene_with_file("spleen.obj"));
  expect_file_refused(folder, {"tiny.json: organs/0/geometry/file: found no file \"spleen.obj\"",
                               "expected it in one of"});
}

TEST(SurfaceFile, UnknownFormatIsRefused) {
  const SceneFolder folder(scene_with_file("organ.docx"));
  expect_file_refused(folder, {"organs/0/geometry/file: found", "organ.docx", "expected"});
}

}  // namespace
}  // namespace viscera::test
