#include "tools/bench_heat_plots.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/io/atomic_file.h"
#include "tools/plots/svg_plot.h"

namespace viscera {
namespace {

Plot error_plot(const std::vector<HeatError>& errors) {
  Plot plot;
  plot.title = "Temperature at a lesion's edge";
  plot.subtitle = "against the exact one of a Gaussian source, over its rise";
  plot.x = {"voxel (mm)", true};
  plot.y = {"error (%)", true};
  for (const HeatError& one : errors) {
    const std::string name = fmt::format("step {:.3g} ms", 1e3 * one.dt);
    auto found = std::find_if(plot.series.begin(), plot.series.end(),
                              [&](const PlotSeries& series) { return series.name == name; });
    if (found == plot.series.end()) {
      found = plot.series.insert(plot.series.end(), PlotSeries{});
      found->name = name;
    }
    found->points.emplace_back(1e3 * one.voxel, 100.0 * one.error);
  }
  PlotSeries target;
  target.name = "to reach at 0.5 mm";
  target.points = {Vec2(0.5, 2.0)};
  target.line = false;
  target.hollow = true;
  plot.series.push_back(target);
  return plot;
}

Plot time_plot(const std::vector<HeatTime>& times) {
  Plot plot;
  plot.title = "Time of a step of heat";
  plot.subtitle = "a sixtieth of a second, 0.5 mm; medians";
  plot.x = {"active voxels", true};
  plot.y = {"time (ms)", true};
  PlotSeries measured;
  measured.name = "CPU";
  for (const HeatTime& one : times)
    measured.points.emplace_back(static_cast<double>(one.voxels), 1e3 * one.step_s);
  PlotSeries target;
  target.name = "to reach";
  target.points = {Vec2(1e5, 4.0)};
  target.line = false;
  target.hollow = true;
  plot.series = {measured, target};
  return plot;
}

Plot lesion_plot(const BurnResult& burn, const LesionRange& range) {
  Plot plot;
  plot.title = "Lesion of the standard burn";
  plot.subtitle = "liver, 30 W, ball of 2 mm; dashed: the published range, recalled";
  plot.x = {"time (s)", false};
  plot.y = {"size (mm)", false};
  PlotSeries depth, width;
  depth.name = "depth";
  width.name = "width";
  depth.markers = width.markers = false;
  for (const BurnRow& row : burn.rows) {
    depth.points.emplace_back(row.time, 1e3 * row.lesion.depth);
    width.points.emplace_back(row.time, 1e3 * row.lesion.width);
  }
  const double end = burn.rows.back().time;
  const auto bracket = [&](const char* name, double least, double most, int colour) {
    PlotSeries series;
    series.name = name;
    series.points = {Vec2(end, 1e3 * least), Vec2(end, 1e3 * most)};
    series.dashed = true;
    series.hollow = true;
    series.colour = colour;
    return series;
  };
  depth.colour = 0;
  width.colour = 1;
  plot.series = {depth, width,
                 bracket("published depth", range.least_depth, range.most_depth, 0),
                 bracket("published width", range.least_width, range.most_width, 1)};
  return plot;
}

}  // namespace

Result<void> draw_heat_plots(const std::vector<HeatError>& errors,
                             const std::vector<HeatTime>& times, const BurnResult& burn,
                             const LesionRange& range, const std::filesystem::path& folder) {
  if (auto made = check_out_folder(folder); !made) return made;
  if (auto written = write_file(folder / "heat_error.svg", to_svg(error_plot(errors))); !written)
    return written;
  if (auto written = write_file(folder / "heat_time.svg", to_svg(time_plot(times))); !written)
    return written;
  return write_file(folder / "heat_lesion.svg", to_svg(lesion_plot(burn, range)));
}

}  // namespace viscera
