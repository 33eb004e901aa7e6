#include "engine/features/local/local.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/features/contact/tissue_as_met.h"
#include "engine/features/held_tools/held_tools_keys.h"
#include "engine/features/local/hive_settings.h"
#include "kernels/hive/hive_contact.h"

namespace viscera {
namespace {

bool is_local(const OrganDescription& organ) {
  return organ.response == Response::kLocal && organ.deformable;
}

bool is_linear(const Tissue& tissue) {
  return tissue.model == HyperelasticModel::kLinear && tissue.prony.empty();
}

/// Where hives travel with each tool, all of them must be such as hives know; a held tool always.
Result<void> check(const SceneDescription& scene, const std::map<std::string, Tissue>& tissues) {
  const bool travel = std::ranges::any_of(scene.organs, [&](const OrganDescription& organ) {
    return is_local(organ) && !is_linear(tissue_of(organ, tissues));
  });
  const bool yields = std::ranges::any_of(scene.organs, &OrganDescription::deformable);
  Error mistakes;
  for (std::size_t i = 0; i < scene.instruments.size(); ++i) {
    const InstrumentDescription& tool = scene.instruments[i];
    if (!(travel || (yields && haptic_of(tool)))) continue;
    if (auto round = check_round(tool.tip); !round)
      mistakes.messages.push_back(
          fmt::format("{}: instruments/{}/{}", scene.file.string(), i, round.error().text()));
  }
  if (!mistakes.messages.empty()) return std::unexpected(mistakes);
  return {};
}

Result<void> prepare(SceneModel& model) {
  const SceneDescription& scene = model.scene();
  Error error;
  for (std::size_t o = 0; o < scene.organs.size(); ++o) {
    if (!is_local(scene.organs[o])) continue;
    const auto wrong = [&](const std::string& what) {
      error.messages.push_back(
          fmt::format("{}: organs/{}/response: {}", scene.file.string(), o, what));
    };
    const Entity organ = model.organs()[o];
    const OrganBody& body = *model.constants().all<OrganBody>().find(organ);
    auto walkable = WalkableSurface::make(body.model->surface);
    if (!walkable) {
      wrong(walkable.error().text());
      continue;
    }
    LocalBody local{std::make_shared<const WalkableSurface>(std::move(*walkable)),
                    contact_hive(scene.instruments, body)};
    const auto sound = HiveContact::create(*local.walkable, local.hive);
    if (!sound)
      wrong(sound.error().text());
    else
      model.constants().all<LocalBody>().add(organ, std::move(local));
  }
  if (!error.messages.empty()) return std::unexpected(error);
  return {};
}

/// Hands for tools on paths; held ones bring their own.
Result<void> start(World& world) {
  const SceneDescription& scene = world.model().scene();
  const Pool<LocalBody>& bodies = world.all<LocalBody>();
  Error error;
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const Entity organ = bodies.owner(b);
    const OrganBody& body = *world.find<OrganBody>(organ);
    if (is_linear(body.tissue)) continue;
    LocalFeel feel;
    for (std::size_t i = 0; i < scene.instruments.size(); ++i) {
      if (haptic_of(scene.instruments[i])) continue;
      const auto wrong = [&](const std::string& what) {
        error.messages.push_back(
            fmt::format("{}: instruments/{}/{}", scene.file.string(), i, what));
      };
      auto settings = hive_settings(scene.instruments[i], body, HiveBuilding::kInLockstep);
      if (!settings) {
        wrong(settings.error().text());
        continue;
      }
      auto tissue = HiveTissue::create({bodies[b].walkable.get(), nullptr, nullptr}, *settings);
      if (!tissue) {
        wrong(tissue.error().text());
        continue;
      }
      feel.touches.push_back({world.model().instruments()[i], std::move(*tissue),
                              scene.instruments[i].path.front().tip});
    }
    world.all<LocalFeel>().add(organ, std::move(feel));
  }
  if (!error.messages.empty()) return std::unexpected(error);
  return {};
}

/// The force that contact found on the tool gives way to what its hives say.
void feel(World& world, Entity organ, LocalFeel::Touch& touch, const FrameContext& context) {
  const InstrumentState& state = *world.find<InstrumentState>(touch.instrument);
  TissueSnapshot& snapshot = touch.tissue->snapshots().back();
  snapshot.frame = context.frame;
  snapshot.tick = world.model().steps().last_tick(context.frame);
  std::optional<TissueUnder> under;
  if (const auto ask = ask_tissue_under(world, organ, touch.instrument)) under = ask();
  if (meet_tissue(world, organ, touch.instrument, touch.tissue->reach(), under, snapshot))
    touch.tissue->snapshots().publish();
  const ToolMotion motion{
      {state.tip, Quaternion::Identity()}, (state.tip - touch.tip) / context.dt, 0, snapshot.tick};
  const TactileForce felt = touch.tissue->respond(motion, context.dt);
  touch.tip = state.tip;
  InstrumentContact& tool = *world.find<InstrumentContact>(touch.instrument);
  for (CellRange& range : world.find<OrganTouch>(organ)->ranges) {
    if (range.instrument != touch.instrument || range.held) continue;
    const Pose& pose = pose_of(world, organ);
    tool.force += felt.force + pose.direction_to_world(range.force);
    range.felt = -pose.direction_to_local(felt.force);
    if (tool.touching && tool.organ == organ) tool.strongest = range.felt.norm();
  }
}

void feel_local_organs(World& world, const FrameContext& context) {
  Pool<LocalFeel>& feels = world.all<LocalFeel>();
  for (std::size_t o = 0; o < feels.size(); ++o) {
    if (world.find<OrganState>(feels.owner(o))->frozen) continue;
    for (LocalFeel::Touch& touch : feels[o].touches) feel(world, feels.owner(o), touch, context);
  }
}

}  // namespace

Feature local_feature() {
  return {.name = "local",
          .check = check,
          .prepare = prepare,
          .start = start,
          .states = {state_type<LocalFeel>()},
          .stages = {{.name = "feel local organs",
                      .reads = {"tool poses", "organ poses", "shapes", "forces"},
                      .writes = {"forces"},
                      .changes = {"feel of local organs", "organ contacts", "tool forces"},
                      .needed = [](const World& world) { return world.has<LocalFeel>(); },
                      .run = feel_local_organs}}};
}

}  // namespace viscera
