#include "engine/features/breathing/breathing.h"

#include <fmt/format.h>

namespace viscera {
namespace {

Result<void> prepare(SceneModel& model) {
  for (std::size_t o = 0; o < model.organs().size(); ++o) {
    const OrganDescription& organ = model.scene().organs[o];
    if (const MotionDescription* motion = motion_of(organ))
      model.constants().all<OrganMotion>().add(model.organs()[o],
                                               {.pose = organ.pose, .motion = *motion});
    if (organ.deformable && !hold_motions_of(organ).empty())
      model.constants().all<MovingHolds>().add(model.organs()[o], {hold_motions_of(organ)});
  }
  return {};
}

void move_organs(World& world, const FrameContext& context) {
  const Pool<OrganMotion>& motions = world.all<OrganMotion>();
  for (std::size_t i = 0; i < motions.size(); ++i) {
    const Entity organ = motions.owner(i);
    Pose& pose = world.find<OrganPose>(organ)->pose;
    const Vec3 last = pose.position;
    pose.position = motions[i].pose.position + motions[i].motion.displacement(context.time);
    // Surfaces stay as they are in the organ's own frame; only their box is kept in the world's.
    if (OrganTouch* touch = world.find<OrganTouch>(organ))
      touch->bounds.translate(pose.position - last);
  }
}

void reach(const SceneDescription&, const OrganDescription& organ,
           const std::vector<InstrumentBody>&, Reach& reach) {
  if (!organ.deformable) return;
  for (const HoldMotion& hold : hold_motions_of(organ)) reach.moving_holds.push_back(hold.hold);
}

Result<void> check(const SceneDescription& scene, const std::map<std::string, Tissue>&) {
  Error mistakes;
  for (std::size_t o = 0; o < scene.organs.size(); ++o)
    if (scene.organs[o].response == Response::kLocal && !hold_motions_of(scene.organs[o]).empty())
      mistakes.messages.push_back(fmt::format(
          "{}: organs/{}/moving_holds: found some with response local, expected none: hives know "
          "no holds that move",
          scene.file.string(), o));
  if (!mistakes.messages.empty()) return std::unexpected(mistakes);
  return {};
}

Result<void> start(World& world) {
  const Pool<MovingHolds>& holds = world.all<MovingHolds>();
  for (std::size_t i = 0; i < holds.size(); ++i) {
    const Entity organ = holds.owner(i);
    const std::vector<Vec3> still(holds[i].motions.size(), Vec3(Vec3::Zero()));
    world.all<HoldWays>().add(organ, {still, still});
    const OrganModel& model = *world.find<OrganBody>(organ)->model;
    if (!model.hold_ways.empty() && !world.find<FreeShape>(organ))
      world.all<FreeShape>().add(organ, level_shape(model));
  }
  return {};
}

void move_holds(World& world, const FrameContext& context) {
  Pool<HoldWays>& all = world.all<HoldWays>();
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Entity organ = all.owner(i);
    const std::vector<HoldMotion>& motions = world.find<MovingHolds>(organ)->motions;
    std::vector<Vec3> ways;
    for (const HoldMotion& hold : motions)
      ways.push_back(
          pose_of(world, organ).direction_to_local(hold.motion.displacement(context.time)));
    all[i].before = all[i].ways;
    if (ways == all[i].ways) continue;
    all[i].ways = std::move(ways);
    if (FreeShape* shape = world.find<FreeShape>(organ)) shape->stale = true;
  }
}

bool shape(const World& world, Entity organ, std::vector<float>& places) {
  const HoldWays* holds = world.find<HoldWays>(organ);
  if (!holds) return false;
  const OrganModel& model = *world.find<OrganBody>(organ)->model;
  if (model.hold_ways.empty()) return false;
  const std::size_t of_hold = 3 * places.size();
  bool moved = false;
  for (std::size_t h = 0; h < holds->ways.size(); ++h) {
    if (holds->ways[h].isZero(0.0)) continue;
    moved = true;
    add_along_axes(std::span(model.hold_ways).subspan(h * of_hold, of_hold), holds->ways[h],
                   places);
  }
  return moved;
}

}  // namespace

Feature breathing_feature() {
  return {.name = "breathing",
          .keys = breathing_keys(),
          .check = check,
          .reach = reach,
          .prepare = prepare,
          .start = start,
          .states = {state_type<HoldWays>()},
          .stages = {{.name = "move organs",
                      .writes = {"organ poses"},
                      .changes = {"organ poses", "organ contacts"},
                      .needed = [](const World& world) { return world.has<OrganMotion>(); },
                      .run = move_organs},
                     {.name = "move holds",
                      .reads = {"organ poses"},
                      .writes = {"parts of free shapes"},
                      .changes = {"moving holds", "free shapes"},
                      .needed = [](const World& world) { return world.has<HoldWays>(); },
                      .run = move_holds}},
          .shape = shape};
}

}  // namespace viscera
