#include "engine/features/deformation/linear_limits.h"

#include <fmt/format.h>

#include <algorithm>

namespace viscera {
namespace {

/// Gradients smaller than this share of the limits aren't worth measuring.
constexpr double kWorthMeasuring = 0.5;

SurfaceStrains strains_of(const OrganGradients& gradients, const OrganState& state) {
  if (!state.deformed || state.greatest_displacement * gradients.surface.bound() <
                             kWorthMeasuring * std::min(kMostRotation, kMostStretch))
    return {};
  return gradients.surface.greatest(state.positions);
}

/// Whether a tool presses or holds the tissue about `place`.
bool is_under_tool(const World& world, Entity organ, const Vec3& place) {
  const OrganContact* contact = world.find<OrganContact>(organ);
  if (!contact || contact->solution.forces.size() != contact->cells.size()) return false;
  const double reach = world.find<OrganBody>(organ)->model->finest_spacing;
  for (const CellRange& range : world.find<OrganTouch>(organ)->ranges)
    for (std::size_t k = range.begin; k < range.end; ++k)
      if (!contact->solution.forces[k].isZero(0.0) &&
          (contact->cells[k].position - place).norm() < reach)
        return true;
  return false;
}

std::string where(const GreatestStrain& one) {
  return fmt::format("at {:.1f} s, {:.0f} {:.0f} {:.0f} mm{}", one.time, 1e3 * one.place.x(),
                     1e3 * one.place.y(), 1e3 * one.place.z(),
                     one.under_tool ? ", under a tool" : "");
}

}  // namespace

void prepare_linear_limits(SceneModel& model) {
  for (const Entity organ : model.organs()) {
    const OrganModel& body = *model.constants().all<OrganBody>().find(organ)->model;
    if (!body.deformable() || body.places.size() == 0 || body.finite) continue;
    model.constants().all<OrganGradients>().add(
        organ, {SurfaceGradients(body.rest_positions, body.rest_normals, body.places.positions,
                                 body.places.normals, body.places.spacings)});
  }
}

void start_linear_limits(World& world) {
  for (const Entity organ : world.model().organs()) {
    if (!world.find<OrganGradients>(organ)) continue;
    world.all<GreatestStrains>().add(organ, {});
    world.all<StrainsNow>().add(organ, {});
  }
}

bool measure_strains(World& world, double time) {
  bool beyond = false;
  Pool<GreatestStrains>& all = world.all<GreatestStrains>();
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Entity organ = all.owner(i);
    const OrganState& state = *world.find<OrganState>(organ);
    StrainsNow& now = *world.find<StrainsNow>(organ);
    if (!now.known || now.version != state.version) {
      now = {state.version, true, strains_of(*world.find<OrganGradients>(organ), state)};
      GreatestStrains& greatest = all[i];
      const auto take = [&](double value, const Vec3& place, GreatestStrain& most) {
        if (value > most.value) most = {value, time, place, is_under_tool(world, organ, place)};
      };
      take(now.strains.rotation, now.strains.rotated, greatest.rotation);
      take(now.strains.stretch, now.strains.stretched, greatest.stretch);
    }
    beyond |= now.strains.rotation > kMostRotation || now.strains.stretch > kMostStretch;
  }
  return beyond;
}

void forget_strains(World& world) {
  for (StrainsNow& now : world.all<StrainsNow>()) now.known = false;
}

std::vector<std::string> linear_limit_warnings(const World& world) {
  std::vector<std::string> warnings;
  const Pool<GreatestStrains>& all = world.all<GreatestStrains>();
  for (std::size_t i = 0; i < all.size(); ++i) {
    const GreatestStrains& one = all[i];
    if (!(one.rotation.value > kMostRotation) && !(one.stretch.value > kMostStretch)) continue;
    warnings.push_back(fmt::format(
        "{}: turned by up to {:.2f} rad ({}) and stretched by up to {:.0f} % ({}); linear tissue "
        "carries {:g} rad and {:.0f} %. Its shape and the forces on it are a guide only there",
        world.find<OrganBody>(all.owner(i))->name, one.rotation.value, where(one.rotation),
        1e2 * one.stretch.value, where(one.stretch), kMostRotation, 1e2 * kMostStretch));
  }
  return warnings;
}

}  // namespace viscera
