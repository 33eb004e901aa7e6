#include "engine/organ/built_in_bodies.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "engine/organ/mesh_editor.h"

namespace viscera {
namespace {

constexpr double kPi = std::numbers::pi;

// Area of an equilateral triangle of edge 1.
const double kEquilateral = std::sqrt(3.0) / 4.0;

double edge_for(double area, int triangles) {
  return std::sqrt(area / (triangles * kEquilateral));
}

Result<TriangleSurface> with_exact_count(const TriangleSurface& surface, int triangles,
                                         Projection projection, bool creases) {
  MeshEditor mesh(surface, std::move(projection), creases);
  if (!reach_triangle_count(mesh, triangles)) {
    return failure("found a body that can't be made of " + std::to_string(triangles) +
                   " triangles, expected more of them");
  }
  return mesh.surface();
}

// The icosahedron with every edge divided into `frequency` parts, pushed onto the sphere.
TriangleSurface geodesic_sphere(double radius, int frequency) {
  const double g = 0.5 * (1.0 + std::sqrt(5.0));
  const std::array<Vec3, 12> corners = {{{-1, g, 0},
                                         {1, g, 0},
                                         {-1, -g, 0},
                                         {1, -g, 0},
                                         {0, -1, g},
                                         {0, 1, g},
                                         {0, -1, -g},
                                         {0, 1, -g},
                                         {g, 0, -1},
                                         {g, 0, 1},
                                         {-g, 0, -1},
                                         {-g, 0, 1}}};
  constexpr std::array<std::array<int, 3>, 20> kFaces = {
      {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
       {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
       {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}}};
  TriangleSurface sphere;
  // A vertex is the weights that it gives to the icosahedron's corners.
  std::map<std::vector<std::pair<int, int>>, int> numbers;
  for (const auto& face : kFaces) {
    const auto vertex = [&](int i, int j) {
      const std::array<int, 3> weights = {frequency - i - j, i, j};
      std::vector<std::pair<int, int>> key;
      Vec3 x = Vec3::Zero();
      for (int c = 0; c < 3; ++c) {
        if (weights[c] > 0) key.emplace_back(face[c], weights[c]);
        x += weights[c] * corners[face[c]];
      }
      std::sort(key.begin(), key.end());
      const auto [entry, fresh] = numbers.try_emplace(std::move(key), sphere.vertices.size());
      if (fresh) sphere.vertices.push_back(radius * x.normalized());
      return entry->second;
    };
    for (int i = 0; i < frequency; ++i) {
      for (int j = 0; i + j < frequency; ++j) {
        sphere.triangles.push_back({vertex(i, j), vertex(i + 1, j), vertex(i, j + 1)});
        if (i + j + 1 < frequency) {
          sphere.triangles.push_back({vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)});
        }
      }
    }
  }
  return sphere;
}

// Vertices on a circle about the z axis, numbered from `first`, turned by `start` [rad].
struct Ring {
  int first, count;
  double start;

  int vertex(int i) const { return first + i % count; }
  double angle(int i) const { return start + 2.0 * kPi * i / count; }
};

// A strip of triangles between two rings, outward when `outer` is further along the surface that
// turns counter-clockwise; a ring of one vertex is a pole.
void stitch(const Ring& inner, const Ring& outer, bool flip, TriangleSurface& surface) {
  const auto add = [&](int a, int b, int c) {
    if (flip) std::swap(b, c);
    surface.triangles.push_back({a, b, c});
  };
  int i = 0, o = 0;
  const int inner_steps = inner.count == 1 ? 0 : inner.count;
  while (i < inner_steps || o < outer.count) {
    // Advance on the ring whose next vertex comes first.
    const bool outer_next =
        o < outer.count && (i == inner_steps || outer.angle(o) + outer.angle(o + 1) <=
                                                    inner.angle(i) + inner.angle(i + 1));
    if (outer_next) {
      add(inner.vertex(i), outer.vertex(o), outer.vertex(o + 1));
      ++o;
    } else {
      add(inner.vertex(i), outer.vertex(o), inner.vertex(i + 1));
      ++i;
    }
  }
}

TriangleSurface ringed_hemisphere(double radius, double edge) {
  TriangleSurface surface;
  const double row = std::sqrt(3.0) / 2.0 * edge;
  const auto add_ring = [&](double r, double z, int number) {
    const int count = std::max(6, static_cast<int>(std::lround(2.0 * kPi * r / edge)));
    const Ring ring{static_cast<int>(surface.vertices.size()), count,
                    number % 2 == 0 ? 0.0 : kPi / count};
    for (int i = 0; i < count; ++i) {
      surface.vertices.emplace_back(r * std::cos(ring.angle(i)), r * std::sin(ring.angle(i)), z);
    }
    return ring;
  };
  const Ring rim = add_ring(radius, 0.0, 0);
  // From a centre to the rim, over the dome and then over the base.
  for (const bool base : {false, true}) {
    const double span = base ? radius : 0.5 * kPi * radius;
    const int rows = std::max(2, static_cast<int>(std::lround(span / row)));
    Ring ring{static_cast<int>(surface.vertices.size()), 1, 0.0};
    surface.vertices.emplace_back(0.0, 0.0, base ? 0.0 : radius);
    for (int k = 1; k <= rows; ++k) {
      const double share = static_cast<double>(k) / rows, polar = 0.5 * kPi * share;
      const Ring next =
          k == rows ? rim
          : base    ? add_ring(radius * share, 0.0, rows - k)
                    : add_ring(radius * std::sin(polar), radius * std::cos(polar), rows - k);
      stitch(ring, next, base, surface);
      ring = next;
    }
  }
  return surface;
}

TriangleSurface divided_block(const Vec3& size, double edge) {
  const Eigen::Vector3i parts = (size / edge).array().round().cast<int>().max(1);
  TriangleSurface surface;
  std::map<std::array<int, 3>, int> numbers;
  const auto vertex = [&](const Eigen::Vector3i& at) {
    const auto [entry, fresh] = numbers.try_emplace({at[0], at[1], at[2]}, surface.vertices.size());
    if (fresh) {
      const Vec3 share = at.cast<double>().cwiseQuotient(parts.cast<double>());
      surface.vertices.push_back((share - Vec3::Constant(0.5)).cwiseProduct(size));
    }
    return entry->second;
  };
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (const bool high : {false, true}) {
      for (int i = 0; i < parts[u]; ++i) {
        for (int j = 0; j < parts[v]; ++j) {
          const auto corner = [&](int di, int dj) {
            Eigen::Vector3i at;
            at[axis] = high ? parts[axis] : 0;
            at[u] = i + di;
            at[v] = j + dj;
            return vertex(at);
          };
          std::array<int, 4> square = {corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)};
          if (!high) std::swap(square[1], square[3]);
          // Diagonals alternate, so that the mesh favours no direction.
          const int k = (i + j) % 2;
          surface.triangles.push_back({square[k], square[k + 1], square[(k + 2) % 4]});
          surface.triangles.push_back({square[k], square[(k + 2) % 4], square[(k + 3) % 4]});
        }
      }
    }
  }
  return surface;
}

}  // namespace

Result<TriangleSurface> sphere_surface(double radius, double edge, std::optional<int> triangles) {
  const double area = 4.0 * kPi * radius * radius;
  if (!triangles) {
    const double frequency = std::sqrt(area / (20.0 * kEquilateral)) / edge;
    return geodesic_sphere(radius, std::max(1, static_cast<int>(std::lround(frequency))));
  }
  const int frequency = static_cast<int>(std::sqrt(*triangles / 20.0));
  return with_exact_count(
      geodesic_sphere(radius, frequency), *triangles,
      [radius](const Vec3& x) -> Vec3 { return radius * x.normalized(); }, false);
}

Result<TriangleSurface> hemisphere_surface(double radius, double edge,
                                           std::optional<int> triangles) {
  const auto projection = [radius](const Vec3& x) -> Vec3 {
    if (x.z() < 1e-6 * radius) return {x.x(), x.y(), 0.0};
    return radius * x.normalized();
  };
  if (triangles) edge = edge_for(3.0 * kPi * radius * radius, *triangles);
  const TriangleSurface rings = ringed_hemisphere(radius, edge);
  if (triangles) return with_exact_count(rings, *triangles, projection, true);
  MeshEditor mesh(rings, projection, true);
  settle(mesh, 5);
  return mesh.surface();
}

Result<TriangleSurface> block_surface(const Vec3& size, double edge, std::optional<int> triangles) {
  if (!triangles) return divided_block(size, edge);
  const double area = 2.0 * (size.x() * size.y() + size.y() * size.z() + size.z() * size.x());
  // Right-angled triangles: two a square. Coarser until splits alone can reach the number.
  edge = std::sqrt(2.0 * area / *triangles);
  TriangleSurface block = divided_block(size, edge);
  while (static_cast<int>(block.triangles.size()) > *triangles) {
    edge *= 1.02;
    block = divided_block(size, edge);
  }
  return with_exact_count(
      block, *triangles, [](const Vec3& x) { return x; }, true);
}

}  // namespace viscera
