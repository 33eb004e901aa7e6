#include "engine/io/mesh_export.h"

#include <gtest/gtest.h>

#include <fstream>

#include "engine/io/foreign_files.h"
#include "tests/support/paths.h"
#include "tests/support/shapes.h"

namespace viscera::test {
namespace {

TEST(MeshExport, AnObjComesBackAsItWas) {
  const TriangleSurface ball = icosphere(0.03, 2);
  const TemporaryFolder folder;
  const std::string text = obj_text(ball, "two lines\nabout it");
  EXPECT_TRUE(text.starts_with("# written by viscera; unit: mm\n# two lines\n# about it\n"));
  std::ofstream(folder / "ball.obj") << text;
  const auto back = import_surface(folder / "ball.obj", 1e-3);
  ASSERT_TRUE(back) << back.error().text();
  ASSERT_EQ(back->triangles.size(), ball.triangles.size());
  EXPECT_NEAR(volume(*back) / volume(ball), 1.0, 1e-4);
}

TEST(MeshExport, NodesAreListedWithSpacingAndSide) {
  PointCloud cloud;
  cloud.positions = {Vec3(1e-3, 2e-3, 3e-3), Vec3(0, 0, -4e-3)};
  cloud.spacings = {5e-3, 6e-3};
  cloud.surface_count = 1;
  const std::string text = nodes_ply_text(cloud);
  EXPECT_NE(text.find("element vertex 2\n"), std::string::npos);
  EXPECT_NE(text.find("\n1.0000 2.0000 3.0000 5.0000 1\n0.0000 0.0000 -4.0000 6.0000 0\n"),
            std::string::npos)
      << text;
}

}  // namespace
}  // namespace viscera::test
