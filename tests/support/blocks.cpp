#include "tests/support/blocks.h"

namespace viscera::test {

TriangleSurface leaves(const Vec3& size, double gap, double root, double step) {
  std::vector<double> x = lines(-root, 0.0, step),
                      z = lines(-0.5 * gap - size.z(), -0.5 * gap, step);
  const std::vector<double> along = lines(0.0, size.x(), step);
  x.insert(x.end(), along.begin() + 1, along.end());
  const std::vector<double> above = lines(0.5 * gap, 0.5 * gap + size.z(), step);
  z.insert(z.end(), above.begin(), above.end());
  return bricks(x, lines(-0.5 * size.y(), 0.5 * size.y(), step), z,
                [&](const Vec3& at) { return at.x() < 0.0 || std::abs(at.z()) > 0.5 * gap; });
}

TriangleSurface two_cubes(double edge, double gap, int divisions) {
  const double step = edge / divisions;
  std::vector<double> x = lines(-edge, 0.0, step);
  const std::vector<double> other = lines(gap, gap + edge, step);
  x.insert(x.end(), other.begin(), other.end());
  const std::vector<double> across = lines(-0.5 * edge, 0.5 * edge, step);
  return bricks(x, across, across, [&](const Vec3& at) { return at.x() < 0.0 || at.x() > gap; });
}

}  // namespace viscera::test
