#include "tests/support/height_field.h"

namespace viscera::test {

TriangleSurface height_field(int squares, double side,
                             const std::function<double(double x, double y)>& height) {
  TriangleSurface surface;
  for (int j = 0; j <= squares; ++j)
    for (int i = 0; i <= squares; ++i) {
      const double x = side * (i - 0.5 * squares), y = side * (j - 0.5 * squares);
      surface.vertices.emplace_back(x, y, height(x, y));
    }
  for (int j = 0; j < squares; ++j)
    for (int i = 0; i < squares; ++i) {
      const int a = j * (squares + 1) + i, b = a + 1, d = a + squares + 1, c = d + 1;
      surface.triangles.push_back({a, b, c});
      surface.triangles.push_back({a, c, d});
    }
  return surface;
}

}  // namespace viscera::test
