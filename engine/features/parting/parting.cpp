#include "engine/features/parting/parting.h"

#include <algorithm>
#include <cmath>

#include "engine/features/cautery/cautery.h"
#include "engine/features/parting/jaw_knife.h"
#include "engine/features/parting/parting_flags.h"
#include "engine/features/parting/parting_setup.h"
#include "engine/features/parting/remove_pieces.h"
#include "engine/features/parting/tear.h"

namespace viscera {
namespace {

/// Nodes that are prepared anew in a second beside the frames, at the least, on one of two cores.
constexpr double kNodesASecond = 480.0;
/// And the frames that handing over takes at the least.
constexpr std::uint64_t kSoonest = 6;

bool same(const TissueShare::State& a, const TissueShare::State& b) {
  return a.indices == b.indices && a.values == b.values;
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
  left.loose = cut.loose;
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
    let_go(world, organ, leaving_pieces(world, organ, cut.removed_asked));
    cut.removed_used = cut.removed_asked;
    take_body(world, organ, *made, &made->continuation);
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
  const double takes = static_cast<double>(nodes) / kNodesASecond;  // [s]
  cut.due =
      frame + kSoonest +
      static_cast<std::uint64_t>(takes * static_cast<double>(world.model().steps().per_second));
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
    const CuttableOrgan& whole = *world.find<Cuttable>(organ)->organ;
    if (auto sound = check_removed(cut, whole.whole->rest_bounds); !sound) return sound;
    std::vector<Vec3> without = places_removed(cut, cut.removed_used);
    if (!same(left.made_of, cut.used.state()) || left.made_without != without) {
      left.made_of = {};  // until there is such a body
      if (cut.used.untouched()) {
        left.fields = whole.fields;
        left.depths.clear();
        left.pieces.clear();
        left.loose.clear();
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
          track.above.size() == track.edge.size() && track.outside.size() == track.edge.size() &&
          track.pieces.size() == track.edge.size() &&
          std::ranges::all_of(track.outside, [](double a) { return std::isfinite(a); }) &&
          std::ranges::all_of(track.edge, [](const Vec3& p) { return p.allFinite(); }) &&
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
          .check = check_parting,
          .reach = reach_of_cuts,
          .finish = finish_parting,
          .start = start_parting,
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
