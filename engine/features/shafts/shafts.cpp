#include "engine/features/shafts/shafts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "engine/features/contact/contact.h"
#include "engine/features/shafts/press_tools.h"
#include "engine/simulation/instruments.h"
#include "kernels/points/surface_tree.h"

namespace viscera {
namespace {

/// A shaft that begins deeper in an organ than this doesn't touch it: a step can't bring tissue
/// round it. Chosen: what a frame presses at 60 mm/s [m].
constexpr double kMostInside = 1e-3;
/// Of a barrel behind its lens: a laparoscope's working length [m].
constexpr double kBarrelLength = 0.3;

/// Only the paths' tips say where organs are prepared to be touched.
void reach(const SceneDescription& scene, const OrganDescription& organ,
           const std::vector<InstrumentBody>&, Reach& reach) {
  if (shafts_of(scene).touch && organ.deformable) reach.anywhere = true;
}

ShaftAxis barrel_axis(const EndoscopeBarrel& barrel, double time) {
  ShaftAxis axis;
  axis.begin = barrel.tip.at(time);
  const Vec3 back = axis.begin - barrel.target.at(time);
  if (back.norm() > 0.0) axis.direction = back.normalized();
  axis.length = kBarrelLength;
  return axis;
}

ShaftAxis axis_at_start(const SceneModel& model, Entity shaft) {
  const Store& constants = model.constants();
  if (const EndoscopeBarrel* barrel = constants.all<EndoscopeBarrel>().find(shaft))
    return barrel_axis(*barrel, 0.0);
  const InstrumentBody& body = *constants.all<InstrumentBody>().find(shaft);
  InstrumentState state;
  place_tool(body, 0.0, state);
  return shaft_axis(body, state);
}

/// How deep it begins in an organ. `tree`: of the organ's surface, made where it is needed.
Shaft::Spared begins_inside(const SceneModel& model, Entity shaft, double radius, std::size_t which,
                            std::optional<SurfaceTree>& tree) {
  const Entity organ = model.organs()[which];
  const OrganModel& body = *model.constants().all<OrganBody>().find(organ)->model;
  const Pose pose = model.scene().organs[which].pose_at(0.0);
  const ShaftAxis axis = axis_at_start(model, shaft);
  Shaft::Spared spared{organ, 0.0, false};
  const auto part = part_in_box(axis, bounds_at_rest(body, pose), radius);
  if (!part) return spared;
  if (!tree) tree.emplace(body.surface);
  const double step = std::max(0.5 * radius, 0.5e-3);
  for (double s = part->first;; s = std::min(s + step, part->second)) {
    const double inside = -tree->signed_distance(pose.to_local(axis.at(s)));
    spared.depth = std::max(spared.depth, inside + radius);
    if (s == axis.length && inside > 0.0 && model.constants().all<InstrumentBody>().find(shaft))
      spared.holds_trocar = true;
    if (!(s < part->second)) return spared;
  }
}

void spare_organs(SceneModel& model) {
  Pool<Shaft>& shafts = model.constants().all<Shaft>();
  for (std::size_t o = 0; o < model.organs().size(); ++o) {
    if (!model.scene().organs[o].deformable) continue;
    std::optional<SurfaceTree> tree;
    for (std::size_t i = 0; i < shafts.size(); ++i) {
      const Shaft::Spared found = begins_inside(model, shafts.owner(i), shafts[i].radius, o, tree);
      if (found.depth > kMostInside || found.holds_trocar) shafts[i].spared.push_back(found);
    }
  }
}

/// The endoscope's barrel, as the camera's path carries it.
void add_barrel(SceneModel& model, double radius) {
  const SceneDescription& scene = model.scene();
  if (!scene.camera || scene.camera->path.empty() || !(radius > 0.0)) return;
  std::vector<double> times;
  std::vector<Vec3> tips, targets;
  for (const CameraKey& key : scene.camera->path) {
    times.push_back(key.time);
    tips.push_back(key.tip);
    targets.push_back(key.target);
  }
  const Entity endoscope = model.add_entity();
  model.constants().all<EndoscopeBarrel>().add(
      endoscope, {KeyFrames(times, std::move(tips)), KeyFrames(times, std::move(targets))});
  model.constants().all<Shaft>().add(endoscope, {"endoscope", radius, 0.0, {}});
}

Result<void> prepare(SceneModel& model) {
  const SceneDescription& scene = model.scene();
  const ShaftsDescription& wanted = shafts_of(scene);
  if (!wanted.touch && !wanted.tools) return {};
  for (std::size_t i = 0; i < scene.instruments.size(); ++i)
    model.constants().all<Shaft>().add(model.instruments()[i], {scene.instruments[i].name,
                                                                scene.instruments[i].shaft_radius,
                                                                scene.instruments[i].friction,
                                                                {}});
  add_barrel(model, wanted.endoscope_radius);
  if (wanted.touch) spare_organs(model);
  return {};
}

Result<void> warn_of_spared(SceneModel& model, const std::filesystem::path&,
                            std::vector<std::string>& warnings) {
  const Pool<Shaft>& shafts = model.constants().all<Shaft>();
  for (std::size_t i = 0; i < shafts.size(); ++i)
    for (const Shaft::Spared& spared : shafts[i].spared) {
      const auto at = std::ranges::find(model.instruments(), shafts.owner(i));
      const std::string place =
          at == model.instruments().end()
              ? std::string("camera")
              : fmt::format("instruments/{}", at - model.instruments().begin());
      warnings.push_back(fmt::format(
          "{}: {}: the shaft of \"{}\" begins {:.1f} mm inside organ \"{}\"{}: it doesn't touch "
          "that organ (contact/shafts)",
          model.scene().file.string(), place, shafts[i].name, 1e3 * spared.depth,
          model.constants().all<OrganBody>().find(spared.organ)->name,
          spared.holds_trocar ? ", in which its trocar lies" : ""));
    }
  return {};
}

Result<void> start(World& world) {
  const Pool<Shaft>& shafts = world.all<Shaft>();
  for (std::size_t i = 0; i < shafts.size(); ++i) {
    ShaftState state;
    state.axis = axis_at_start(world.model(), shafts.owner(i));
    state.greatest.organs.assign(world.model().organs().size(), 0.0);
    state.greatest.tools.assign(shafts.size(), 0.0);
    world.all<ShaftState>().add(shafts.owner(i), std::move(state));
  }
  if (shafts_of(world.model().scene()).tools) note_sides(world);
  return {};
}

/// A state that another program made may say anything.
bool is_sound(const World& world, const ShaftMeeting& meeting) {
  if (!world.find<OrganContact>(meeting.organ)) return false;
  const std::size_t triangles =
      world.find<OrganBody>(meeting.organ)->model->surface.triangles.size();
  const auto on_surface = [&](const SurfacePoint& point) {
    return point.triangle >= 0 && static_cast<std::size_t>(point.triangle) < triangles;
  };
  return std::ranges::all_of(meeting.stretches,
                             [&](const ShaftStretch& stretch) {
                               return stretch.begin <= stretch.end &&
                                      stretch.end - stretch.begin == stretch.points.size() &&
                                      stretch.along.size() == stretch.points.size() &&
                                      std::ranges::all_of(stretch.points, on_surface);
                             }) &&
         std::ranges::all_of(meeting.cling.spots,
                             [&](const Cling::Spot& spot) { return on_surface(spot.point); });
}

void restored(World& world) {
  for (ShaftState& state : world.all<ShaftState>()) {
    std::erase_if(state.meetings,
                  [&](const ShaftMeeting& meeting) { return !is_sound(world, meeting); });
    state.greatest.organs.resize(world.model().organs().size(), 0.0);
    state.greatest.tools.resize(world.all<ShaftState>().size(), 0.0);
    std::erase_if(state.sides, [&](const ShaftState::Side& one) {
      return !world.find<Shaft>(one.other) || std::abs(one.side) != 1.0;
    });
  }
}

bool needed(const World& world) {
  return world.has<Shaft>();
}

}  // namespace

ShaftAxis axis_of_shaft(const World& world, Entity shaft, double time) {
  if (const EndoscopeBarrel* barrel = world.find<EndoscopeBarrel>(shaft))
    return barrel_axis(*barrel, time);
  return shaft_axis(*world.find<InstrumentBody>(shaft), *world.find<InstrumentState>(shaft));
}

std::size_t end_of_shaft_cells(const World& world, Entity organ) {
  std::size_t end = 0;
  for (const ShaftState& state : world.all<ShaftState>())
    for (const ShaftMeeting& meeting : state.meetings)
      if (meeting.organ == organ)
        for (const ShaftStretch& stretch : meeting.stretches)
          end = std::max(end, static_cast<std::size_t>(stretch.end));
  return end;
}

double force_of_shafts(const World& world, Entity organ) {
  double force = 0.0;
  for (const ShaftState& state : world.all<ShaftState>())
    for (const ShaftMeeting& meeting : state.meetings)
      if (meeting.organ == organ) force += meeting.force.norm();
  return force;
}

std::vector<ReportSection> shafts_report(const World& world) {
  const Pool<Shaft>& shafts = world.all<Shaft>();
  if (shafts.size() == 0) return {};
  Json list = Json::array();
  for (std::size_t i = 0; i < shafts.size(); ++i) {
    const ShaftFigures& most = world.find<ShaftState>(shafts.owner(i))->greatest;
    Json organs = Json::array();
    for (std::size_t o = 0; o < most.organs.size(); ++o)
      if (most.organs[o] > 0.0)
        organs.push_back(
            {{"organ", world.all<OrganBody>()[o].name}, {"greatest_force_N", most.organs[o]}});
    Json spared = Json::array();
    for (const Shaft::Spared& one : shafts[i].spared)
      spared.push_back(
          {{"organ", world.find<OrganBody>(one.organ)->name}, {"begins_inside_m", one.depth}});
    Json shaft = {{"shaft", shafts[i].name},
                  {"greatest_force_N", most.force},
                  {"greatest_length_m", most.length},
                  {"greatest_overlap_m", most.overlap},
                  {"cells", most.cells},
                  {"organs", organs},
                  {"not_touched", spared}};
    if (!world.find<EndoscopeBarrel>(shafts.owner(i))) {
      shaft["greatest_at_tip_N"] = most.at_tip;
      shaft["trocar"] = {{"greatest_reaction_N", most.reaction},
                         {"greatest_torque_Nm", most.torque}};
    }
    if (shafts_of(world.model().scene()).tools) {
      Json tools = Json::array();
      for (std::size_t t = 0; t < most.tools.size(); ++t)
        if (most.tools[t] > 0.0)
          tools.push_back({{"tool", shafts[t].name}, {"greatest_force_N", most.tools[t]}});
      shaft["tools"] = tools;
      shaft["greatest_overlap_with_tools_m"] = most.crossed;
    }
    list.push_back(std::move(shaft));
  }
  return {report_section("shafts", list)};
}

Feature shafts_feature() {
  return {.name = "shafts",
          .keys = shafts_keys(),
          .reach = reach,
          .prepare = prepare,
          .finish = warn_of_spared,
          .start = start,
          .states = {state_type<ShaftState>()},
          .stages = {{.name = "meet shafts",
                      .reads = {"tool poses", "contact cells", "organ poses"},
                      .reads_before = {"surfaces"},
                      .writes = {"contact cells"},
                      .changes = {"shafts"},
                      .needed = needed,
                      .run = meet_shafts},
                     {.name = "feel shafts",
                      .reads = {"tool poses", "organ poses", "forces"},
                      .writes = {"forces"},
                      .changes = {"shafts", "tool forces"},
                      .needed = needed,
                      .run = feel_shafts}},
          .flags = {kShaftInside, kToolsCross},
          .restored = restored,
          .report = shafts_report};
}

}  // namespace viscera
