#include "engine/features/parting/parting.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "engine/features/beds/beds_keys.h"
#include "engine/features/cautery/cautery.h"
#include "engine/features/gravity/gravity_keys.h"
#include "engine/features/held_tools/held_tools_keys.h"
#include "engine/features/links/links_keys.h"
#include "engine/features/parting/jaw_knife.h"
#include "engine/features/parting/parting_flags.h"
#include "engine/features/parting/remove_pieces.h"
#include "engine/features/parting/tear.h"
#include "engine/features/shafts/shafts_keys.h"
#include "engine/features/touching/touching_keys.h"
#include "engine/simulation/instruments.h"
#include "engine/simulation/prepare.h"

namespace viscera {
namespace {

/// Nodes that are prepared anew beside one frame, at the least, on one of two cores.
constexpr double kNodesAFrame = 8.0;
/// And the frames that handing over takes at the least.
constexpr std::uint64_t kSoonest = 6;

bool same(const TissueShare::State& a, const TissueShare::State& b) {
  return a.indices == b.indices && a.values == b.values;
}

// --- before a scene starts ----------------------------------------------------------------------

/// How near a blade comes to an organ's surface at rest along its path [m]; infinite: no nearer
/// than `farthest`.
double nearest_on_path(const InstrumentBody& tool, const OrganDescription& organ,
                       const CollisionSurface& surface, double farthest) {
  double nearest = std::numeric_limits<double>::infinity();
  constexpr double kStep = 1.0 / 60.0;
  InstrumentState state;
  for (double time = 0.0; time <= tool.description.path.back().time + kStep; time += kStep) {
    place_tool(tool, time, state);
    const Pose pose = organ.pose_at(time);
    for (const auto& edge : blade_of(tool.description) ? edges_of(tool.description, state, pose)
                                                       : std::vector<std::vector<Vec3>>{knife_way(
                                                             tool.description, state, pose)})
      for (const Vec3& place : edge)
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

/// What can't be cut beside it as yet.
Result<void> check(const SceneDescription& scene, const std::map<std::string, Tissue>& tissues) {
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

void reach(const SceneDescription&, const OrganDescription& organ,
           const std::vector<InstrumentBody>&, Reach& reach) {
  if (!cuttable_of(organ)) return;
  reach.anywhere = true;
  reach.strained_anywhere = true;
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

/// Blades that come to no organ that they could cut.
Result<void> expect_blades_to_cut(const SceneModel& model) {
  constexpr double kFarthest = 0.1;                // [m]
  if (!beds_of(model.scene()).empty()) return {};  // which they may be for
  const Pool<InstrumentBody>& tools = model.constants().all<InstrumentBody>();
  for (std::size_t i = 0; i < tools.size(); ++i) {
    if (!blade_of(tools[i].description) && !path_runs_knife(tools[i].description)) continue;
    // A hand that only its device knows may take it anywhere.
    const HapticDescription* held = haptic_of(tools[i].description);
    if (held && held->device != HapticDescription::Device::kSimulated) continue;
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t o = 0; o < model.organs().size(); ++o) {
      const Cuttable* cuttable = model.constants().all<Cuttable>().find(model.organs()[o]);
      if (!cuttable) continue;
      const OrganModel& body = *cuttable->organ->whole;
      const CollisionSurface surface(body.surface, body.rest_positions);
      nearest =
          std::min(nearest, nearest_on_path(tools[i], model.scene().organs[o], surface, kFarthest));
    }
    constexpr double kBeside = 20e-3;  // an organ may come to it [m]
    if (nearest <= kBeside) continue;
    return failure(fmt::format(
        "{}: instruments/{}/path: found a blade that stays {} from every organ that is cuttable, "
        "expected one that comes within {:g} mm",
        model.scene().file.string(), i,
        nearest <= kFarthest ? fmt::format("{:.0f} mm", 1e3 * nearest) : "over 100 mm",
        1e3 * kBeside));
  }
  return {};
}

Result<void> finish(SceneModel& model, const std::filesystem::path& assets,
                    std::vector<std::string>& warnings) {
  for (std::size_t o = 0; o < model.organs().size(); ++o) {
    if (cuttable_of(model.scene().organs[o]))
      if (auto prepared = prepare_organ_to_cut(model, o, assets, warnings); !prepared)
        return prepared;
    if (auto sound = check_wall(model, o, warnings); !sound) return sound;
  }
  return expect_blades_to_cut(model);
}

Result<void> start(World& world) {
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

// --- in a step ----------------------------------------------------------------------------------

bool is_finite_place(const Vec3& place) {
  return place.allFinite();
}

/// Prepares what is asked for, beside the frames.
void begin_body(World& world, Entity organ) {
  OrganLeft& left = *world.find<OrganLeft>(organ);
  const OrganCut& cut = *world.find<OrganCut>(organ);
  left.next = std::async(std::launch::async, [organ = world.find<Cuttable>(organ)->organ,
                                              tissue = world.find<OrganCut>(organ)->asked,
                                              removed = places_removed(cut, cut.removed_asked),
                                              before = world.find<OrganBody>(organ)->model,
                                              fields = left.fields] {
                return cut_organ(*organ, tissue, removed, *before, *fields);
              }).share();
}

/// The organ is this body from now on; `continuation` as World::replace has it.
void take_body(World& world, Entity organ, const CutOrgan& cut, const Continuation* continuation) {
  OrganLeft& left = *world.find<OrganLeft>(organ);
  left.fields = cut.fields;
  left.depths = cut.depths;
  left.pieces = cut.pieces;
  left.crumbs = cut.crumbs;
  left.removed = cut.removed;
  left.tree = cut.tree;
  left.heated = cut.heated;
  left.greatest_seconds = std::max(left.greatest_seconds, cut.seconds);
  world.replace(organ, cut.model, continuation);
}

void take_due_body(World& world, Entity organ, OrganCut& cut, FrameReport& report) {
  OrganLeft& left = *world.find<OrganLeft>(organ);
  const Result<CutOrgan>& made = left.next.get();
  cut.pending = false;
  if (made) {
    cut.used = made->tissue;
    cut.remnants += made->remnants;
    cut.gone.limit_by(made->tissue);
    left.made_of = cut.used.state();
    left.made_without = places_removed(cut, cut.removed_asked);
    ++cut.bodies;
    const std::vector<Entity> emptied =
        jaws_on(world, organ, leaving_pieces(world, organ, cut.removed_asked));
    cut.removed_used = cut.removed_asked;
    take_body(world, organ, *made, &made->continuation);
    for (const Entity jaws : emptied) world.find<InstrumentContact>(jaws)->grasp.reset();
  } else {
    left.refusal = made.error().text();
    // What was to leave without being cut off stays, and may be brought again.
    cut.removed.resize(cut.removed_used);
    cut.removed_asked = cut.removed_used;
    ++cut.refused;
    report.raise(kCutRefused);
  }
  left.next = {};
}

void ask_for_body(World& world, Entity organ, OrganCut& cut, std::uint64_t frame) {
  cut.asked = cut.gone;
  withdraw_dropped(world, organ);
  cut.removed_asked = cut.removed.size();
  cut.vaporised_asked = cut.vaporised;
  cut.changed = false;
  cut.pending = true;
  const std::size_t nodes = world.find<OrganBody>(organ)->model->cloud.size();
  cut.due =
      frame + kSoonest + static_cast<std::uint64_t>(static_cast<double>(nodes) / kNodesAFrame);
  begin_body(world, organ);
}

/// Bodies that a loaded state has otherwise are made again.
Result<void> bodies_loaded(World& world) {
  const Pool<OrganCut>& cuts = world.all<OrganCut>();
  for (std::size_t c = 0; c < cuts.size(); ++c) {
    const Entity organ = cuts.owner(c);
    const OrganCut& cut = cuts[c];
    OrganLeft& left = *world.find<OrganLeft>(organ);
    left.next = {};
    const CuttableOrgan& all = *world.find<Cuttable>(organ)->organ;
    if (auto sound = check_removed(cut, all.whole->rest_bounds); !sound) return sound;
    std::vector<Vec3> without = places_removed(cut, cut.removed_used);
    if (!same(left.made_of, cut.used.state()) || left.made_without != without) {
      const CuttableOrgan& whole = all;
      left.made_of = {};  // until there is such a body
      if (cut.used.untouched()) {
        left.fields = whole.fields;
        left.depths.clear();
        left.pieces.clear();
        left.tree = nullptr;
        left.heated.clear();
        left.crumbs = left.removed = 0.0;
        world.replace(organ, whole.whole, nullptr);
      } else {
        auto made = cut_organ(whole, cut.used, without, *whole.whole, *whole.fields);
        if (!made) return failure("cut organs: " + made.error().text());
        take_body(world, organ, *made, nullptr);
      }
      left.made_of = cut.used.state();
      left.made_without = std::move(without);
    }
    if (cut.pending) begin_body(world, organ);
  }
  return {};
}

/// A state that another program made may say anything: of blades that there aren't, or of which one
/// list is longer than another.
void drop_unsound_tracks(World& world) {
  Pool<OrganCut>& cuts = world.all<OrganCut>();
  for (OrganCut& cut : cuts) {
    std::vector<BladeTrack> sound;
    for (BladeTrack& track : cut.blades) {
      const InstrumentBody* tool = world.find<InstrumentBody>(track.instrument);
      const bool known = std::ranges::any_of(sound, [&](const BladeTrack& other) {
        return other.instrument == track.instrument && other.blade == track.blade;
      });
      const std::uint64_t blades =
          tool && tool->description.kind == InstrumentKind::kScissors ? 2 : 1;
      if (!tool || known || track.blade >= blades) continue;
      const bool whole =
          track.above.size() == track.edge.size() && track.pieces.size() == track.edge.size() &&
          std::ranges::all_of(track.edge, &is_finite_place) &&
          std::ranges::all_of(track.above, [](double a) { return std::isfinite(a); });
      if (!whole) track.lose();
      sound.push_back(std::move(track));
    }
    cut.blades = std::move(sound);
  }
}

bool may_vaporise(const World& world) {
  return world.has<OrganCut>() && world.has<OrganBurn>();
}

}  // namespace

bool cuts(const World& world, Entity instrument, Entity organ) {
  return world.find<OrganCut>(organ) &&
         blade_of(world.find<InstrumentBody>(instrument)->description);
}

void part_organs(World& world, const FrameContext& context) {
  Pool<OrganCut>& organs = world.all<OrganCut>();
  for (std::size_t o = 0; o < organs.size(); ++o) {
    const Entity organ = organs.owner(o);
    if (organs[o].pending && context.frame >= organs[o].due)
      take_due_body(world, organ, organs[o], *context.report);
    if (!organs[o].pending && organs[o].changed)
      ask_for_body(world, organ, organs[o], context.frame);
  }
}

Feature parting_feature() {
  return {.name = "parting",
          .keys = parting_keys(),
          .check = check,
          .reach = reach,
          .finish = finish,
          .start = start,
          .states = {state_type<OrganCut>(), state_type<JawKnife>()},
          .stages = {{.name = "part organs",
                      .reads_before = {"cuts", "cuts by heat"},
                      .writes = {"organ bodies"},
                      .changes = {"cut organs", "organ contacts", "organ shapes", "tool forces",
                                  "organs that touch", "resting organs", "beds", "burns",
                                  "coagulated organs", "clips"},
                      .needed = [](const World& world) { return world.has<OrganCut>(); },
                      .run = part_organs},
                     {.name = "cut tissue",
                      .reads = {"tool poses", "organ poses", "shapes", "forces"},
                      .writes = {"forces", "cuts"},
                      .changes = {"cut organs", "tool forces", "jaw knives"},
                      .needed = [](const World& world) { return world.has<OrganCut>(); },
                      .run = cut_tissue},
                     {.name = "remove pieces",
                      .reads = {"tool poses", "contact cells", "cuts"},
                      .writes = {"cuts"},
                      .changes = {"cut organs"},
                      .needed = [](const World& world) { return world.has<OrganCut>(); },
                      .run = remove_pieces},
                     {.name = "tear tissue",
                      .reads = {"shapes"},
                      .writes = {"cuts"},
                      .changes = {"cut organs"},
                      .needed = may_tear,
                      .run = tear_tissue},
                     {.name = "vaporise tissue",
                      .reads = {"heat"},
                      .writes = {"cuts by heat"},
                      .changes = {"cut organs"},
                      .needed = may_vaporise,
                      .run = take_vaporised}},
          .flags = {kCutRefused, kPieceStuck},
          .bodies_loaded = bodies_loaded,
          .restored = drop_unsound_tracks,
          .report = parting_report};
}

}  // namespace viscera
