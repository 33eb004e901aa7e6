#include "engine/features/contact/foot.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace viscera {
namespace {

/// The direction of contact settles within a few passes, each of which leaves a share depth /
/// (radius of curvature) of the error.
constexpr int kMostPasses = 8;
constexpr double kSettled = 1e-9;
/// Two places whose normals have this cosine are of one side of the body.
constexpr double kSameSide = 0.5;

/// The direction of contact is the mean normal of the tissue around the tool, wider than the tool's
/// own dent, so that the dent's walls cancel. It is centred on the tool: where tissue hugs the tip,
/// the nearest point is any of many. In passes, since the first starts from that point's normal.
void take_mean_normal(const ToolShape& tool, const OrganModel& model, const TissueSheet& sheet,
                      Foot& foot) {
  const double ring =
      std::max(2.0 * std::max(tool.probe_radius(), tool.radius), 1.2 * model.finest_spacing);
  for (int pass = 0; pass < kMostPasses; ++pass) {
    const auto [e1, e2] = plane_across(foot.outward);
    Vec3 sum = Vec3::Zero();
    for (int i = 0; i < 12; ++i) {
      const double angle = std::numbers::pi * i / 6.0;
      const double r = i % 2 == 0 ? ring : 0.6 * ring;
      const Vec3 at = foot.probe + r * (std::cos(angle) * e1 + std::sin(angle) * e2);
      const auto hit = tissue_under(at, foot, 2.0 * ring + kFrameReach, sheet);
      if (hit) sum += sheet.normal(hit->point);
    }
    if (!(sum.norm() > 1.0)) return;
    const Vec3 outward = sum.normalized();
    const double change = (outward - foot.outward).norm();
    foot.outward = outward;
    if (change < kSettled) return;
  }
}

}  // namespace

std::pair<Vec3, Vec3> plane_across(const Vec3& up) {
  const Vec3 other = std::abs(up.x()) < 0.7 ? Vec3::UnitX() : Vec3::UnitY();
  const Vec3 e1 = up.cross(other).normalized();
  return {e1, up.cross(e1)};
}

std::optional<TissueSheet::Hit> tissue_under(const Vec3& at, const Foot& foot, double span,
                                             const TissueSheet& sheet) {
  const double height = (foot.position - at).dot(foot.outward);
  const Vec3 origin = at + (height + span) * foot.outward;
  return sheet.cast(origin, -foot.outward, 2.0 * span);
}

std::optional<Foot> find_foot(const ToolShape& tool, double margin, const OrganModel& model,
                              const OrganState& state, const CollisionSurface& surface) {
  const TissueSheet drawn(model, state, surface);
  const double radius = tool.probe_radius();
  std::optional<Foot> best;
  for (const Vec3& probe : tool.probes()) {
    const auto hit = drawn.closest(probe, radius + kFrameReach);
    if (!hit) continue;
    const Vec3 normal = drawn.normal(hit->point);
    const double side = (probe - hit->position).dot(normal) >= 0.0 ? 1.0 : -1.0;
    const double clearance = side * hit->distance - radius;
    if (!best || clearance < best->clearance) best = Foot{probe, hit->position, normal, clearance};
  }
  if (!best || best->clearance > margin) return std::nullopt;
  take_mean_normal(tool, model, drawn, *best);
  return best;
}

std::optional<Foot> find_foot_as_met(const ToolShape& tool, double margin, const OrganModel& model,
                                     const TissueSheet& drawn, const TissueSheet& met) {
  const double radius = tool.probe_radius();
  std::optional<Foot> best;
  for (const Vec3& probe : tool.probes()) {
    const auto shown = drawn.closest(probe, radius + kFrameReach);
    if (!shown) continue;
    // A tool deep in the tissue may be nearer to another side of it than to the one it pressed in.
    SurfacePoint point = shown->point;
    if (const auto nearest = met.closest(probe, radius + kFrameReach);
        nearest && met.normal(nearest->point).dot(met.normal(point)) > kSameSide)
      point = nearest->point;
    const Vec3 at = met.position(point), normal = met.normal(point);
    const double clearance = (probe - at).dot(normal) - radius;
    if (!best || clearance < best->clearance) best = Foot{probe, at, normal, clearance};
  }
  if (!best) return std::nullopt;
  take_mean_normal(tool, model, met, *best);
  const double span = 2.0 * tool.radius + kFrameReach + std::abs(best->clearance);
  if (const auto under = tissue_under(best->probe, *best, span, met)) {
    best->position = under->position;
    best->clearance = (best->probe - under->position).dot(best->outward) - radius;
  }
  if (best->clearance > margin) return std::nullopt;
  return best;
}

}  // namespace viscera
