#include "engine/organ/elasticity_checks.h"

#include <algorithm>

#include "kernels/formulations/formulations.h"
#include "kernels/paff/problem_checks.h"

namespace viscera {
namespace {

/// False only where it doesn't: triangles count by their boxes.
bool may_meet(const Region& region, const TriangleSurface& surface) {
  if (region.shape == Region::Shape::kHalfSpace)
    return std::any_of(surface.vertices.begin(), surface.vertices.end(),
                       [&](const Vec3& x) { return region.contains(x); });
  const bool ball = region.shape == Region::Shape::kSphere;
  return std::any_of(surface.triangles.begin(), surface.triangles.end(), [&](const auto& corners) {
    Box triangle;
    for (const int corner : corners)
      triangle.extend(surface.vertices[static_cast<std::size_t>(corner)]);
    return ball ? triangle.squaredExteriorDistance(region.a) <= region.radius * region.radius
                : triangle.intersects(Box(region.a, region.b));
  });
}

}  // namespace

Result<void> check_elasticity(const OrganDescription& organ, const IsotropicMaterial& material,
                              const TriangleSurface& surface) {
  Error mistakes;
  if (const Formulation* formulation = find_formulation(organ.formulation)) {
    if (auto accepted = accept_material(*formulation, material); !accepted)
      mistakes = accepted.error();
  } else {
    mistakes.messages.push_back("formulation: " + unknown_formulation(organ.formulation));
  }
  if (!organ.free && std::none_of(organ.fixed.begin(), organ.fixed.end(),
                                  [&](const Region& region) { return may_meet(region, surface); }))
    mistakes.messages.push_back(
        "fixed region: it holds no part of the surface; expected a region that meets the surface");
  if (mistakes.messages.empty()) return {};
  return std::unexpected(mistakes);
}

}  // namespace viscera
