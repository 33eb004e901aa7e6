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

}  // namespace

void prepare_linear_limits(SceneModel& model) {
  for (const Entity organ : model.organs()) {
    const OrganModel& body = *model.constants().all<OrganBody>().find(organ)->model;
    if (!body.deformable() || body.places.size() == 0) continue;
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
      const auto take = [&](double value, double& most, double& at) {
        if (!(value > most)) return;
        most = value;
        at = time;
      };
      take(now.strains.rotation, greatest.rotation, greatest.rotation_at);
      take(now.strains.stretch, greatest.stretch, greatest.stretch_at);
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
    if (!(one.rotation > kMostRotation) && !(one.stretch > kMostStretch)) continue;
    warnings.push_back(fmt::format(
        "{}: turned by up to {:.2f} rad (at {:.1f} s) and stretched by up to {:.0f} % (at {:.1f} "
        "s) somewhere; linear tissue carries {:g} rad and {:.0f} %. Its shape and the forces on "
        "it are beyond what elasticity is exact for there",
        world.find<OrganBody>(all.owner(i))->name, one.rotation, one.rotation_at, 1e2 * one.stretch,
        one.stretch_at, kMostRotation, 1e2 * kMostStretch));
  }
  return warnings;
}

}  // namespace viscera
