#include "tools/bench/bench_smoke_plots.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "engine/io/atomic_file.h"
#include "engine/io/svg_plot.h"

namespace viscera {
namespace {

/// Pass by pass in the order of the rows, with the value that `value` makes of a row.
template <class Value>
std::vector<PlotSeries> series_of(const std::vector<SmokeRow>& rows, const Value& value) {
  std::vector<PlotSeries> series;
  for (const SmokeRow& row : rows) {
    const std::optional<double> up = value(row);
    if (!up) continue;
    auto one = std::find_if(series.begin(), series.end(),
                            [&](const PlotSeries& known) { return known.name == row.pass; });
    if (one == series.end()) {
      PlotSeries fresh;
      fresh.name = row.pass;
      fresh.dashed = row.pass != "step";
      one = series.insert(series.end(), fresh);
    }
    one->points.emplace_back(static_cast<double>(row.particles), *up);
  }
  for (PlotSeries& one : series)
    std::sort(one.points.begin(), one.points.end(),
              [](const Vec2& a, const Vec2& b) { return a.x() < b.x(); });
  return series;
}

std::string where(const std::vector<SmokeRow>& rows) {
  return rows.empty() ? "" : fmt::format("{}: {}", rows.front().backend, rows.front().device);
}

Plot time_plot(const std::vector<SmokeRow>& rows) {
  Plot plot;
  plot.title = "Time of a step of smoke";
  plot.subtitle = where(rows) + "; medians";
  plot.x = {"particles", true};
  plot.y = {"time (ms)", true};
  plot.series = series_of(rows, [](const SmokeRow& row) { return std::optional(row.median_ms); });
  return plot;
}

Plot share_plot(const std::vector<SmokeRow>& rows) {
  std::map<std::size_t, double> whole;
  for (const SmokeRow& row : rows)
    if (row.pass == "step") whole[row.particles] = row.median_ms;
  Plot plot;
  plot.title = "Shares of the passes in a step of smoke";
  plot.subtitle = where(rows) + "; medians";
  plot.x = {"particles", true};
  plot.y = {"share of the step (%)", false};
  plot.series = series_of(rows, [&](const SmokeRow& row) -> std::optional<double> {
    if (row.pass == "step" || !(whole[row.particles] > 0.0)) return std::nullopt;
    return 100.0 * row.median_ms / whole[row.particles];
  });
  for (PlotSeries& one : plot.series) one.dashed = false;
  return plot;
}

Plot decay_plot(const std::vector<SmokeDecay>& decays) {
  Plot plot;
  plot.title = "Decay of a shear wave";
  plot.subtitle = "error of its rate on a jittered cloud";
  plot.x = {"spacing over wavelength", true};
  plot.y = {"error (%)", true};
  for (const char* laplacian : {"pairwise", "paper"}) {
    PlotSeries one;
    one.name = laplacian;
    for (const SmokeDecay& decay : decays)
      if (decay.laplacian == laplacian)
        one.points.emplace_back(decay.spacing_over_wavelength, 100.0 * std::abs(decay.error));
    plot.series.push_back(one);
  }
  PlotSeries target;
  target.name = "to reach at 1/16";
  target.points = {Vec2(1.0 / 16.0, 3.0)};
  target.line = false;
  target.hollow = true;
  plot.series.push_back(target);
  return plot;
}

}  // namespace

Result<void> draw_smoke_plots(const std::vector<SmokeRow>& rows,
                              const std::vector<SmokeDecay>& decays,
                              const std::filesystem::path& folder) {
  if (auto made = check_out_folder(folder); !made) return made;
  if (auto written = write_file(folder / "smoke_time.svg", to_svg(time_plot(rows))); !written)
    return written;
  if (auto written = write_file(folder / "smoke_shares.svg", to_svg(share_plot(rows))); !written)
    return written;
  return write_file(folder / "smoke_decay.svg", to_svg(decay_plot(decays)));
}

}  // namespace viscera
