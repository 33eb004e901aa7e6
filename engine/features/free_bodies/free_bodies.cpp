#include "engine/features/free_bodies/free_bodies.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/features/breathing/breathing_keys.h"
#include "engine/features/contact/contact.h"
#include "engine/features/gravity/gravity.h"
#include "engine/features/touching/touching_keys.h"

namespace viscera {
namespace {

/// Farther than this from where it began nothing of a scene is looked at [m].
constexpr double kInView = 0.5;

/// What keeps a body from being free.
void check_organ(const SceneDescription& scene, const OrganDescription& organ,
                 const std::function<void(std::string_view)>& wrong) {
  if (!organ.deformable) wrong("deformable: found false with free, expected true");
  if (!organ.fixed.empty()) wrong("fixed: found regions with free, expected none");
  if (organ.response != Response::kAuto && organ.response != Response::kFinite)
    wrong("response: found another with free, expected finite or auto");
  if (organ.finite.quasi_static)
    wrong("finite/quasi_static: found true with free, expected false: mass is what carries it");
  if (motion_of(organ))
    wrong("motion: found one with free, expected none: contact is what moves it");
  if (!touching_of(scene).organs)
    wrong("free: found true without contact/organs, expected that true: it would fall through all");
}

Result<void> check(const SceneDescription& scene, const std::map<std::string, Tissue>&) {
  Error mistakes;
  for (std::size_t o = 0; o < scene.organs.size(); ++o)
    if (scene.organs[o].free)
      check_organ(scene, scene.organs[o], [&](std::string_view what) {
        mistakes.messages.push_back(fmt::format("{}: organs/{}/{}", scene.file.string(), o, what));
      });
  if (!mistakes.messages.empty()) return std::unexpected(mistakes);
  return {};
}

void reach(const SceneDescription&, const OrganDescription& organ,
           const std::vector<InstrumentBody>&, Reach& reach) {
  if (!organ.free) return;
  reach.anywhere = true;
  reach.strained_anywhere = true;
}

Result<void> start(World& world) {
  for (const Entity organ : world.model().organs())
    if (world.model().scene().organs[organ.index].free) world.all<FreeBody>().add(organ, {});
  return {};
}

void watch(World& world, const FrameContext& context) {
  Pool<FreeBody>& bodies = world.all<FreeBody>();
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    OrganState& state = *world.find<OrganState>(bodies.owner(b));
    if (bodies[b].gone_at < 0.0) {
      if (state.frozen || state.greatest_displacement < kInView) continue;
      bodies[b].gone_at = context.time;
      state.frozen = true;
    }
    context.report->raise(kOutOfView);
  }
}

std::vector<std::string> warnings(const World& world) {
  std::vector<std::string> all;
  const Pool<FreeBody>& bodies = world.all<FreeBody>();
  for (std::size_t b = 0; b < bodies.size(); ++b)
    if (bodies[b].gone_at >= 0.0)
      all.push_back(fmt::format(
          "organ \"{}\": nothing held it, and at {:.2f} s it had fallen {:.0f} "
          "mm, out of view; it stayed there",
          world.find<OrganBody>(bodies.owner(b))->name, bodies[b].gone_at, 1e3 * kInView));
  return all;
}

}  // namespace

bool is_free(const World& world, Entity organ) {
  return world.find<FreeBody>(organ) != nullptr;
}

bool is_gone(const World& world, Entity organ) {
  const FreeBody* body = world.find<FreeBody>(organ);
  return body && body->gone_at >= 0.0;
}

double way_to_come(const World& world, Entity organ, double time) {
  if (!is_free(world, organ) || is_gone(world, organ)) return 0.0;
  double fastest = 0.0;
  const std::vector<double>& velocities =
      world.find<OrganTouch>(organ)->solver->state().motion.velocities;
  for (std::size_t at = 0; at + 2 < velocities.size(); at += 3)
    fastest = std::max(fastest, Vec3::Map(velocities.data() + at).norm());
  const OrganSag* weight = world.find<OrganSag>(organ);
  return time * (fastest + (weight ? time * weight->change.norm() : 0.0));
}

Feature free_bodies_feature() {
  return {.name = "free_bodies",
          .check = check,
          .reach = reach,
          .start = start,
          .states = {state_type<FreeBody>()},
          .stages = {{.name = "watch free bodies",
                      .reads = {"surfaces"},
                      .writes = {"flags"},
                      .changes = {"free bodies", "organ shapes"},
                      .needed = [](const World& world) { return world.has<FreeBody>(); },
                      .run = watch}},
          .flags = {kOutOfView},
          .warnings = warnings};
}

}  // namespace viscera
