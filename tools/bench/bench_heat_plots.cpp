#include "tools/bench/bench_heat_plots.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/io/atomic_file.h"
#include "engine/io/svg_plot.h"
#include "engine/run/observers/lesion_curve.h"

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
  PlotSeries cpu, gpu;
  for (const HeatTime& one : times) {
    if (one.backend == Backend::kGpu && gpu.points.empty()) plot.subtitle += "; GPU: " + one.device;
    PlotSeries& series = one.backend == Backend::kGpu ? gpu : cpu;
    series.points.emplace_back(static_cast<double>(one.voxels), 1e3 * one.step_s);
    series.name = one.backend == Backend::kGpu ? "GPU" : "CPU";
  }
  PlotSeries target;
  target.name = "to reach";
  target.points = {Vec2(1e5, 4.0)};
  target.line = false;
  target.hollow = true;
  plot.series = {cpu};
  if (!gpu.points.empty()) plot.series.push_back(gpu);
  plot.series.push_back(target);
  return plot;
}

}  // namespace

Result<void> draw_heat_plots(const std::vector<HeatError>& errors,
                             const std::vector<HeatTime>& times, const BurnResult& burn,
                             const PublishedLesion& published,
                             const std::filesystem::path& folder) {
  if (auto made = check_out_folder(folder); !made) return made;
  if (auto written = write_file(folder / "heat_error.svg", to_svg(error_plot(errors))); !written)
    return written;
  if (auto written = write_file(folder / "heat_time.svg", to_svg(time_plot(times))); !written)
    return written;
  std::vector<LesionRow> rows;
  for (const BurnRow& row : burn.rows) rows.push_back({row.time, row.lesion, row.dead});
  const Plot lesion =
      lesion_plot("Lesion of the standard burn", "liver, 30 W, ball of 2 mm", rows, published);
  return write_file(folder / "heat_lesion.svg", to_svg(lesion));
}

}  // namespace viscera
