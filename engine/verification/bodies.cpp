#include "engine/verification/bodies.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "kernels/base/random.h"
#include "kernels/points/node_placement.h"

namespace viscera {

TriangleSurface unit_cube(int divisions) {
  std::vector<double> line;
  for (int i = 0; i <= divisions; ++i) line.push_back(static_cast<double>(i) / divisions - 0.5);
  return lined_box(line, line, line);
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

TriangleSurface lined_box(const std::vector<double>& x, const std::vector<double>& y,
                          const std::vector<double>& z) {
  const std::vector<double>* lines[3] = {&x, &y, &z};
  TriangleSurface surface;
  std::map<std::array<std::size_t, 3>, int> vertex_at;
  const auto vertex = [&](const std::array<std::size_t, 3>& lattice) {
    const auto [entry, fresh] =
        vertex_at.try_emplace(lattice, static_cast<int>(surface.vertices.size()));
    if (fresh) surface.vertices.emplace_back(x[lattice[0]], y[lattice[1]], z[lattice[2]]);
    return entry->second;
  };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t first = (axis + 1) % 3, second = (axis + 2) % 3;
    for (const std::size_t side : {std::size_t{0}, lines[axis]->size() - 1}) {
      for (std::size_t i = 0; i + 1 < lines[first]->size(); ++i) {
        for (std::size_t j = 0; j + 1 < lines[second]->size(); ++j) {
          const auto corner = [&](std::size_t di, std::size_t dj) {
            std::array<std::size_t, 3> lattice{};
            lattice[axis] = side;
            lattice[first] = i + di;
            lattice[second] = j + dj;
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

TriangleSurface turned_surface(const std::vector<Vec2>& outline) {
  TriangleSurface surface;
  std::vector<int> first;   // vertex of each ring
  std::vector<int> counts;  // vertices in it
  for (std::size_t k = 0; k < outline.size(); ++k) {
    const bool on_axis = k == 0 || k + 1 == outline.size();
    const double step =
        on_axis
            ? 0.0
            : 0.5 * ((outline[k + 1] - outline[k]).norm() + (outline[k] - outline[k - 1]).norm());
    const double around = 2.0 * std::numbers::pi * outline[k].x();
    first.push_back(static_cast<int>(surface.vertices.size()));
    counts.push_back(on_axis ? 1 : 6 * std::max(1, static_cast<int>(around / (6.0 * step) + 0.5)));
    for (int i = 0; i < counts.back(); ++i) {
      const double angle = 2.0 * std::numbers::pi * i / counts.back();
      surface.vertices.emplace_back(outline[k].x() * std::cos(angle),
                                    outline[k].x() * std::sin(angle), outline[k].y());
    }
  }
  // Between two rings the next triangle stands on the one whose next vertex comes first.
  for (std::size_t k = 0; k + 1 < outline.size(); ++k) {
    const int upper = counts[k], lower = counts[k + 1];
    const auto at = [&](std::size_t ring, int i) { return first[ring] + i % counts[ring]; };
    int i = 0, j = 0;
    while (i < upper || j < lower) {
      const bool along_lower = upper == 1 || i == upper ||
                               (lower != 1 && j < lower && (j + 1) * upper <= (i + 1) * lower);
      if (along_lower && j < lower && lower > 1) {
        surface.triangles.push_back({at(k, i), at(k + 1, j), at(k + 1, j + 1)});
        ++j;
      } else if (i < upper && upper > 1) {
        surface.triangles.push_back({at(k, i), at(k + 1, j), at(k, i + 1)});
        ++i;
      } else {
        break;
      }
    }
  }
  return surface;
}

double nodal_error(const std::function<Vec3(const Vec3&)>& exact, const Formulation& formulation,
                   const PointCloud& cloud, const std::vector<double>& unknowns) {
  const ShapeFunctions fields = formulation.fields(cloud);
  ShapeValues at_node;
  const auto unknown = [&](int node) {
    return Vec3(Eigen::Map<const Vec3>(unknowns.data() + 3 * node));
  };
  double error = 0.0, size = 0.0;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Vec3& x = cloud.positions[i];
    Vec3 u = Vec3::Zero();
    if (formulation.interpolates()) {
      u = unknown(static_cast<int>(i));
    } else {
      if (!fields.evaluate(x, false, at_node)) return std::numeric_limits<double>::quiet_NaN();
      for (std::size_t j = 0; j < at_node.nodes.size(); ++j)
        u += at_node.values[j] * unknown(at_node.nodes[j]);
    }
    error += (u - exact(x)).squaredNorm();
    size += exact(x).squaredNorm();
  }
  return std::sqrt(error / size);
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
