// Files made to harm who reads them: each is refused in words, soon, and the process that asked
// goes on.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <chrono>
#include <cstring>
#include <fstream>

#include "engine/io/foreign_files.h"
#include "engine/io/label_map.h"
#include "tests/support/paths.h"

namespace viscera {
namespace {

namespace fs = std::filesystem;

class HostileFiles : public testing::Test {
 protected:
  /// On a busy machine; alone each takes less than two seconds beyond a second a MiB.
  static constexpr double kSlow_s = 30.0;

  void SetUp() override { begin = std::chrono::steady_clock::now(); }
  void TearDown() override {
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
    EXPECT_LT(took.count(), kSlow_s);
  }

  fs::path written(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder / name, std::ios::binary) << bytes;
    return folder / name;
  }
  static std::string refusal(const fs::path& file) {
    const auto surface = import_surface(file, 1e-3);
    return surface ? "" : surface.error().text();
  }
  /// Of a surface: with these words among the refusal's.
  void expect_refused(const fs::path& file, const char* words = "") const {
    const std::string text = refusal(file);
    EXPECT_NE(text.find(file.filename().string() + ": "), std::string::npos) << text;
    EXPECT_NE(text.find(words), std::string::npos) << text;
  }
  static std::string ply(int vertex) {
    return "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
           "property float z\nelement face 1\nproperty list uchar int vertex_indices\n"
           "end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 " +
           std::to_string(vertex) + "\n";
  }

  const test::TemporaryFolder temporary;
  const fs::path folder = temporary.path();
  std::chrono::steady_clock::time_point begin;
};

TEST_F(HostileFiles, ASoundSurfaceIsReadByTheChild) {
  const auto surface = import_surface(written("one.ply", ply(2)), 1e-3);
  ASSERT_TRUE(surface) << surface.error().text();
  EXPECT_EQ(surface->triangles.size(), 1u);
  EXPECT_EQ(surface->vertices.size(), 3u);
}

TEST_F(HostileFiles, FacesThatNameVerticesWhichAreNotThere) {
  for (const int vertex : {3, 70000, 2147483647, -1, -2147483647})
    expect_refused(written("face.ply", ply(vertex)), "cannot be read");
}

TEST_F(HostileFiles, APolygonOfVerticesWhichAreNotThere) {
  std::string polygon = ply(2);
  polygon.replace(polygon.find("3 0 1 2"), 7, "6 0 5 1 0 0 1");
  expect_refused(written("polygon.ply", polygon), "cannot be read");
}

TEST_F(HostileFiles, NodesInADeepNest) {
  std::string gltf = R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[)";
  constexpr int kDeep = 200000;
  for (int i = 0; i < kDeep; ++i) gltf += "{\"children\":[" + std::to_string(i + 1) + "]},";
  expect_refused(written("deep.gltf", gltf + "{}]}"));
}

TEST_F(HostileFiles, NodesInARing) {
  expect_refused(written(
      "ring.gltf",
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"children":[1]},{"children":[0]}]})"));
}

TEST_F(HostileFiles, BracketsInADeepNest) {
  expect_refused(written("nest.gltf", std::string(1 << 20, '[')));
  expect_refused(written("nest2.gltf", "{\"buffers\":" + std::string(1 << 20, '[')));
}

TEST_F(HostileFiles, AGltfOfVersionOneWithIndicesOutOfRange) {
  expect_refused(written(
      "old.gltf",
      R"({"asset":{"version":"1.0"},"scene":"s","scenes":{"s":{"nodes":["n"]}},"nodes":{"n":{"meshes":["m"]}},)"
      R"("meshes":{"m":{"primitives":[{"attributes":{"POSITION":"p"},"indices":"i","mode":4}]}},)"
      R"("accessors":{"p":{"bufferView":"v","byteOffset":0,"componentType":5126,"count":3,"type":"VEC3"},)"
      R"("i":{"bufferView":"w","byteOffset":0,"componentType":5123,"count":3,"type":"SCALAR"}},)"
      R"("bufferViews":{"v":{"buffer":"b","byteOffset":0,"byteLength":36},"w":{"buffer":"b","byteOffset":36,"byteLength":6}},)"
      R"("buffers":{"b":{"byteLength":42,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA//8BAP//"}}})"));
}

TEST_F(HostileFiles, BuffersThatLieElsewhere) {
  const auto gltf = [](const std::string& uri) {
    return R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":4,"uri":")" + uri + R"("}]})";
  };
  for (const std::string uri : {"../a.bin", "/etc/hostname", "/dev/zero"})
    expect_refused(written("buffer.gltf", gltf(uri)), "expected the name of a file in");
  expect_refused(written("nul.gltf", gltf("a\\u0000.bin")), "a NUL");
  ASSERT_EQ(::mkfifo((folder / "pipe.bin").c_str(), 0600), 0);
  const std::string text = refusal(written("pipe.gltf", gltf("pipe.bin")));
  EXPECT_NE(text.find("pipe.bin: found something other than a regular file"), std::string::npos)
      << text;
  fs::create_symlink("/dev/zero", folder / "zero.bin");
  expect_refused(written("zero.gltf", gltf("zero.bin")), "expected the name of a file in");
}

TEST_F(HostileFiles, MaterialsThatAreNoFiles) {
  ASSERT_EQ(::mkfifo((folder / "pipe.mtl").c_str(), 0600), 0);
  fs::create_symlink("/dev/zero", folder / "zero.mtl");
  for (const std::string name : {"pipe.mtl", "zero.mtl", "/dev/zero", "../../../dev/zero"}) {
    const auto file = written("m.obj", "mtllib " + name + "\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    // Colours don't matter: with or without them it ends.
    const auto surface = import_surface(file, 1e-3);
    EXPECT_TRUE(!surface || surface->triangles.size() == 1u) << name;
  }
}

TEST_F(HostileFiles, ManyGroupsAndLongLinesEndInTime) {
  std::string groups = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  for (int i = 0; i < 200000; ++i) groups += "g a" + std::to_string(i) + "\nf 1 2 3\n";
  (void)import_surface(written("groups.obj", groups), 1e-3);
  (void)import_surface(written("line.obj", "v " + std::string(8 << 20, '1') + "\n"), 1e-3);
  (void)import_surface(written("name.obj", "o " + std::string(8 << 20, 'x') + "\n"), 1e-3);
}

TEST_F(HostileFiles, CountsFarBeyondTheFile) {
  std::string many = ply(2);
  many.replace(many.find("vertex 3"), 8, "vertex 2000000000");
  expect_refused(written("many.ply", many));
  std::string stl(84, '\0');
  const std::uint32_t count = 0xffffffffu;
  std::memcpy(stl.data() + 80, &count, 4);
  expect_refused(written("many.stl", stl), "truncated");
}

TEST_F(HostileFiles, ASurfaceThatIsNoRegularFile) {
  ASSERT_EQ(::mkfifo((folder / "pipe.obj").c_str(), 0600), 0);
  fs::create_symlink("/dev/zero", folder / "zero.stl");
  expect_refused(folder / "pipe.obj", "found something other than a regular file");
  expect_refused(folder / "zero.stl", "found something other than a regular file");
}

TEST_F(HostileFiles, TheWordsOfAFileAreNotItsContents) {
  // As an importer tells what it couldn't parse: some beginning, never a whole secret.
  const std::string secret = "root:x:0:0:" + std::string(5000, 's');
  const std::string text = refusal(written("secret.obj", secret));
  EXPECT_FALSE(text.empty());
  EXPECT_LT(text.size(), 1000u);
  EXPECT_EQ(text.find("root:x:0:0"), std::string::npos) << text;
}

TEST_F(HostileFiles, ALabelMapOfVoxelsLongerThanWide) {
  std::string nrrd =
      "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: raw\n"
      "space: left-posterior-superior\nspace directions: (1e9,0,0) (0,1,0) (0,0,1)\n"
      "space units: \"um\" \"um\" \"um\"\nspace origin: (0,0,0)\n\n";
  nrrd += std::string("\1\1\1\1\1\1\1\1", 8);
  const auto map = read_label_map(written("long.nrrd", nrrd), {.unit = 1e-9});
  ASSERT_FALSE(map);
  EXPECT_NE(map.error().text().find("as long as wide"), std::string::npos) << map.error().text();
}

TEST_F(HostileFiles, ALabelMapWhoseVoxelsLieElsewhere) {
  const std::string header =
      "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: raw\n"
      "space: left-posterior-superior\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n"
      "space origin: (0,0,0)\ndata file: ";
  for (const std::string name : {"/dev/zero", "../x.raw", "/etc/hostname"}) {
    const auto map = read_label_map(written("far.nhdr", header + name + "\n"), {.unit = 0.1});
    ASSERT_FALSE(map) << name;
    EXPECT_NE(map.error().text().find("expected the name of a file in"), std::string::npos)
        << map.error().text();
  }
}

}  // namespace
}  // namespace viscera
