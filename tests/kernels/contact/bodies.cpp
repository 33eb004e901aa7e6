#include "tests/kernels/contact/bodies.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <utility>

#include "kernels/points/surface_tree.h"
#include "tests/support/shapes.h"

namespace viscera::test {

PressedBody prepare_body(TriangleSurface surface, const IsotropicMaterial& material,
                         const SpacingField& spacing,
                         const std::function<bool(const Vec3&)>& is_fixed,
                         const std::function<bool(const Vec3&)>& is_touchable, bool drawn) {
  PressedBody body;
  body.surface = std::move(surface);
  body.material = material;
  const SurfaceTree tree(body.surface);
  auto cloud = place_nodes(body.surface, tree, spacing, NodePlacement{}, no_progress());
  if (!cloud) {
    ADD_FAILURE() << cloud.error().text();
    return body;
  }
  body.cloud = std::move(*cloud);
  const Formulation& galerkin = *find_formulation("galerkin");
  const ElasticProblem problem{&body.surface, &body.cloud, material, is_fixed};
  auto solver = galerkin.prepare(problem, no_progress());
  if (!solver) {
    ADD_FAILURE() << solver.error().text();
    return body;
  }
  body.fields = std::make_unique<ShapeFunctions>(galerkin.fields(body.cloud));
  auto touch = sample_touchable_surface(body.surface, is_touchable, *body.fields, body.touchable);
  if (!touch) {
    ADD_FAILURE() << touch.error().text();
    return body;
  }
  body.touch = std::move(*touch);
  std::vector<int> visible = body.touchable;
  if (drawn) {
    auto carried = carry_surface(body.surface, *body.fields, visible);
    if (!carried) {
      ADD_FAILURE() << carried.error().text();
      return body;
    }
    body.drawn = std::move(*carried);
  }
  auto compliance = (*solver)->compliance(visible, body.touchable, no_progress());
  if (!compliance) {
    ADD_FAILURE() << compliance.error().text();
    return body;
  }
  body.compliance = std::move(*compliance);
  body.ready = true;
  return body;
}

PressedBody prepare_block(const Vec3& edges, double spacing, double reach,
                          const IsotropicMaterial& material) {
  const double top = 0.5 * edges.z(), hair = 1e-9;
  return prepare_body(
      box(edges, 16), material, [=](const Vec3&) { return spacing; },
      [=](const Vec3& x) { return x.z() < -top + hair; },
      [=](const Vec3& x) {
        return x.z() > top - hair && std::abs(x.x()) < reach && std::abs(x.y()) < reach;
      });
}

TriangleSurface hemisphere(double radius, int rings) {
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

std::vector<ContactCell> plane_cells(const Vec3& centre, double pitch, int rings, double radius,
                                     double depth) {
  std::vector<ContactCell> cells;
  for (int i = -rings; i <= rings; ++i) {
    for (int j = -rings; j <= rings; ++j) {
      if (std::abs(i + j) > rings) continue;
      const Vec3 offset(pitch * (i + 0.5 * j), pitch * std::sqrt(0.75) * j, 0.0);
      ContactCell cell;
      cell.position = centre + offset;
      cell.normal = Vec3::UnitZ();
      cell.area = pitch * pitch * std::sqrt(0.75);
      cell.direction = -Vec3::UnitZ();
      const double rise =
          radius > 0.0 ? radius - std::sqrt(radius * radius - offset.squaredNorm()) : 0.0;
      cell.depth = depth - rise;
      cells.push_back(cell);
    }
  }
  return cells;
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

Vec3 total_force(const ContactSolution& solution) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& force : solution.forces) sum += force;
  return sum;
}

}  // namespace viscera::test
