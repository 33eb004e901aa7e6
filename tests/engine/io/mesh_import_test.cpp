#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <fstream>
#include <sstream>

#include "engine/io/foreign_files.h"
#include "kernels/points/surface_checks.h"
#include "tests/support/paths.h"
#include "tests/support/shapes.h"

namespace viscera::test {
namespace {

namespace fs = std::filesystem;

template <class T>
void put(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

std::string obj(const TriangleSurface& surface) {
  std::ostringstream out;
  for (const Vec3& x : surface.vertices) out << "v " << x.transpose() << "\n";
  for (const auto& [a, b, c] : surface.triangles) {
    out << "f " << a + 1 << " " << b + 1 << " " << c + 1 << "\n";
  }
  return out.str();
}

std::string binary_stl(const TriangleSurface& surface) {
  std::string bytes(80, ' ');
  put(bytes, static_cast<std::uint32_t>(surface.triangles.size()));
  for (const auto& triangle : surface.triangles) {
    for (int i = 0; i < 3; ++i) put(bytes, 0.0f);
    for (const int v : triangle) {
      for (int i = 0; i < 3; ++i) put(bytes, static_cast<float>(surface.vertices[v][i]));
    }
    put(bytes, std::uint16_t{0});
  }
  return bytes;
}

std::string text_stl(const TriangleSurface& surface) {
  std::ostringstream out;
  out << "solid thing\n";
  for (const auto& triangle : surface.triangles) {
    out << "facet normal 0 0 0\nouter loop\n";
    for (const int v : triangle) {
      out << "vertex " << surface.vertices[v].cast<float>().transpose() << "\n";
    }
    out << "endloop\nendfacet\n";
  }
  out << "endsolid thing\n";
  return out.str();
}

std::string ply(const TriangleSurface& surface, bool with_faces = true) {
  std::ostringstream out;
  out << "ply\nformat ascii 1.0\nelement vertex " << surface.vertices.size()
      << "\nproperty float x\nproperty float y\nproperty float z\n";
  if (with_faces) {
    out << "element face " << surface.triangles.size()
        << "\nproperty list uchar int vertex_indices\n";
  }
  out << "end_header\n";
  for (const Vec3& x : surface.vertices) out << x.transpose() << "\n";
  if (!with_faces) return out.str();
  for (const auto& [a, b, c] : surface.triangles) out << "3 " << a << " " << b << " " << c << "\n";
  return out.str();
}

// Two nodes, the inner one with this transform (column-major).
std::string glb(const TriangleSurface& surface, const std::string& matrix) {
  std::string data;
  for (const Vec3& x : surface.vertices) {
    for (int i = 0; i < 3; ++i) put(data, static_cast<float>(x[i]));
  }
  const std::size_t positions = data.size();
  for (const auto& triangle : surface.triangles) {
    for (const int v : triangle) put(data, static_cast<std::uint32_t>(v));
  }
  const Vec3 low = bounds(surface).min(), high = bounds(surface).max();
  const Eigen::IOFormat list(Eigen::FullPrecision, Eigen::DontAlignCols, ",", ",", "", "", "[",
                             "]");
  std::ostringstream json;
  json << R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[)"
       << R"({"children":[1],"translation":[10,0,0]},{"mesh":0,"matrix":)" << matrix << "}],"
       << R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],)"
       << R"("buffers":[{"byteLength":)" << data.size() << R"(}],"bufferViews":[)"
       << R"({"buffer":0,"byteOffset":0,"byteLength":)" << positions << R"(},)"
       << R"({"buffer":0,"byteOffset":)" << positions << R"(,"byteLength":)"
       << data.size() - positions << R"(}],"accessors":[{"bufferView":0,"componentType":5126,)"
       << R"("count":)" << surface.vertices.size() << R"(,"type":"VEC3","min":)"
       << low.transpose().format(list) << R"(,"max":)" << high.transpose().format(list) << R"(},)"
       << R"({"bufferView":1,"componentType":5125,"count":)" << 3 * surface.triangles.size()
       << R"(,"type":"SCALAR"}]})";
  std::string text = json.str();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  std::string bytes = "glTF";
  put(bytes, std::uint32_t{2});
  put(bytes, static_cast<std::uint32_t>(12 + 8 + text.size() + 8 + data.size()));
  put(bytes, static_cast<std::uint32_t>(text.size()));
  bytes += "JSON" + text;
  put(bytes, static_cast<std::uint32_t>(data.size()));
  bytes += std::string("BIN\0", 4) + data;
  return bytes;
}

class MeshImport : public testing::Test {
 protected:
  Result<TriangleSurface> import(const std::string& name, const std::string& bytes,
                                 double unit = 1.0) {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return import_surface(folder_ / name, unit);
  }

  void expect_refused(const std::string& name, const std::string& bytes,
                      const std::string& reason) {
    const auto surface = import(name, bytes);
    ASSERT_FALSE(surface) << name;
    const std::string text = surface.error().text();
    EXPECT_NE(text.find(name + ": "), std::string::npos) << text;
    EXPECT_NE(text.find(reason), std::string::npos) << text;
    EXPECT_EQ(surface.error().messages.size(), 1u);
  }

  TemporaryFolder folder_;
  TriangleSurface ball_ = icosphere(2.0, 2);
};

TEST_F(MeshImport, EveryFormatGivesTheSameClosedSurface) {
  const std::string identity = "[1,0,0,0, 0,1,0,0, 0,0,1,0, -10,0,0,1]";
  for (const auto& [name, bytes] : {std::pair{"ball.obj", obj(ball_)},
                                    {"ball.stl", binary_stl(ball_)},
                                    {"text.STL", text_stl(ball_)},
                                    {"ball.ply", ply(ball_)},
                                    {"ball.glb", glb(ball_, identity)}}) {
    const auto surface = import(name, bytes, 0.01);
    ASSERT_TRUE(surface) << surface.error().text();
    EXPECT_EQ(surface->vertices.size(), ball_.vertices.size()) << name;
    EXPECT_EQ(surface->triangles.size(), ball_.triangles.size()) << name;
    EXPECT_TRUE(surface_defects(*surface).empty()) << name;
    EXPECT_NEAR(volume(*surface), 1e-6 * volume(ball_), 1e-5 * 1e-6 * volume(ball_)) << name;
    EXPECT_NEAR(bounds(*surface).max().x(), 0.02, 1e-3) << name;
  }
}

TEST_F(MeshImport, NodeTransformsAreAppliedAndMirrorsTurnTrianglesOver) {
  // Mirrored in x, doubled, and moved by 10 by its parent.
  const auto surface = import("ball.glb", glb(ball_, "[-2,0,0,0, 0,2,0,0, 0,0,2,0, 0,0,5,1]"));
  ASSERT_TRUE(surface) << surface.error().text();
  EXPECT_TRUE(surface_defects(*surface).empty());
  EXPECT_NEAR(volume(*surface), 8.0 * volume(ball_), 1e-3 * volume(ball_));
  EXPECT_TRUE(bounds(*surface).center().isApprox(Vec3(10, 0, 5), 1e-4));
}

TEST_F(MeshImport, PolygonsBecomeTriangles) {
  const auto surface = import("cube.obj",
                              "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\n"
                              "v 0 1 1\nf 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\n"
                              "f 4 1 5 8\n");
  ASSERT_TRUE(surface) << surface.error().text();
  EXPECT_EQ(surface->triangles.size(), 12u);
  EXPECT_EQ(surface->vertices.size(), 8u);
  EXPECT_NEAR(volume(*surface), 1.0, 1e-6);
}

TEST_F(MeshImport, FilesThatArentThereOrArentSurfacesAreRefused) {
  const auto missing = import_surface(folder_ / "absent.obj", 1.0);
  ASSERT_FALSE(missing);
  EXPECT_NE(missing.error().text().find("absent.obj: found no such file"), std::string::npos);
  fs::create_directory(folder_ / "folder.obj");
  const auto folder = import_surface(folder_ / "folder.obj", 1.0);
  ASSERT_FALSE(folder);
  EXPECT_NE(folder.error().text().find("found a folder, expected a surface"), std::string::npos);
  expect_refused("ball.fbx", obj(ball_), "expected OBJ, STL, PLY, glTF or GLB");
  for (const char* name : {"e.obj", "e.stl", "e.ply", "e.gltf", "e.glb"}) {
    expect_refused(name, "", "found an empty file");
  }
}

TEST_F(MeshImport, EnormousFilesAreRefusedBySize) {
  // Sparse: takes no room on the disk.
  std::ofstream(folder_ / "huge.stl") << "x";
  std::error_code failed;
  fs::resize_file(folder_ / "huge.stl", 3ull << 30, failed);
  if (failed) GTEST_SKIP() << "no sparse files here: " << failed.message();
  const auto surface = import_surface(folder_ / "huge.stl", 1.0);
  ASSERT_FALSE(surface);
  EXPECT_NE(surface.error().text().find("found 3221225472 bytes, expected at most 2147483648"),
            std::string::npos);
}

TEST_F(MeshImport, TruncatedFilesAreRefused) {
  const auto half = [](const std::string& bytes) { return bytes.substr(0, bytes.size() / 2); };
  expect_refused("half.stl", half(binary_stl(ball_)), "the file looks truncated");
  expect_refused("head.stl", binary_stl(ball_).substr(0, 70), "84 bytes");
  expect_refused("half.glb", half(glb(ball_, "[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]")),
                 "cannot be read");
  expect_refused("half.gltf", R"({"asset": {"version": "2.0"}, "nodes": [)", "cannot be read");
  expect_refused("half.ply", half(ply(ball_)), "truncated");
  // Text formats don't say where they end: what is left is an open surface.
  for (const char* name : {"half.obj", "half_text.stl"}) {
    const bool is_obj = std::string(name) == "half.obj";
    std::string bytes = is_obj ? obj(ball_) : text_stl(ball_);
    bytes.resize(bytes.size() * 9 / 10);
    const auto surface = import(name, bytes);
    EXPECT_TRUE(!surface || !surface_defects(*surface).empty()) << name;
  }
}

TEST_F(MeshImport, BinaryGarbageIsRefused) {
  std::string garbage;
  for (int i = 0; i < 5000; ++i) garbage += static_cast<char>((i * 7919 + i * i * 31) >> 3);
  for (const auto& [name, reason] : {std::pair{"g.obj", "found no triangles"},
                                     {"g.stl", "the file looks truncated"},
                                     {"g.ply", "expected ply"},
                                     {"g.gltf", "cannot be read as gltf"},
                                     {"g.glb", "cannot be read as glb"}}) {
    expect_refused(name, garbage, reason);
  }
}

TEST_F(MeshImport, PointsAloneAreRefused) {
  expect_refused("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n", "found no triangles");
  expect_refused("points.ply", ply(ball_, false), "found no triangles");
  expect_refused("lines.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nl 1 2\nl 2 3\n", "no triangles");
}

TEST_F(MeshImport, NumbersThatArentFiniteAreRefused) {
  expect_refused("nan.obj", "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
                 "found a coordinate that isn't a finite number");
  expect_refused("point.obj", "v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n", "at one place");
}

}  // namespace
}  // namespace viscera::test
