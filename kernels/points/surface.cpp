#include "kernels/points/surface.h"

#include <algorithm>
#include <cmath>

namespace viscera {

namespace {

std::array<Vec3, 3> corners(const TriangleSurface& surface, int triangle) {
  const std::array<int, 3>& t = surface.triangles[triangle];
  return {surface.vertices[t[0]], surface.vertices[t[1]], surface.vertices[t[2]]};
}

}  // namespace

Box bounds(const TriangleSurface& surface) {
  Box box;
  for (const Vec3& vertex : surface.vertices) box.extend(vertex);
  return box;
}

Vec3 area_vector(const TriangleSurface& surface, int triangle) {
  const auto [a, b, c] = corners(surface, triangle);
  return 0.5 * (b - a).cross(c - a);
}

double area(const TriangleSurface& surface) {
  double sum = 0.0;
  for (int t = 0; t < static_cast<int>(surface.triangles.size()); ++t) {
    sum += area_vector(surface, t).norm();
  }
  return sum;
}

double volume(const TriangleSurface& surface) {
  if (surface.empty()) return 0.0;
  // Tetrahedra against a point of the surface: against a far origin the terms would cancel badly.
  const Vec3 apex = surface.vertices[surface.triangles.front()[0]];
  double sum = 0.0;
  for (int t = 0; t < static_cast<int>(surface.triangles.size()); ++t) {
    sum += area_vector(surface, t).dot(corners(surface, t)[0] - apex) / 3.0;
  }
  return sum;
}

std::vector<Vec3> vertex_normals(const TriangleSurface& surface) {
  std::vector<Vec3> normals(surface.vertices.size(), Vec3::Zero());
  for (int t = 0; t < static_cast<int>(surface.triangles.size()); ++t) {
    const std::array<Vec3, 3> p = corners(surface, t);
    const Vec3 normal = area_vector(surface, t).normalized();
    for (int i = 0; i < 3; ++i) {
      const Vec3 u = p[(i + 1) % 3] - p[i];
      const Vec3 v = p[(i + 2) % 3] - p[i];
      normals[surface.triangles[t][i]] += std::atan2(u.cross(v).norm(), u.dot(v)) * normal;
    }
  }
  for (Vec3& normal : normals) normal.normalize();
  return normals;
}

std::vector<double> vertex_areas(const TriangleSurface& surface) {
  std::vector<double> areas(surface.vertices.size(), 0.0);
  for (int t = 0; t < static_cast<int>(surface.triangles.size()); ++t) {
    const double third = area_vector(surface, t).norm() / 3.0;
    for (const int vertex : surface.triangles[t]) areas[vertex] += third;
  }
  return areas;
}

Vec3 position(const TriangleSurface& surface, const SurfacePoint& point) {
  const auto [a, b, c] = corners(surface, point.triangle);
  return point.weights[0] * a + point.weights[1] * b + point.weights[2] * c;
}

TriangleSurface with_used_vertices(const TriangleSurface& surface) {
  TriangleSurface used;
  std::vector<int> numbers(surface.vertices.size(), -1);
  for (std::array<int, 3> triangle : surface.triangles) {
    for (int& corner : triangle) {
      int& number = numbers[static_cast<std::size_t>(corner)];
      if (number < 0) {
        number = static_cast<int>(used.vertices.size());
        used.vertices.push_back(surface.vertices[static_cast<std::size_t>(corner)]);
      }
      corner = number;
    }
    used.triangles.push_back(triangle);
  }
  return used;
}

}  // namespace viscera
