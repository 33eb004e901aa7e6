#include <gtest/gtest.h>

#include <fstream>
#include <functional>

#include "engine/organ/shape.h"
#include "tests/engine/organ/shape_check.h"
#include "tests/support/paths.h"
#include "tests/support/shapes.h"

namespace viscera::test {
namespace {

void write_obj(const std::filesystem::path& file, const TriangleSurface& surface,
               double unit = 1e-3) {
  std::ofstream out(file);
  for (const Vec3& x : surface.vertices) out << "v " << (x / unit).transpose() << "\n";
  for (const auto& [a, b, c] : surface.triangles) {
    out << "f " << a + 1 << " " << b + 1 << " " << c + 1 << "\n";
  }
}

class FileShape : public testing::Test {
 protected:
  Result<TriangleSurface> build(const TriangleSurface& surface, double unit = 1e-3) {
    write_obj(folder_ / "thing.obj", surface);
    geometry_.file = folder_ / "thing.obj";
    geometry_.unit = unit;
    return build_shape(geometry_, project_file("assets"));
  }

  std::string refusal(const TriangleSurface& surface, double unit = 1e-3) {
    const auto built = build(surface, unit);
    if (built) return "";
    EXPECT_NE(built.error().text().find("thing.obj: "), std::string::npos);
    return built.error().text();
  }

  TemporaryFolder folder_;
  FileGeometry geometry_;
};

TEST_F(FileShape, ComesAsItIs) {
  const TriangleSurface ball = icosphere(0.04, 2);
  const auto built = build(ball);
  ASSERT_TRUE(built) << built.error().text();
  EXPECT_EQ(built->triangles.size(), ball.triangles.size());
  EXPECT_NEAR(volume(*built), volume(ball), 1e-4 * volume(ball));
}

TEST_F(FileShape, IsRecentredAndRefinedOnDemand) {
  TriangleSurface ball = icosphere(0.04, 2);
  for (Vec3& x : ball.vertices) x += Vec3(0.3, -0.2, 0.1);
  geometry_.recentre = true;
  geometry_.edge = 4e-3;
  const auto built = build(ball);
  ASSERT_TRUE(built) << built.error().text();
  EXPECT_TRUE(bounds(*built).center().isZero(1e-4));
  EXPECT_GT(built->triangles.size(), 4 * ball.triangles.size());
  EXPECT_GT(volume(*built), volume(ball));  // nearer to the round ball
  EXPECT_EQ(defects(*built), "");
}

TEST_F(FileShape, OpenSurfacesAreRefusedWithTheirFirstEdge) {
  TriangleSurface ball = icosphere(0.04, 1);
  ball.triangles.pop_back();
  const std::string text = refusal(ball);
  EXPECT_NE(text.find("open: 3 boundary edges, the first between vertices"), std::string::npos)
      << text;
}

TEST_F(FileShape, InsideOutSurfacesAreRefused) {
  TriangleSurface ball = icosphere(0.04, 1);
  for (auto& triangle : ball.triangles) std::swap(triangle[0], triangle[1]);
  EXPECT_NE(refusal(ball).find("inside-out"), std::string::npos);
}

TEST_F(FileShape, OneTurnedTriangleIsRefused) {
  TriangleSurface ball = icosphere(0.04, 1);
  std::swap(ball.triangles[7][0], ball.triangles[7][1]);
  EXPECT_NE(refusal(ball).find("orientation"), std::string::npos);
}

TEST_F(FileShape, ZeroAreaTrianglesAreRefused) {
  // A vertex in the middle of an edge: closed, but one of its triangles is flat.
  TriangleSurface block = cube(0.04, 1);
  const auto [a, b, c] = block.triangles[0];
  const int m = static_cast<int>(block.vertices.size());
  block.vertices.push_back(0.5 * (block.vertices[a] + block.vertices[b]));
  block.triangles[0] = {a, m, c};
  block.triangles.push_back({m, b, c});
  block.triangles.push_back({a, b, m});
  const std::string text = refusal(block);
  EXPECT_NE(text.find("zero area: 1 triangle"), std::string::npos) << text;
}

TEST_F(FileShape, DisconnectedSurfacesAreRefused) {
  TriangleSurface balls = icosphere(0.02, 1);
  const TriangleSurface other = balls;
  const int offset = static_cast<int>(balls.vertices.size());
  for (const Vec3& x : other.vertices) balls.vertices.push_back(x + Vec3(0.1, 0, 0));
  for (const auto& [a, b, c] : other.triangles) {
    balls.triangles.push_back({a + offset, b + offset, c + offset});
  }
  EXPECT_NE(refusal(balls).find("disconnected: 2 pieces"), std::string::npos);
}

TEST_F(FileShape, TheWrongUnitIsNoticedAndTheRightOneGuessed) {
  const std::string large = refusal(icosphere(0.05, 1), 1.0);
  EXPECT_NE(large.find("found a body of 100 m across, expected 1 mm to 2 m"), std::string::npos)
      << large;
  EXPECT_NE(large.find("did you mean unit \"mm\"?"), std::string::npos) << large;
  const std::string small = refusal(icosphere(50.0 * 1e-6, 1), 1e-3);
  EXPECT_NE(small.find("did you mean unit \"m\"?"), std::string::npos) << small;
}

TEST_F(FileShape, AnEdgeThatMakesMillionsOfTrianglesIsRefused) {
  geometry_.edge = 1e-6;
  EXPECT_NE(refusal(icosphere(0.05, 1)).find("expected at most 4e+06 triangles"),
            std::string::npos);
}

TEST_F(FileShape, OrgansOfTheVisibleHumanAreSoundAlsoWhenRefined) {
  struct Organ {
    const char* file;
    std::size_t triangles;
    double edge;
  };
  for (const auto& [name, triangles, edge] :
       {Organ{"kidney_left_1080.obj", 1080, 4e-3}, Organ{"liver_12k.obj", 0, 0.0},
        Organ{"gallbladder_800.obj", 0, 3e-3}}) {
    const auto file = shared_data(std::string("visible_human/") + name);
    if (!file) GTEST_SKIP() << name << " is absent";
    FileGeometry geometry;
    geometry.file = *file;
    geometry.unit = 1e-3;
    geometry.recentre = true;
    const auto plain = build_shape(geometry, project_file("assets"));
    ASSERT_TRUE(plain) << plain.error().text();
    if (triangles > 0) {
      EXPECT_EQ(plain->triangles.size(), triangles);
    }
    EXPECT_EQ(defects(*plain), "");
    geometry.edge = edge;
    const auto fine = build_shape(geometry, project_file("assets"));
    ASSERT_TRUE(fine) << fine.error().text();
    EXPECT_EQ(defects(*fine), "");
    EXPECT_NEAR(volume(*fine) / volume(*plain), 1.0, 0.03) << name;
  }
}

}  // namespace
}  // namespace viscera::test
