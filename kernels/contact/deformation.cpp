#include "kernels/contact/deformation.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "kernels/base/parallel.h"
#include "kernels/contact/column_sums.h"
#include "kernels/contact/facing.h"
#include "kernels/contact/surface_carriers.h"

namespace viscera {
namespace {

constexpr std::size_t kVertexChunk = 512;

/// Neighbouring cells, seen from afar as one.
struct Group {
  Vec3 centre = Vec3::Zero();
  Vec3 normal = Vec3::Zero();
  Vec3 force = Vec3::Zero();
  double area = 0.0;  // of one cell
  double radius = 0.0;
  double range = 0.0;
  std::vector<std::size_t> cells;  // those under force
};

/// Loaded cells within a sigma of the first of their group, facing the same way.
std::vector<Group> group_cells(std::span<const NearField> near_fields,
                               std::span<const ContactCell> cells, std::span<const Vec3> forces) {
  std::vector<Group> groups;
  for (std::size_t k = 0; k < near_fields.size(); ++k) {
    if (forces[k].isZero(0.0)) continue;
    const auto near_first = [&](const Group& group) {
      const ContactCell& first = cells[group.cells.front()];
      return (first.position - cells[k].position).norm() < near_fields[k].sigma() &&
             first.normal.dot(cells[k].normal) > 0.5;
    };
    auto group = std::find_if(groups.begin(), groups.end(), near_first);
    if (group == groups.end()) group = groups.insert(groups.end(), Group{});
    group->cells.push_back(k);
  }
  for (Group& group : groups) {
    double sum = 0.0;
    for (const std::size_t k : group.cells) {
      const double weight = forces[k].norm();
      group.centre += weight * cells[k].position;
      group.normal += weight * cells[k].normal;
      group.force += forces[k];
      group.area = std::max(group.area, cells[k].area);
      sum += weight;
    }
    group.centre /= sum;
    group.range = near_fields[group.cells.front()].drawn_range(sum);
    group.normal.normalize();
    for (const std::size_t k : group.cells) {
      group.radius = std::max(group.radius, (cells[k].position - group.centre).norm());
    }
  }
  return groups;
}

/// The near fields of a solve, where they are drawn.
class DrawnNearFields {
 public:
  DrawnNearFields(const DrawnSurface& drawn, std::span<const NearField> near_fields,
                  std::span<const ContactCell> cells, std::span<const Vec3> forces)
      : drawn_(drawn),
        near_fields_(near_fields),
        cells_(cells),
        forces_(forces),
        groups_(group_cells(near_fields, cells, forces)) {
    for (const Group& group : groups_) {
      const Vec3 reach = Vec3::Constant(group.range + group.radius);
      reach_.extend(group.centre - reach).extend(group.centre + reach);
    }
    if (drawn.sides) find_sides();
  }

  bool empty() const { return groups_.empty(); }

  /// Of all groups at a vertex. The half-space of a cell ends where the surface turns away from it.
  Vec3 at(std::size_t vertex) const {
    const Vec3 &position = drawn_.rest->vertices[vertex], &normal = drawn_.rest_normals[vertex];
    Vec3 sum = Vec3::Zero();
    if (!reach_.contains(position)) return sum;
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      const Group& group = groups_[g];
      const double distance = (position - group.centre).norm();
      if (distance > group.range + group.radius) continue;
      double share = facing(group.normal.dot(normal));
      if (share > 0.0) share *= share_on_its_side(g, vertex);
      if (share == 0.0) continue;
      const NearField& field = near_fields_[group.cells.front()];
      if (distance > field.sigma() + 4.0 * group.radius) {
        sum += share * field.drawn_displacement(position - group.centre, group.normal, group.area,
                                                group.force);
        continue;
      }
      for (const std::size_t k : group.cells) {
        sum += share * near_fields_[k].drawn_displacement(position - cells_[k].position,
                                                          cells_[k].normal, cells_[k].area,
                                                          forces_[k]);
      }
    }
    return sum;
  }

 private:
  /// A group sees what the place sees that takes most of its first cell's load.
  void find_sides() {
    for (const Group& group : groups_) {
      const std::size_t first = group.cells.front();
      const int place = near_fields_[first].place();
      place_of_group_.push_back(
          place >= 0 ? static_cast<std::size_t>(place)
                     : drawn_.sides->nearest(cells_[first].position, cells_[first].normal));
    }
  }

  /// Of what carries a vertex, how much lies on the group's side.
  double share_on_its_side(std::size_t g, std::size_t vertex) const {
    if (!drawn_.sides) return 1.0;
    const SparseWeights& carriers = drawn_.carriers;
    double share = 1.0;
    for (int e = carriers.row_begin[vertex]; e < carriers.row_begin[vertex + 1]; ++e) {
      const auto entry = static_cast<std::size_t>(e);
      if (drawn_.sides->beyond_air(place_of_group_[g],
                                   static_cast<std::size_t>(carriers.nodes[entry])))
        share -= static_cast<double>(carriers.values[entry]);
    }
    return std::clamp(share, 0.0, 1.0);
  }

  const DrawnSurface& drawn_;
  std::span<const NearField> near_fields_;
  std::span<const ContactCell> cells_;
  std::span<const Vec3> forces_;
  std::vector<Group> groups_;
  Eigen::AlignedBox3d reach_;                // of all of them
  std::vector<std::size_t> place_of_group_;  // of a body with folds
};

/// acos(cosine) to 7e-5: [Abramowitz1964] 4.4.45. As a weight that is plenty, and the
/// library's arc functions were half the time of drawing.
float angle_of(float cosine) {
  const float x = std::min(std::abs(cosine), 1.0f);
  const float angle =
      std::sqrt(1.0f - x) * (1.5707288f + x * (-0.2121144f + x * (0.0742610f - x * 0.0187293f)));
  return cosine >= 0.0f ? angle : std::numbers::pi_v<float> - angle;
}

Vec3f carried(const SparseWeights& carriers, std::span<const float> displacements,
              std::size_t vertex) {
  Vec3f moved = Vec3f::Zero();
  for (int e = carriers.row_begin[vertex]; e < carriers.row_begin[vertex + 1]; ++e) {
    const auto entry = static_cast<std::size_t>(e);
    moved += carriers.values[entry] * Vec3f::Map(displacements.data() + 3 * carriers.nodes[entry]);
  }
  return moved;
}

}  // namespace

void place_displacements(const SurfaceCompliance& compliance, const ContactResponse& response,
                         std::vector<float>& displacements) {
  compliance.need(response.touched);
  sum_column_triples({compliance.columns.data(), compliance.rows(), compliance.rows()},
                     response.touched, response.loads, displacements);
}

DrawnSurface carry_surface(const TriangleSurface& surface, const SurfacePlaces& places) {
  DrawnSurface drawn = carried_by_none(surface);
  drawn.carriers = surface_carriers(surface.vertices, drawn.rest_normals, places);
  if (places.paths) drawn.sides = std::make_shared<const SidesOfPlaces>(places);
  return drawn;
}

DrawnSurface carried_by_none(const TriangleSurface& surface) {
  DrawnSurface drawn;
  drawn.rest = &surface;
  drawn.rest_normals = vertex_normals(surface);
  const std::size_t count = surface.vertices.size();

  drawn.triangle_begin.assign(count + 1, 0);
  for (const auto& triangle : surface.triangles) {
    for (const int v : triangle) ++drawn.triangle_begin[static_cast<std::size_t>(v) + 1];
  }
  for (std::size_t v = 1; v <= count; ++v) drawn.triangle_begin[v] += drawn.triangle_begin[v - 1];
  std::vector<int> next(drawn.triangle_begin.begin(), drawn.triangle_begin.end() - 1);
  drawn.triangle_items.resize(3 * surface.triangles.size());
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    for (const int v : surface.triangles[t]) {
      auto& place = next[static_cast<std::size_t>(v)];
      drawn.triangle_items[static_cast<std::size_t>(place++)] = static_cast<int>(t);
    }
  }
  return drawn;
}

Vec3f deformed_normal(const DrawnSurface& drawn, std::span<const Vec3f> positions,
                      std::size_t vertex) {
  Vec3f sum = Vec3f::Zero();
  for (int at = drawn.triangle_begin[vertex]; at < drawn.triangle_begin[vertex + 1]; ++at) {
    const auto& corners = drawn.rest->triangles[static_cast<std::size_t>(
        drawn.triangle_items[static_cast<std::size_t>(at)])];
    std::size_t a = 0;
    while (static_cast<std::size_t>(corners[a]) != vertex) ++a;
    const Vec3f& here = positions[vertex];
    const Vec3f u = positions[static_cast<std::size_t>(corners[(a + 1) % 3])] - here;
    const Vec3f v = positions[static_cast<std::size_t>(corners[(a + 2) % 3])] - here;
    const Vec3f area_vector = u.cross(v);
    const float twice_area = area_vector.norm();
    if (twice_area > 0.0f) {
      const float cosine = u.dot(v) / std::sqrt(u.squaredNorm() * v.squaredNorm());
      sum += area_vector * (angle_of(cosine) / twice_area);
    }
  }
  const float length = sum.norm();
  return length > 0.0f ? Vec3f(sum / length) : Vec3f(Vec3f::UnitZ());
}

void deformed_normals(const DrawnSurface& drawn, std::span<const Vec3f> positions,
                      std::vector<Vec3f>& normals) {
  normals.resize(positions.size());
  parallel_for_each_index(positions.size(), kVertexChunk, [&](std::size_t v) {
    normals[v] = deformed_normal(drawn, positions, v);
  });
}

void carry_displacements(const DrawnSurface& drawn, std::span<const float> displacements,
                         std::vector<Vec3f>& vertices) {
  vertices.resize(drawn.rest->vertices.size());
  parallel_for_each_index(vertices.size(), kVertexChunk, [&](std::size_t v) {
    vertices[v] = carried(drawn.carriers, displacements, v);
  });
}

void deformed_positions(const DrawnSurface& drawn, std::span<const float> displacements,
                        std::span<const NearField> near_fields, std::span<const ContactCell> cells,
                        std::span<const Vec3> forces, std::vector<Vec3f>& positions) {
  const std::size_t count = drawn.rest->vertices.size();
  positions.resize(count);
  const DrawnNearFields near_field(drawn, near_fields, cells, forces);
  parallel_for_each_index(count, kVertexChunk, [&](std::size_t v) {
    const Vec3f moved = carried(drawn.carriers, displacements, v);
    const Vec3& rest = drawn.rest->vertices[v];
    positions[v] = (rest + moved.cast<double>() + near_field.at(v)).cast<float>();
  });
}

void deform_drawn_surface(const DrawnSurface& drawn, std::span<const float> displacements,
                          std::span<const NearField> near_fields,
                          std::span<const ContactCell> cells, std::span<const Vec3> forces,
                          std::vector<Vec3f>& positions, std::vector<Vec3f>& normals) {
  deformed_positions(drawn, displacements, near_fields, cells, forces, positions);
  deformed_normals(drawn, positions, normals);
}

void near_field_on_surface(const DrawnSurface& drawn, std::span<const NearField> near_fields,
                           std::span<const ContactCell> cells, std::span<const Vec3> forces,
                           std::vector<int>& vertices, std::vector<Vec3f>& displacements) {
  vertices.clear();
  displacements.clear();
  const DrawnNearFields near_field(drawn, near_fields, cells, forces);
  if (near_field.empty()) return;
  struct Part {
    std::vector<int> vertices;
    std::vector<Vec3f> displacements;
  };
  const std::size_t count = drawn.rest->vertices.size();
  std::vector<Part> parts((count + kVertexChunk - 1) / kVertexChunk);
  parallel_chunks(count, kVertexChunk, [&](std::size_t begin, std::size_t end) {
    Part& part = parts[begin / kVertexChunk];
    for (std::size_t v = begin; v < end; ++v) {
      const Vec3 near = near_field.at(v);
      if (near.isZero(0.0)) continue;
      part.vertices.push_back(static_cast<int>(v));
      part.displacements.push_back(near.cast<float>());
    }
  });
  for (const Part& part : parts) {
    vertices.insert(vertices.end(), part.vertices.begin(), part.vertices.end());
    displacements.insert(displacements.end(), part.displacements.begin(), part.displacements.end());
  }
}

}  // namespace viscera
