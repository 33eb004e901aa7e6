#include "engine/features/free_bodies/free_bodies.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/features/breathing/breathing_keys.h"
#include "engine/features/contact/contact.h"
#include "engine/features/gravity/gravity.h"
#include "engine/features/touching/touching_keys.h"
#include "kernels/finite/finite_limits.h"
#include "kernels/finite/finite_solver.h"

namespace viscera {
namespace {

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
  if (!hold_motions_of(organ).empty())
    wrong("moving_holds: found some with free, expected none: nothing holds it");
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

/// Of a way along what may be met this share counts as a way towards it, at least: chosen.
constexpr double kLeastAlong = 0.25;

/// How an organ moves while nothing touches it; not at all where something holds all of it.
class Fall {
 public:
  Fall(const World& world, Entity organ) : pose_(pose_of(world, organ)) {
    if (!is_loose(world, organ) || is_gone(world, organ)) return;
    velocities_ = world.find<OrganTouch>(organ)->solver->state().motion.velocities;
    if (const TableGravity* table = world.one<TableGravity>())
      acceleration_ = table->gravity.at(world.time());
    for (std::size_t at = 0; at < velocities_.size(); at += 3)
      mean_ += pose_.direction_to_world(Vec3::Map(velocities_.data() + at));
    mean_ *= 3.0 / static_cast<double>(velocities_.size());
  }
  const Vec3& acceleration() const { return acceleration_; }  ///< world [m/s2]
  const Vec3& velocity() const { return mean_; }              ///< of its nodes, world [m/s]

  /// Of its nodes, beside their mean [m/s].
  double fastest_beside_mean() const {
    double most = 0.0;
    for (std::size_t at = 0; at < velocities_.size(); at += 3) {
      const Vec3 velocity = pose_.direction_to_world(Vec3::Map(velocities_.data() + at));
      most = std::max(most, (velocity - mean_).norm());
    }
    return most;
  }

 private:
  const Pose& pose_;
  std::span<const double> velocities_;  // of its nodes
  Vec3 acceleration_ = Vec3::Zero(), mean_ = Vec3::Zero();
};

/// The mean way of such a body says nothing of pieces that a cut took off it.
bool has_pieces_off(const World& world, Entity organ) {
  return is_loose(world, organ) && !world.find<OrganBody>(organ)->model->finite->loose().whole();
}

}  // namespace

bool is_loose(const World& world, Entity organ) {
  const auto& finite = world.find<OrganBody>(organ)->model->finite;
  return finite && !finite->loose().empty();
}

bool is_gone(const World& world, Entity organ) {
  const FreeBody* body = world.find<FreeBody>(organ);
  return body && body->gone_at >= 0.0;
}

double Coming::towards(const Vec3& normal) const {
  return as_ones ? std::max(-way.dot(normal), kLeastAlong * way.norm()) : at_most();
}

Coming way_to_come(const World& world, Entity one, Entity other, double time) {
  if (!is_loose(world, one) && !is_loose(world, other)) return {};
  const Fall first(world, one);
  if (one == other)
    return {.besides = 2.0 * time * first.fastest_beside_mean() +
                       time * time * first.acceleration().norm(),
            .as_ones = false};
  const Fall second(world, other);
  return {.way = time * (first.velocity() - second.velocity()) +
                 time * time * (first.acceleration() - second.acceleration()),
          .besides = time * (first.fastest_beside_mean() + second.fastest_beside_mean()),
          .as_ones = !has_pieces_off(world, one) && !has_pieces_off(world, other)};
}

Vec3 coming_way(const World& world, Entity one, Entity other, double time) {
  if (one == other || has_pieces_off(world, one) || has_pieces_off(world, other))
    return Vec3::Zero();
  const Fall first(world, one), second(world, other);
  const Vec3 goes = time * (first.velocity() - second.velocity());
  const Vec3 falls = time * time * (first.acceleration() - second.acceleration());
  return goes.norm() > falls.norm() ? Vec3(goes + falls) : Vec3(Vec3::Zero());
}

Feature free_bodies_feature() {
  return {.name = "free bodies",
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
