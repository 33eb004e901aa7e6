#include "engine/features/contact/tissue_sheet.h"

#include "kernels/contact/deformation.h"

namespace viscera {
namespace {

/// Unit normal of the deformed surface. Where its normals aren't here, those of the few triangles
/// about a tool follow from the positions.
Vec3 drawn_normal(const OrganModel& model, const OrganState& state, const SurfacePoint& point) {
  if (state.normals_fit && !state.on_gpu)
    return corner_mean(state.normals, model.surface, point).normalized();
  const auto& corners = model.surface.triangles[static_cast<std::size_t>(point.triangle)];
  Vec3 sum = Vec3::Zero();
  for (int c = 0; c < 3; ++c)
    sum += point.weights[c] *
           deformed_normal(model.drawn, state.positions,
                           static_cast<std::size_t>(corners[static_cast<std::size_t>(c)]))
               .cast<double>();
  return sum.normalized();
}

}  // namespace

Vec3 corner_mean(std::span<const Vec3f> values, const TriangleSurface& surface,
                 const SurfacePoint& point) {
  const auto& corners = surface.triangles[static_cast<std::size_t>(point.triangle)];
  Vec3 sum = Vec3::Zero();
  for (int c = 0; c < 3; ++c)
    sum += point.weights[c] *
           values[static_cast<std::size_t>(corners[static_cast<std::size_t>(c)])].cast<double>();
  return sum;
}

TissueSheet::TissueSheet(const OrganModel& model, const OrganState& state,
                         const CollisionSurface& drawn)
    : model_(model), state_(&state), surface_(drawn) {}

TissueSheet::TissueSheet(const OrganModel& model, const CollisionSurface& rest, const Pose& moved)
    : model_(model), surface_(rest), moved_(moved) {}

std::optional<TissueSheet::Hit> TissueSheet::closest(const Vec3& query, double radius) const {
  if (state_) return surface_.closest(query, radius);
  auto hit = surface_.closest(moved_.to_local(query), radius);
  if (hit) hit->position = moved_.to_world(hit->position);
  return hit;
}

std::optional<TissueSheet::Hit> TissueSheet::cast(const Vec3& origin, const Vec3& direction,
                                                  double length) const {
  if (state_) return surface_.cast(origin, direction, length);
  auto hit = surface_.cast(moved_.to_local(origin), moved_.direction_to_local(direction), length);
  if (hit) hit->position = moved_.to_world(hit->position);
  return hit;
}

Vec3 TissueSheet::position(const SurfacePoint& point) const {
  if (state_) return corner_mean(state_->positions, model_.surface, point);
  return moved_.to_world(viscera::position(model_.surface, point));
}

Vec3 TissueSheet::normal(const SurfacePoint& point) const {
  if (state_) return drawn_normal(model_, *state_, point);
  return moved_.direction_to_world(
      corner_mean(model_.rest_normals, model_.surface, point).normalized());
}

}  // namespace viscera
