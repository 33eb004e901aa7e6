#include "kernels/points/closed_pieces.h"

#include <gtest/gtest.h>

#include "tests/support/shapes.h"

namespace viscera {
namespace {

/// Appends a surface, moved, its triangles turned around where `hollow`.
void append(TriangleSurface& to, const TriangleSurface& from, const Vec3& by, bool hollow = false) {
  const int first = static_cast<int>(to.vertices.size());
  for (const Vec3& v : from.vertices) to.vertices.push_back(v + by);
  for (const auto& [a, b, c] : from.triangles)
    to.triangles.push_back({first + a, first + (hollow ? c : b), first + (hollow ? b : c)});
}

TEST(ClosedPieces, OfOneBodyAreThatBody) {
  const TriangleSurface cube = test::cube(1.0, 2);
  const auto pieces = closed_pieces(cube);
  ASSERT_EQ(pieces.size(), 1u);
  EXPECT_EQ(pieces[0].triangles, cube.triangles);
}

TEST(ClosedPieces, AreSeparateBodiesWithTheirHollows) {
  TriangleSurface surface;
  append(surface, test::cube(2.0, 2), Vec3::Zero());
  append(surface, test::cube(4.0, 2), Vec3(5.0, 0.0, 0.0));
  append(surface, test::cube(1.0, 2), Vec3(5.0, 0.0, 0.0), true);
  const auto pieces = closed_pieces(surface);
  ASSERT_EQ(pieces.size(), 2u);
  EXPECT_NEAR(volume(pieces[0]), 8.0, 1e-12);
  EXPECT_NEAR(volume(pieces[1]), 63.0, 1e-12);
}

TEST(ClosedPieces, AreOneWherePartsAreOpen) {
  TriangleSurface surface;
  append(surface, test::cube(2.0, 2), Vec3::Zero());
  append(surface, test::cube(2.0, 2), Vec3(5.0, 0.0, 0.0));
  surface.triangles.pop_back();
  const auto pieces = closed_pieces(surface);
  ASSERT_EQ(pieces.size(), 1u);
  EXPECT_EQ(pieces[0].triangles, surface.triangles);
}

}  // namespace
}  // namespace viscera
