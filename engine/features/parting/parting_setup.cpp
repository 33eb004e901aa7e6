#include "engine/features/parting/parting_setup.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "engine/features/beds/beds_keys.h"
#include "engine/features/cautery/cautery.h"
#include "engine/features/gravity/gravity_keys.h"
#include "engine/features/held_tools/held_tools_keys.h"
#include "engine/features/links/links_keys.h"
#include "engine/features/parting/jaw_knife.h"
#include "engine/features/parting/parting.h"
#include "engine/features/shafts/shafts_keys.h"
#include "engine/features/touching/touching_keys.h"
#include "engine/simulation/instruments.h"
#include "engine/simulation/prepare.h"

namespace viscera {
namespace {

/// What of a tool cuts as it stands there: its edges, or the way of the knife between its jaws.
std::vector<std::vector<Vec3>> cutting_lines(const InstrumentDescription& tool,
                                             const InstrumentState& state, const Pose& organ) {
  if (blade_of(tool)) return edges_of(tool, state, organ);
  return {knife_way(tool, state, organ)};
}

/// How near a blade comes to an organ's surface at rest along its path [m]; infinite: no nearer
/// than `farthest`.
double nearest_on_path(const InstrumentBody& tool, const OrganDescription& organ,
                       const CollisionSurface& surface, double farthest) {
  double nearest = std::numeric_limits<double>::infinity();
  constexpr double kStep = 1.0 / 60.0;
  InstrumentState state;
  for (double time = 0.0; time <= tool.description.path.back().time + kStep; time += kStep) {
    place_tool(tool, time, state);
    for (const auto& line : cutting_lines(tool.description, state, organ.pose_at(time)))
      for (const Vec3& place : line)
        if (const auto hit = surface.closest(place, farthest))
          nearest = std::min(nearest, hit->distance);
  }
  return nearest;
}

/// In brackets, those whose strain at failure is known; empty: none.
std::string tissues_that_tear(const std::map<std::string, Tissue>& tissues) {
  std::string known;
  for (const auto& [name, tissue] : tissues)
    if (tissue.ultimate_strain > 0.0) known += (known.empty() ? "" : ", ") + name;
  return known.empty() ? "" : fmt::format(" ({})", known);
}

/// Heat knows cuts by its own voxels: wider ones would let it cross them, and finer ones than a
/// cut's say less of them than there is to know.
Result<void> check_heat_voxel(const SceneDescription& scene, std::size_t o, double voxel) {
  const double heat = heat_of(scene).voxel;
  constexpr double kAlmost = 1.0 + 1e-9;
  if (heat <= 2.0 * voxel * kAlmost && voxel <= heat * kAlmost) return {};
  return failure(fmt::format(
      "{}: organs/{}/cuttable/voxel_mm: found {:g} where heat/voxel_mm is {:g}, expected {:g} to "
      "{:g}: heat would cross cuts, or not know where they are",
      scene.file.string(), o, 1e3 * voxel, 1e3 * heat, 0.5e3 * heat, 1e3 * heat));
}

/// Of organs with a wall: it isn't thicker than the organ, and something may go through it.
Result<void> check_wall(const SceneModel& model, std::size_t o,
                        std::vector<std::string>& warnings) {
  const WallDescription* wall = wall_of(model.scene().organs[o]);
  if (!wall) return {};
  const Store& constants = model.constants();
  const Entity organ = model.organs()[o];
  const std::string at = fmt::format("{}: organs/{}/wall_mm", model.scene().file.string(), o);
  if (!constants.all<Cuttable>().find(organ) && !constants.all<BurnableOrgan>().find(organ)) {
    warnings.push_back(at + ": nothing cuts or heats this organ: there can be no perforations");
    return {};
  }
  const OrganModel& body = *constants.all<OrganBody>().find(organ)->model;
  const SurfaceTree surface(body.surface);
  double deepest = 0.0;  // no place is farther from a node than its spacing
  for (std::size_t n = 0; n < body.cloud.size(); ++n)
    deepest = std::max(deepest,
                       body.cloud.spacings[n] - surface.signed_distance(body.cloud.positions[n]));
  if (wall->thickness <= deepest) return {};
  return failure(
      fmt::format("{}: found {:g}, expected at most {:.1f}: no place of the organ lies "
                  "deeper below its surface",
                  at, 1e3 * wall->thickness, 1e3 * deepest));
}

Result<void> prepare_organ_to_cut(SceneModel& model, std::size_t o,
                                  const std::filesystem::path& assets,
                                  std::vector<std::string>& warnings) {
  const OrganDescription& organ = model.scene().organs[o];
  const Entity entity = model.organs()[o];
  const OrganBody& body = *model.constants().all<OrganBody>().find(entity);
  const auto at = [&](const std::string& what) {
    return fmt::format("{}: organs/{} (\"{}\"): {}", model.scene().file.string(), o, organ.name,
                       what);
  };
  if (!body.model->finite)
    return failure(
        at("cuttable: found an organ that isn't at finite strain, expected response "
           "finite"));
  std::vector<InstrumentBody> tools;
  for (const InstrumentBody& tool : model.constants().all<InstrumentBody>()) tools.push_back(tool);
  const Tissue tissue = tissue_of(organ, model.tissues());
  const Reach reached = reach_of(tools, model.scene(), organ, model.features());
  auto demand = demand_on(organ, tissue, reached, body.model->surface);
  if (!demand) return std::unexpected(demand.error());
  Vec3 gravity = Vec3::Zero();
  if (const GravityDescription* acts = gravity_of(model.scene()))
    gravity = organ.pose.direction_to_local(acts->acceleration * acts->rest_direction);
  const BurnableOrgan* burnable = model.constants().all<BurnableOrgan>().find(entity);
  const double voxel = cuttable_of(organ)->voxel;
  if (burnable)
    if (auto fits = check_heat_voxel(model.scene(), o, voxel); !fits) return fits;
  auto made = make_cuttable(body.model, organ, tissue, *std::move(demand), gravity,
                            burnable ? burnable->options.voxel : 0.0, assets);
  if (tissue.fracture_energy == 0.0)
    warnings.push_back(
        at(fmt::format("cuttable: tissues/{} has no fracture_energy: blades feel no "
                       "force of it",
                       organ.tissue)));
  for (const InstrumentBody& tool : tools) {
    const BladeDescription* blade = blade_of(tool.description);
    const BladeDescription knife = knife_of(tool.description);
    if (!blade && knife_way_of(tool.description) > 0.0) blade = &knife;
    if (!blade || blade->thickness >= 2.0 * voxel) continue;
    warnings.push_back(at(fmt::format(
        "cuttable/voxel_mm: cuts by \"{}\" are {:g} mm wide, two voxels, where its blade has {:g}",
        tool.description.name, 2e3 * voxel, 1e3 * blade->thickness)));
  }
  model.constants().all<Cuttable>().add(entity,
                                        {std::move(made), voxel, tissue.fracture_energy,
                                         cuttable_of(organ)->tears ? tissue.ultimate_strain : 0.0});
  return {};
}

bool has_bed(const SceneDescription& scene, const std::string& organ) {
  return std::ranges::any_of(beds_of(scene), [&](const BedDescription& bed) {
    return std::ranges::find(bed.between, organ) != bed.between.end();
  });
}

/// Blades that come to no organ that they could cut, or whose bed they could.
Result<void> expect_blades_to_cut(const SceneModel& model) {
  constexpr double kFarthest = 0.1;  // [m]
  const SceneDescription& scene = model.scene();
  const Pool<InstrumentBody>& tools = model.constants().all<InstrumentBody>();
  for (std::size_t i = 0; i < tools.size(); ++i) {
    const bool parts_beds = blade_of(tools[i].description) != nullptr;
    if (!parts_beds && !path_runs_knife(tools[i].description)) continue;
    // A hand that only its device knows may take it anywhere.
    const HapticDescription* held = haptic_of(tools[i].description);
    if (held && held->device != HapticDescription::Device::kSimulated) continue;
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t o = 0; o < model.organs().size(); ++o) {
      if (!cuttable_of(scene.organs[o]) && !(parts_beds && has_bed(scene, scene.organs[o].name)))
        continue;
      const OrganModel& body = *model.constants().all<OrganBody>().find(model.organs()[o])->model;
      const CollisionSurface surface(body.surface, body.rest_positions);
      nearest = std::min(nearest, nearest_on_path(tools[i], scene.organs[o], surface, kFarthest));
    }
    constexpr double kBeside = 20e-3;  // an organ may come to it [m]
    if (nearest <= kBeside) continue;
    return failure(fmt::format(
        "{}: instruments/{}/path: found a blade that stays {} from every organ that is cuttable{}, "
        "expected one that comes within {:g} mm",
        scene.file.string(), i,
        nearest <= kFarthest ? fmt::format("{:.0f} mm", 1e3 * nearest) : "over 100 mm",
        parts_beds && !beds_of(scene).empty() ? " or has a bed" : "", 1e3 * kBeside));
  }
  return {};
}

}  // namespace

Result<void> check_parting(const SceneDescription& scene,
                           const std::map<std::string, Tissue>& tissues) {
  Error mistakes;
  const auto wrong = [&](const std::string& where, const std::string& what) {
    mistakes.messages.push_back(fmt::format("{}: {}: {}", scene.file.string(), where, what));
  };
  bool cuttable = false;
  for (std::size_t o = 0; o < scene.organs.size(); ++o) {
    const OrganDescription& organ = scene.organs[o];
    if (!cuttable_of(organ)) continue;
    cuttable = true;
    const std::string at = fmt::format("organs/{}/", o);
    if (cuttable_of(organ)->tears && tissues.at(organ.tissue).ultimate_strain == 0.0)
      wrong(at + "cuttable/tears",
            fmt::format("found true, but tissues/{}/ultimate_strain isn't known; expected false, "
                        "or a tissue that has it{}",
                        organ.tissue, tissues_that_tear(tissues)));
    if (organ.free)
      wrong(at + "free", "found true for an organ that is cuttable, expected false: hold it");
    if (!organ.deformable) wrong(at + "cuttable", "found beside deformable false, expected true");
    if (organ.response == Response::kLinear || organ.response == Response::kLocal)
      wrong(at + "response", fmt::format("found {} for an organ that is cuttable, expected finite "
                                         "or auto",
                                         organ.response == Response::kLinear ? "linear" : "local"));
    if (organ.formulation != "galerkin")
      wrong(at + "formulation", fmt::format("found {} for an organ that is cuttable, expected "
                                            "galerkin",
                                            organ.formulation));
  }
  const TouchingDescription& touching = touching_of(scene);
  if (cuttable && (touching.folds || shafts_of(scene).touch))
    wrong("contact",
          "found folds or shafts that touch beside an organ that is cuttable, expected false: they "
          "don't meet walls of cuts yet");
  const auto expect_uncut = [&](const auto& ties, const char* key) {
    for (std::size_t k = 0; k < ties.size(); ++k)
      for (const OrganDescription& organ : scene.organs)
        if (cuttable_of(organ) &&
            std::ranges::find(ties[k].between, organ.name) != ties[k].between.end())
          wrong(
              fmt::format("{}/{}/between", key, k),
              fmt::format("found \"{}\", which is cuttable, expected organs that aren't: {} don't "
                          "follow cuts yet",
                          organ.name, key));
  };
  expect_uncut(links_of(scene), "links");
  if (!cuttable && beds_of(scene).empty() && std::ranges::any_of(scene.instruments, blade_of))
    wrong("instruments",
          "found a scalpel or scissors, expected an organ with \"cuttable\", or a bed, for it to "
          "cut");
  for (std::size_t i = 0; i < scene.instruments.size() && !cuttable; ++i)
    if (const double way = knife_way_of(scene.instruments[i]); way > 0.0)
      wrong(fmt::format("instruments/{}/bipolar/blade_mm", i),
            fmt::format("found {:g}, expected an organ with \"cuttable\" for the knife to cut",
                        1e3 * way));
  if (!mistakes.messages.empty()) return std::unexpected(mistakes);
  return {};
}

void reach_of_cuts(const SceneDescription&, const OrganDescription& organ,
                   const std::vector<InstrumentBody>&, Reach& reach) {
  if (!cuttable_of(organ)) return;
  reach.anywhere = true;
  reach.strained_anywhere = true;
}

Result<void> finish_parting(SceneModel& model, const std::filesystem::path& assets,
                            std::vector<std::string>& warnings) {
  for (std::size_t o = 0; o < model.organs().size(); ++o) {
    if (cuttable_of(model.scene().organs[o]))
      if (auto prepared = prepare_organ_to_cut(model, o, assets, warnings); !prepared)
        return prepared;
    if (auto sound = check_wall(model, o, warnings); !sound) return sound;
  }
  return expect_blades_to_cut(model);
}

Result<void> start_parting(World& world) {
  const Pool<Cuttable>& organs = world.all<Cuttable>();
  for (std::size_t o = 0; o < organs.size(); ++o) {
    OrganCut cut;
    cut.gone = cut.asked = cut.used = TissueShare(organs[o].voxel);
    world.all<OrganCut>().add(organs.owner(o), std::move(cut));
    OrganLeft left;
    left.fields = organs[o].organ->fields;
    world.all<OrganLeft>().add(organs.owner(o), std::move(left));
  }
  for (const Entity instrument : world.model().instruments())
    if (knife_way_of(world.find<InstrumentBody>(instrument)->description) > 0.0)
      world.all<JawKnife>().add(instrument, {});
  return {};
}

}  // namespace viscera
