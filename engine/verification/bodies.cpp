#include "engine/verification/bodies.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include "kernels/base/random.h"
#include "kernels/points/node_placement.h"

namespace viscera {

TriangleSurface unit_cube(int divisions) {
  TriangleSurface surface;
  std::map<std::array<int, 3>, int> vertex_at;
  const auto vertex = [&](const std::array<int, 3>& lattice) {
    const auto [entry, fresh] =
        vertex_at.try_emplace(lattice, static_cast<int>(surface.vertices.size()));
    if (fresh) {
      surface.vertices.push_back(Vec3(lattice[0], lattice[1], lattice[2]) / divisions -
                                 Vec3::Constant(0.5));
    }
    return entry->second;
  };
  for (int axis = 0; axis < 3; ++axis) {
    for (const int side : {0, divisions}) {
      for (int i = 0; i < divisions; ++i) {
        for (int j = 0; j < divisions; ++j) {
          const auto corner = [&](int di, int dj) {
            std::array<int, 3> lattice{};
            lattice[static_cast<std::size_t>(axis)] = side;
            lattice[static_cast<std::size_t>((axis + 1) % 3)] = i + di;
            lattice[static_cast<std::size_t>((axis + 2) % 3)] = j + dj;
            return vertex(lattice);
          };
          const int a = corner(0, 0), b = corner(1, 0), c = corner(1, 1), d = corner(0, 1);
          if (side == 0) {
            surface.triangles.push_back({a, c, b});
            surface.triangles.push_back({a, d, c});
          } else {
            surface.triangles.push_back({a, b, c});
            surface.triangles.push_back({a, c, d});
          }
        }
      }
    }
  }
  return surface;
}

NodedBody jittered_cube(int cells, double jitter) {
  NodedBody body{unit_cube(2), {}};
  const Random random(7, 0);
  std::uint64_t draw = 0;
  for (const bool on_surface : {true, false}) {
    for (int k = 0; k <= cells; ++k) {
      for (int j = 0; j <= cells; ++j) {
        for (int i = 0; i <= cells; ++i) {
          Vec3 x(i, j, k);
          const bool outer = x.minCoeff() == 0.0 || x.maxCoeff() == cells;
          if (outer != on_surface) continue;
          for (int axis = 0; axis < 3; ++axis) {
            const double shift = jitter * (2.0 * random.uniform(draw++) - 1.0);
            if (x[axis] > 0.0 && x[axis] < cells) x[axis] += shift;
          }
          body.cloud.positions.push_back(x / cells - Vec3::Constant(0.5));
          body.cloud.surface_count += outer ? 1 : 0;
        }
      }
    }
  }
  body.cloud.spacings = measure_spacings(body.cloud.positions);
  return body;
}

TriangleSurface ringed_hemisphere(double radius, int rings) {
  TriangleSurface surface;
  // Ring i of a disc holds 6 i vertices; the dome and the base share the last ring.
  const auto first_of = [](int ring) { return ring == 0 ? 0 : 1 + 3 * ring * (ring - 1); };
  const int disc = first_of(rings + 1), rim = first_of(rings);
  const auto place = [&](int ring, int i, bool on_dome) -> Vec3 {
    const double angle = ring == 0 ? 0.0 : std::numbers::pi * i / (3.0 * ring);
    const double share = static_cast<double>(ring) / rings;
    const double polar = 0.5 * std::numbers::pi * share;
    const double r = radius * (on_dome ? std::sin(polar) : share);
    const bool at_rim = ring == rings;
    return {r * std::cos(angle), r * std::sin(angle),
            on_dome && !at_rim ? radius * std::cos(polar) : 0.0};
  };
  for (const bool on_dome : {true, false}) {
    for (int ring = 0; ring <= (on_dome ? rings : rings - 1); ++ring) {
      for (int i = 0; i < std::max(1, 6 * ring); ++i) {
        surface.vertices.push_back(place(ring, i, on_dome));
      }
    }
  }
  for (const bool on_dome : {true, false}) {
    const auto vertex = [&](int ring, int i) {
      const int at = first_of(ring) + (ring == 0 ? 0 : i % (6 * ring));
      return on_dome || at >= rim ? at : disc + at;
    };
    const auto add = [&](int a, int b, int c) {
      surface.triangles.push_back(on_dome ? std::array{a, b, c} : std::array{a, c, b});
    };
    for (int ring = 1; ring <= rings; ++ring) {
      for (int sector = 0; sector < 6; ++sector) {
        for (int i = 0; i < ring; ++i) {
          const int outer = sector * ring + i, inner = sector * (ring - 1) + i;
          add(vertex(ring - 1, inner), vertex(ring, outer), vertex(ring, outer + 1));
          if (i + 1 < ring) {
            add(vertex(ring - 1, inner), vertex(ring, outer + 1), vertex(ring - 1, inner + 1));
          }
        }
      }
    }
  }
  return surface;
}

std::vector<ContactCell> cap_cells(double radius, const CellPattern& pattern) {
  std::vector<ContactCell> cells;
  for (std::size_t k = 0; k < pattern.places.size(); ++k) {
    // Lambert's projection: a disc of radius 2 R sin(polar / 2) has the area of the cap.
    const double r = pattern.places[k].norm();
    const double polar = 2.0 * std::asin(r / (2.0 * radius));
    const Vec2 across = r > 0.0 ? Vec2(pattern.places[k] / r) : Vec2(Vec2::Zero());
    ContactCell cell;
    cell.normal = {std::sin(polar) * across.x(), std::sin(polar) * across.y(), std::cos(polar)};
    cell.position = radius * cell.normal;
    cell.area = pattern.areas[k];
    cell.direction = -cell.normal;
    cells.push_back(cell);
  }
  return cells;
}

}  // namespace viscera
