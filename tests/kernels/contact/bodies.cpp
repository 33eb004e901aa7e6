#include "tests/kernels/contact/bodies.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "kernels/points/surface_tree.h"
#include "tests/support/shapes.h"

namespace viscera::test {

PressedBody prepare_body(TriangleSurface surface, const IsotropicMaterial& material,
                         const SpacingField& spacing,
                         const std::function<bool(const Vec3&)>& is_fixed,
                         const std::function<bool(const Vec3&)>& is_touchable, bool drawn,
                         const std::function<double(const Vec3&, double)>& relative_modulus) {
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
  ElasticProblem problem{&body.surface, &body.cloud, material, is_fixed};
  problem.relative_modulus = relative_modulus;
  auto solver = galerkin.prepare(problem, no_progress());
  if (!solver) {
    ADD_FAILURE() << solver.error().text();
    return body;
  }
  body.fields = std::make_unique<ShapeFunctions>(galerkin.fields(body.cloud));
  auto places = place_on_surface(body.surface, *body.fields);
  if (!places) {
    ADD_FAILURE() << places.error().text();
    return body;
  }
  body.places = std::move(*places);
  auto touch = touchable_part(body.places, is_touchable);
  if (!touch) {
    ADD_FAILURE() << touch.error().text();
    return body;
  }
  body.touch = std::move(*touch);
  if (relative_modulus)
    note_modulus(body.touch, material, PatchContact::spread_factor(), relative_modulus);
  if (drawn) body.drawn = carry_surface(body.surface, body.places);
  auto compliance = (*solver)->compliance(body.places.fields, body.touch.places, no_progress());
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

const PressedBody& block() {
  static const PressedBody body = prepare_block(Vec3(0.04, 0.04, 2.0 * kTop), 4e-3, 0.016, kTissue);
  return body;
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

Vec3 total_force(const ContactSolution& solution) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& force : solution.forces) sum += force;
  return sum;
}

}  // namespace viscera::test
