#include "engine/run/observers/lesion_curve.h"

#include <fmt/format.h>

#include "engine/features/cautery/cautery.h"
#include "engine/io/atomic_file.h"
#include "engine/simulation/frame.h"

namespace viscera {
namespace {

PlotSeries curve(const char* name, int colour) {
  PlotSeries series;
  series.name = name;
  series.markers = false;
  series.colour = colour;
  return series;
}

/// An end of what is published, over the whole time.
void add_limit(Plot& plot, const char* name, int colour, double time, std::optional<double> size) {
  if (!size) return;
  PlotSeries series = curve(name, colour);
  series.points = {Vec2(0.0, 1e3 * *size), Vec2(time, 1e3 * *size)};
  series.dashed = true;
  plot.series.push_back(series);
}

}  // namespace

Plot lesion_plot(std::string title, std::string subtitle, std::span<const LesionRow> rows,
                 const std::optional<PublishedLesion>& published) {
  Plot plot;
  plot.title = std::move(title);
  plot.subtitle = std::move(subtitle);
  plot.x = {"time (s)", false};
  plot.y = {"size (mm)", false};
  PlotSeries depth = curve("depth", 0), width = curve("width", 1);
  PlotSeries dead_depth = curve("depth, dead", 2), dead_width = curve("width, dead", 3);
  for (const LesionRow& row : rows) {
    depth.points.emplace_back(row.time, 1e3 * row.lesion.depth);
    width.points.emplace_back(row.time, 1e3 * row.lesion.width);
    dead_depth.points.emplace_back(row.time, 1e3 * row.dead.depth);
    dead_width.points.emplace_back(row.time, 1e3 * row.dead.width);
  }
  plot.series = {depth, width, dead_depth, dead_width};
  if (!published || rows.empty()) return plot;
  const double end = rows.back().time;
  plot.subtitle = "dashed: published, " + published->source;
  add_limit(plot, "least depth", 0, end, published->least_depth);
  add_limit(plot, "greatest depth", 0, end, published->most_depth);
  add_limit(plot, "least width", 1, end, published->least_width);
  add_limit(plot, "greatest width", 1, end, published->most_width);
  return plot;
}

LesionCurve::LesionCurve(const World& world, const SceneDescription& scene)
    : Observer("lesion"), scene_(scene), organs_(world.all<OrganBody>().size()) {
  for (std::size_t i = 0; i < world.all<BurnTrace>().size(); ++i) {
    const Entity hook = world.all<BurnTrace>().owner(i);
    if (world.find<InstrumentBody>(hook)->description.name == heat_of(scene).lesion_of)
      hook_ = hook;
  }
}

Result<void> LesionCurve::open(const std::filesystem::path& folder) {
  folder_ = folder;
  return {};
}

void LesionCurve::add_frame(const World& world) {
  if (!hook_) return;
  const BurnTrace& trace = *world.find<BurnTrace>(*hook_);
  if (state_.rows.empty()) {
    if (trace.current.power <= 0.0) return;
    const OrganBody* organ = world.find<OrganBody>(trace.organ);
    state_.organ = static_cast<std::uint32_t>(organ - &world.all<OrganBody>()[0]);
    state_.point = trace.contact.point;
    state_.outward = trace.contact.outward;
    state_.begun = world.time() - world.model().time_step();
  }
  const Bioheat& heat = world.find<OrganBurn>(world.all<OrganBody>().owner(state_.organ))->heat;
  state_.rows.push_back({.time = world.time() - state_.begun,
                         .lesion = lesion_at(heat, state_.point, state_.outward),
                         .dead = lesion_at(heat, state_.point, state_.outward, LesionOf::kDead),
                         .power = trace.current.power,
                         .temperature = heat.options().body + heat.excess_now(),
                         .vaporised = heat.vaporised_water() + heat.vaporised_tissue()});
}

Result<void> LesionCurve::close(const World&) {
  if (rows().empty()) return {};
  std::string table =
      "time_s,depth_m,width_m,power_W,hottest_K,vaporised_kg,dead_depth_m,dead_width_m\n";
  for (const LesionRow& row : rows())
    table += fmt::format("{},{},{},{},{},{},{},{}\n", row.time, row.lesion.depth, row.lesion.width,
                         row.power, row.temperature, row.vaporised, row.dead.depth, row.dead.width);
  if (auto written = write_file(folder_ / "lesion.csv", table); !written) return written;
  const HeatDescription& heat = heat_of(scene_);
  const Plot plot = lesion_plot("Lesion: " + (scene_.title.empty() ? scene_.name : scene_.title),
                                "under the " + heat.lesion_of, rows(), heat.published);
  return write_file(folder_ / "lesion.svg", to_svg(plot));
}

Result<void> LesionCurve::save_state(ByteWriter& writer) {
  return save_whole(writer, state_);
}

Result<void> LesionCurve::load_state(ByteReader& reader) {
  if (auto whole = load_whole(reader, state_); !whole) return whole;
  if (!rows().empty() && (!hook_ || state_.organ >= organs_))
    return failure("expected a lesion of this scene");
  return {};
}

}  // namespace viscera
