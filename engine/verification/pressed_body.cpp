#include "engine/verification/pressed_body.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <cmath>

#include "kernels/base/stopwatch.h"
#include "kernels/contact/near_thickness.h"
#include "kernels/formulations/formulations.h"

namespace viscera {
namespace {

template <class T, class Allocator>
std::size_t bytes_of(const std::vector<T, Allocator>& values) {
  return values.size() * sizeof(T);
}

}  // namespace

Result<std::unique_ptr<PressedBody>> PressedBody::prepare(BodyToPress wanted,
                                                          const Progress& progress) {
  std::unique_ptr<PressedBody> body(new PressedBody);
  body->formulation_ = find_formulation(wanted.formulation);
  if (!body->formulation_)
    return failure("formulation: " + unknown_formulation(wanted.formulation));
  body->material_ = wanted.material;
  body->body_.surface = std::move(wanted.surface);
  const TriangleSurface& surface = body->body_.surface;

  const Stopwatch watch;
  body->tree_ = std::make_unique<SurfaceTree>(surface);
  auto cloud = place_nodes(surface, *body->tree_, wanted.spacing, {}, no_progress());
  if (!cloud) return std::unexpected(cloud.error());
  body->body_.cloud = std::move(*cloud);
  body->fields_ =
      std::make_unique<ShapeFunctions>(body->formulation_->fields(surface, body->body_.cloud));
  auto places = place_on_surface(surface, *body->fields_);
  if (!places) return std::unexpected(places.error());
  body->places_ = std::move(*places);
  auto touch = touchable_part(body->places_, wanted.is_touchable);
  if (!touch) return std::unexpected(touch.error());
  body->touch_ = std::move(*touch);
  note_thickness(body->touch_, body->material_, PatchContact::spread_factor(), surface,
                 *body->tree_, wanted.is_fixed);
  body->drawn_ = carry_surface(surface, body->places_);

  auto solver = body->formulation_->prepare(
      body->body_.problem(body->material_, std::move(wanted.is_fixed)), progress);
  if (!solver) return std::unexpected(solver.error());
  auto compliance = (*solver)->compliance(body->places_.fields, body->touch_.places, progress);
  if (!compliance) return std::unexpected(compliance.error());
  body->compliance_ = std::move(*compliance);
  body->prepare_s_ = watch.seconds();
  body->figures_ = (*solver)->figures();
  body->contact_ = std::make_unique<PatchContact>(body->compliance_, body->touch_, body->material_);
  body->contact_->draw_on(body->drawn_, nullptr);
  return body;
}

std::vector<Vec3> PressedBody::displacements(const ContactSolution& solution,
                                             const ContactResponse& response,
                                             std::span<const ContactCell> cells) const {
  std::vector<float> carried;
  viscera::place_displacements(compliance_, response, carried);
  std::vector<Vec3f> positions;
  contact_->draw(carried, cells, solution, positions);
  std::vector<Vec3> moved;
  for (std::size_t v = 0; v < positions.size(); ++v)
    moved.push_back(positions[v].cast<double>() - body_.surface.vertices[v]);
  return moved;
}

PressedAnswer PressedBody::press(std::span<const ContactCell> cells) {
  ContactSolution solution;
  ContactResponse response;
  contact_->solve(cells, solution, response);
  PressedAnswer answer;
  answer.converged = solution.converged;
  answer.smallest_eigenvalue = solution.smallest_eigenvalue;
  answer.lifted = solution.lifted;
  for (const Vec3& force : solution.forces) answer.force += force;
  answer.displacements = displacements(solution, response, cells);
  return answer;
}

PressedAnswer PressedBody::load(std::span<const ContactCell> cells, std::span<const Vec3> forces) {
  ContactSolution solution;
  ContactResponse response;
  contact_->load(cells, forces, solution, response);
  PressedAnswer answer;
  answer.converged = true;
  for (const Vec3& force : forces) answer.force += force;
  answer.displacements = displacements(solution, response, cells);
  return answer;
}

PressedAnswer PressedBody::pin(const std::function<bool(const Vec3&)>& is_pinned,
                               const Vec3& displacement) {
  PressedAnswer answer;
  ContactResponse response;
  for (std::size_t t = 0; t < touch_.size(); ++t)
    if (is_pinned(touch_.positions[t])) response.touched.push_back(static_cast<int>(t));
  const auto count = static_cast<Eigen::Index>(response.touched.size());
  if (count == 0) return answer;
  compliance_.need(response.touched);
  const std::size_t rows = compliance_.rows();
  MatrixX square(3 * count, 3 * count);
  VectorX wanted(3 * count);
  for (Eigen::Index j = 0; j < count; ++j) {
    const auto column = static_cast<std::size_t>(response.touched[static_cast<std::size_t>(j)]);
    wanted.segment<3>(3 * j) = displacement;
    for (Eigen::Index i = 0; i < count; ++i) {
      const auto touched = static_cast<std::size_t>(response.touched[static_cast<std::size_t>(i)]);
      const auto row = static_cast<std::size_t>(3 * compliance_.touchable[touched]);
      for (std::size_t a = 0; a < 3; ++a)
        for (std::size_t b = 0; b < 3; ++b)
          square(3 * i + static_cast<Eigen::Index>(b), 3 * j + static_cast<Eigen::Index>(a)) =
              compliance_.columns[(3 * column + a) * rows + row + b];
    }
  }
  // Collocated formulations have compliances that aren't symmetric.
  const VectorX forces = square.partialPivLu().solve(wanted);
  answer.converged = forces.allFinite() && (square * forces - wanted).norm() < 1e-3 * wanted.norm();
  if (!answer.converged) return answer;
  for (Eigen::Index j = 0; j < count; ++j) {
    response.loads.emplace_back(forces.segment<3>(3 * j));
    answer.force += response.loads.back();
  }
  answer.displacements = displacements({}, response, {});
  return answer;
}

Vec3 PressedBody::displacement_at(const PressedAnswer& answer, const Vec3& place) const {
  const SurfacePoint point = tree_->closest(place).point;
  const auto& corners = body_.surface.triangles[static_cast<std::size_t>(point.triangle)];
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < 3; ++i)
    sum += point.weights[static_cast<Eigen::Index>(i)] *
           answer.displacements[static_cast<std::size_t>(corners[i])];
  return sum;
}

std::size_t PressedBody::memory_bytes() const {
  return bytes_of(compliance_.columns) + bytes_of(compliance_.touchable) +
         bytes_of(touch_.positions) + bytes_of(touch_.normals) + bytes_of(touch_.areas) +
         bytes_of(touch_.spacings) + bytes_of(drawn_.carriers.nodes) +
         bytes_of(drawn_.carriers.values) + bytes_of(drawn_.triangle_items) +
         bytes_of(drawn_.rest_normals);
}

Result<double> even_spacing_for(const TriangleSurface& surface, std::size_t nodes,
                                const Progress& progress) {
  const double wanted = static_cast<double>(nodes);
  const SurfaceTree tree(surface);
  double spacing = std::cbrt(1.2 * std::abs(volume(surface)) / wanted);
  double best = 0.0, most = 0.0;
  for (int pass = 0; pass < 8 && most < 0.97 * wanted; ++pass) {
    if (!progress(0.0, "finding the spacing")) return failure(kCancelled);
    auto cloud = place_nodes(
        surface, tree, [=](const Vec3&) { return spacing; }, {}, no_progress());
    if (!cloud) return std::unexpected(cloud.error());
    const double found = static_cast<double>(cloud->size());
    if (found <= wanted && found > most) {
      most = found;
      best = spacing;
    }
    // Surfaces bring more nodes than their share of the volume: between the square and the cube.
    spacing *= std::pow(found / (0.985 * wanted), 0.37);
  }
  if (best > 0.0) return best;
  return failure(fmt::format("found no cloud of at most {} nodes, expected more", nodes));
}

}  // namespace viscera
