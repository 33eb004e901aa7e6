#include "tests/support/shapes.h"

#include <cmath>
#include <map>
#include <utility>

namespace viscera::test {

TriangleSurface icosphere(double radius, int subdivisions) {
  const double g = 0.5 * (1.0 + std::sqrt(5.0));
  TriangleSurface sphere;
  sphere.vertices = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                     {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  sphere.triangles = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                      {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                      {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                      {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  for (int level = 0; level < subdivisions; ++level) {
    std::map<std::pair<int, int>, int> middles;
    const auto middle = [&](int a, int b) {
      const auto [entry, fresh] =
          middles.try_emplace(std::minmax(a, b), static_cast<int>(sphere.vertices.size()));
      if (fresh) {
        const Vec3 sum = sphere.vertices[a].normalized() + sphere.vertices[b].normalized();
        sphere.vertices.push_back(sum);
      }
      return entry->second;
    };
    std::vector<std::array<int, 3>> finer;
    for (const auto& [a, b, c] : sphere.triangles) {
      const int ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    sphere.triangles = std::move(finer);
  }
  for (Vec3& vertex : sphere.vertices) vertex *= radius / vertex.norm();
  return sphere;
}

TriangleSurface box(const Vec3& edges, int divisions) {
  TriangleSurface surface;
  std::map<std::array<int, 3>, int> vertex_at;
  const auto vertex = [&](const Eigen::Vector3i& at) {
    const auto [entry, fresh] =
        vertex_at.try_emplace({at[0], at[1], at[2]}, static_cast<int>(surface.vertices.size()));
    if (fresh) {
      const Vec3 share = at.cast<double>() / divisions - Vec3::Constant(0.5);
      surface.vertices.push_back(share.cwiseProduct(edges));
    }
    return entry->second;
  };
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3i u = Eigen::Vector3i::Unit((axis + 1) % 3);
    const Eigen::Vector3i v = Eigen::Vector3i::Unit((axis + 2) % 3);
    for (const int side : {0, divisions}) {
      for (int i = 0; i < divisions; ++i) {
        for (int j = 0; j < divisions; ++j) {
          const Eigen::Vector3i at = side * Eigen::Vector3i::Unit(axis) + i * u + j * v;
          const int a = vertex(at), b = vertex(at + u), c = vertex(at + u + v), d = vertex(at + v);
          if (side == 0) {
            surface.triangles.insert(surface.triangles.end(), {{a, c, b}, {a, d, c}});
          } else {
            surface.triangles.insert(surface.triangles.end(), {{a, b, c}, {a, c, d}});
          }
        }
      }
    }
  }
  return surface;
}

TriangleSurface cube(double edge, int n) {
  return box(Vec3::Constant(edge), n);
}

}  // namespace viscera::test
