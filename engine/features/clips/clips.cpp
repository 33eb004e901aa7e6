#include "engine/features/clips/clips.h"

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>

#include "engine/features/clips/clips_flags.h"
#include "engine/features/clips/hold_clips.h"
#include "engine/features/held_tools/held_tools_keys.h"
#include "engine/simulation/tool_shape.h"
#include "kernels/points/surface_tree.h"

namespace viscera {
namespace {

/// A clip may be applied to an organ that comes to it from so far [m].
constexpr double kAboutClip = 20e-3;
/// Tissue this far beside its bars moves with them [m].
constexpr double kBesideBars = 4e-3;
/// Ducts may begin and end on the surface, up to this [m].
constexpr double kInOrgan = 0.5e-3;

/// The times at which an applier closes.
std::vector<double> closings_of(const InstrumentBody& tool) {
  std::vector<double> times;
  bool closed = false;
  constexpr double kStep = 1.0 / 60.0;
  for (double time = 0.0; time <= tool.description.path.back().time + kStep; time += kStep) {
    const bool was_closed = closed;
    closed = jaw_closed(was_closed, tool.jaw.at(time).x());
    if (closed && !was_closed) times.push_back(time);
  }
  return times;
}

/// The middle of its bars.
Vec3 middle_at(const InstrumentBody& tool, double time) {
  const Vec3 tip = tool.tip.at(time);
  return tip +
         0.5 * clips_of(tool.description)->length * (tool.description.trocar - tip).normalized();
}

Result<void> check_clips(const SceneDescription& scene, const std::map<std::string, Tissue>&) {
  Error mistakes;
  for (std::size_t i = 0; i < scene.instruments.size(); ++i) {
    const ClipsDescription* clips = clips_of(scene.instruments[i]);
    if (!clips) continue;
    for (std::size_t o = 0; o < scene.organs.size(); ++o)
      if (scene.organs[o].deformable && scene.organs[o].response == Response::kLocal)
        mistakes.messages.push_back(fmt::format(
            "{}: organs/{}/response: found local beside a clip applier, expected linear, finite or "
            "auto: hives hold no clips",
            scene.file.string(), o));
    if (clips->gap >= clips->opening)
      mistakes.messages.push_back(fmt::format(
          "{}: instruments/{}/clip_gap_mm: found {:g}, expected less than clip_opening_mm, {:g}",
          scene.file.string(), i, 1e3 * clips->gap, 1e3 * clips->opening));
    if (haptic_of(scene.instruments[i]))
      mistakes.messages.push_back(
          fmt::format("{}: instruments/{}/haptic: found for a clip applier, expected none: hands "
                      "don't feel one",
                      scene.file.string(), i));
  }
  if (!mistakes.messages.empty()) return std::unexpected(mistakes);
  return {};
}

/// What it squeezes must be prepared where it closes.
void reach_clips(const SceneDescription&, const OrganDescription& organ,
                 const std::vector<InstrumentBody>& tools, Reach& reach) {
  for (const InstrumentBody& tool : tools) {
    const ClipsDescription* clips = clips_of(tool.description);
    if (!clips) continue;
    const double radius = 0.5 * std::hypot(clips->length, clips->opening);
    for (const double time : closings_of(tool)) {
      const Vec3 local = organ.pose_at(time).to_local(middle_at(tool, time));
      reach.closings.push_back({local, kBesideBars + radius});
      reach.tips.push_back({local, radius, true});
    }
  }
}

Result<void> prepare_clips(SceneModel& model) {
  for (std::size_t i = 0; i < model.instruments().size(); ++i)
    if (const ClipsDescription* clips = clips_of(model.scene().instruments[i]))
      model.constants().all<ClipApplier>().add(model.instruments()[i], {*clips});
  return {};
}

/// Each time that an applier closes there is an organ.
Result<void> expect_tissue(const SceneModel& model) {
  struct Closing {
    std::size_t instrument = 0;
    double time = 0.0;
    double nearest = std::numeric_limits<double>::infinity();  ///< tissue to the middle [m]
  };
  std::vector<Closing> closings;
  const auto tool_of = [&](std::size_t i) -> const InstrumentBody& {
    return *model.constants().all<InstrumentBody>().find(model.instruments()[i]);
  };
  for (std::size_t i = 0; i < model.instruments().size(); ++i)
    if (clips_of(model.scene().instruments[i]))
      for (const double time : closings_of(tool_of(i))) closings.push_back({i, time});
  for (std::size_t o = 0; o < model.organs().size() && !closings.empty(); ++o) {
    const OrganDescription& organ = model.scene().organs[o];
    if (!organ.deformable) continue;
    const SurfaceTree surface(
        model.constants().all<OrganBody>().find(model.organs()[o])->model->surface);
    for (Closing& one : closings) {
      const Vec3 middle = middle_at(tool_of(one.instrument), one.time);
      one.nearest =
          std::min(one.nearest, surface.signed_distance(organ.pose_at(one.time).to_local(middle)));
    }
  }
  for (const Closing& one : closings) {
    const ClipsDescription& clips = *clips_of(model.scene().instruments[one.instrument]);
    if (one.nearest <= kAboutClip + 0.5 * clips.opening) continue;
    return failure(fmt::format(
        "{}: instruments/{}/path: found a clip applied at {:.2f} s {:.0f} mm away from every organ "
        "that deforms, expected tissue between its bars",
        model.scene().file.string(), one.instrument, one.time, 1e3 * one.nearest));
  }
  return {};
}

/// Ducts lie in their organ.
Result<void> expect_inside(const SceneModel& model, std::size_t o) {
  const std::span<const DuctDescription> ducts = ducts_of(model.scene().organs[o]);
  if (ducts.empty()) return {};
  const SurfaceTree surface(
      model.constants().all<OrganBody>().find(model.organs()[o])->model->surface);
  for (std::size_t d = 0; d < ducts.size(); ++d)
    for (std::size_t p = 0; p < ducts[d].path.size(); ++p) {
      const double outside = surface.signed_distance(ducts[d].path[p]);
      if (outside <= kInOrgan) continue;
      return failure(fmt::format(
          "{}: organs/{}/ducts/{}/through/{}/point_mm: found a point {:.1f} mm outside of the "
          "organ, expected one in it",
          model.scene().file.string(), o, d, p, 1e3 * outside));
    }
  return {};
}

Result<void> finish_clips(SceneModel& model, const std::filesystem::path&,
                          std::vector<std::string>&) {
  if (auto found = expect_tissue(model); !found) return found;
  for (std::size_t o = 0; o < model.organs().size(); ++o)
    if (auto inside = expect_inside(model, o); !inside) return inside;
  return {};
}

Result<void> start_clips(World& world) {
  const Pool<ClipApplier>& appliers = world.all<ClipApplier>();
  for (std::size_t i = 0; i < appliers.size(); ++i)
    world.all<AppliedClips>().add(appliers.owner(i), {});
  return {};
}

bool some_clips(const World& world) {
  return world.has<ClipApplier>();
}

bool some_to_feel(const World& world) {
  return some_clips(world) ||
         std::ranges::any_of(world.model().scene().organs, [](const OrganDescription& organ) {
           return !ducts_of(organ).empty();
         });
}

std::vector<ReportSection> clips_report(const World& world) {
  if (!some_to_feel(world)) return {};
  nlohmann::ordered_json clips = nlohmann::ordered_json::array(),
                         ducts = nlohmann::ordered_json::array();
  const Pool<AppliedClips>& all = world.all<AppliedClips>();
  for (std::size_t i = 0; i < all.size(); ++i)
    for (const Clip& clip : all[i].clips)
      clips.push_back({{"instrument", world.find<InstrumentBody>(all.owner(i))->description.name},
                       {"organ", world.find<OrganBody>(clip.organ)->name},
                       {"applied_s", clip.applied},
                       {"gap_mm", 1e3 * clip.apart},
                       {"shut", clip.closed()},
                       {"holds_kPa", 1e-3 * world.find<ClipApplier>(all.owner(i))->clips.holds},
                       {"squeeze_N", clip.squeeze},
                       {"pressure_kPa", 1e-3 * clip.pressure()},
                       {"fell", clip.fell}});
  for (const DuctFigures& duct : duct_figures(world))
    ducts.push_back({{"organ", world.find<OrganBody>(duct.organ)->name},
                     {"duct", duct.name},
                     {"pressure_kPa", 1e-3 * duct.pressure},
                     {"cut", duct.cut},
                     {"open", duct.open}});
  return {report_section("clips", {{"applied", std::move(clips)}, {"ducts", std::move(ducts)}})};
}

}  // namespace

Feature clips_feature() {
  return {.name = "clips",
          .keys = clips_keys(),
          .check = check_clips,
          .reach = reach_clips,
          .prepare = prepare_clips,
          .finish = finish_clips,
          .start = start_clips,
          .states = {state_type<AppliedClips>({Strays::Become::kAsBefore})},
          .stages = {{.name = "hold clips",
                      .reads = {"tool poses", "contact cells", "organ poses"},
                      .reads_before = {"surfaces"},
                      .writes = {"contact cells"},
                      .changes = {"clips"},
                      .needed = some_clips,
                      .run = hold_clips},
                     {.name = "feel clips",
                      .reads = {"forces", "cuts"},
                      .reads_before = {"cuts by heat"},
                      .writes = {"clip forces"},
                      .changes = {"clips"},
                      .needed = some_to_feel,
                      .run = feel_clips}},
          .flags = {kClipOnNothing, kNoClipLeft, kClipFell, kDuctOpen},
          .replaced = hold_what_is_left,
          .restored = drop_unsound,
          .report = clips_report};
}

}  // namespace viscera
