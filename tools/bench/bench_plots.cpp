#include "tools/bench/bench_plots.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "engine/io/atomic_file.h"
#include "engine/io/svg_plot.h"

namespace viscera {
namespace fs = std::filesystem;
namespace {

/// The case that plots show: tissue-like, the paper's patch.
constexpr double kPoisson = 0.45, kRadius = 0.2;

bool is_shown(const HemisphereCase& one) {
  return one.in_plots && one.contact == "stick" && std::abs(one.poisson - kPoisson) < 1e-9 &&
         std::abs(one.a_over_R - kRadius) < 1e-9;
}

/// A colour a name, the same in every picture.
int colour_of(const std::string& name) {
  static const std::vector<std::string> kOrder = {"galerkin",  "galerkin_quadratic", "paper",
                                                  "gfdm",      "calculix_t4",        "calculix_t10",
                                                  "reference", "bullet_linear",      "bullet"};
  const auto found = std::find(kOrder.begin(), kOrder.end(), name);
  return found == kOrder.end() ? 7 : static_cast<int>(found - kOrder.begin());
}

/// A line a formulation through the points (x, y) of its shown cases, by ascending x.
template <class X, class Y>
std::vector<PlotSeries> series_of(const std::vector<HemisphereCase>& cases, const X& x,
                                  const Y& y) {
  std::vector<std::string> names;
  std::map<std::string, PlotSeries> by_name;
  for (const HemisphereCase& one : cases) {
    const std::optional<double> across = x(one), up = y(one);
    if (!is_shown(one) || !across || !up || !(*across > 0.0) || !(*up > 0.0)) continue;
    const std::string name =
        one.variant.empty() ? one.formulation : one.formulation + ", " + one.variant;
    auto [entry, fresh] = by_name.try_emplace(name);
    if (fresh) {
      names.push_back(name);
      entry->second.name = name;
      entry->second.colour = colour_of(one.formulation);
      entry->second.dashed = entry->second.hollow =
          !one.variant.starts_with("uniform") && !one.variant.empty();
    }
    entry->second.points.emplace_back(*across, *up);
  }
  std::vector<PlotSeries> series;
  for (const std::string& name : names) {
    PlotSeries& one = by_name[name];
    std::sort(one.points.begin(), one.points.end(),
              [](const Vec2& a, const Vec2& b) { return a.x() < b.x(); });
    series.push_back(std::move(one));
  }
  return series;
}

Result<void> write(const fs::path& file, const Plot& plot) {
  const bool empty = std::all_of(plot.series.begin(), plot.series.end(),
                                 [](const PlotSeries& one) { return one.points.empty(); });
  if (empty) return {};
  return write_file(file, to_svg(plot));
}

std::optional<double> profile_percent(const HemisphereCase& one) {
  if (!one.profile_error) return std::nullopt;
  return 100.0 * *one.profile_error;
}

const std::string kWhat = "stuck patch of 0.2 R pressed 0.08 R into the hemisphere, Poisson 0.45";

Plot error_plot(const std::vector<HemisphereCase>& cases, bool online) {
  Plot plot;
  plot.title = online ? "Error against time per contact" : "Error against time to the first answer";
  plot.subtitle = kWhat;
  plot.x = {online ? "contact and displacement of the whole surface, one core (µs)"
                   : "from the surface to the first answer, no cache (s)",
            true};
  plot.y = {"error of the deformed dome (%)", true};
  plot.series = series_of(
      cases,
      [&](const HemisphereCase& one) {
        return online ? one.online_us : std::optional<double>(first_answer_s(one));
      },
      profile_percent);
  return plot;
}

Plot cost_plot(const std::vector<HemisphereCase>& cases) {
  Plot plot;
  plot.title = "Cost against degrees of freedom";
  plot.subtitle = kWhat + "; the paper's figure 5c";
  plot.x = {"degrees of freedom of the body", true};
  plot.y = {"time per contact, one core (µs)", true};
  plot.series = series_of(
      cases,
      [](const HemisphereCase& one) { return std::optional(3.0 * static_cast<double>(one.nodes)); },
      [](const HemisphereCase& one) { return one.online_us; });
  if (!plot.series.empty())
    plot.series.push_back(
        {"the paper, 2006 machine", {Vec2(3078.0, 900.0)}, false, true, false, false, 6});
  return plot;
}

Plot profile_plot(const std::vector<HemisphereCase>& cases,
                  const std::vector<HemisphereReference>& references) {
  Plot plot;
  plot.title = "Deformed profile over the reference";
  plot.subtitle = kWhat + "; the paper's figure 5b";
  plot.x = {"distance from the axis over R", false};
  plot.y = {"height over R", false};
  plot.equal_scales = true;
  const HemisphereReference* reference = find_reference(references, kPoisson, kRadius);
  std::map<std::string, const HemisphereCase*> best;  // nearest to 1,100 nodes
  for (const HemisphereCase& one : cases) {
    if (!is_shown(one) || one.profile.empty()) continue;
    const HemisphereCase*& held = best[one.formulation];
    const auto off = [](const HemisphereCase& c) {
      return std::abs(static_cast<double>(c.nodes) - 1100.0);
    };
    if (!held || off(one) < off(*held)) held = &one;
  }
  if (best.empty()) return plot;
  PlotSeries rest{"at rest", {}, true, false, true, false, 6};
  for (int i = 0; i <= 90; ++i) {
    const double angle = i * std::acos(0.0) / 90.0;
    rest.points.emplace_back(std::sin(angle), std::cos(angle));
  }
  plot.series.push_back(rest);
  if (reference) {
    PlotSeries exact{"reference", {}, true, false, false, false, 6};
    for (const auto& row : reference->profile(HemisphereContact::kStick).rows())
      exact.points.emplace_back(std::sin(row.polar_angle) + row.radial,
                                std::cos(row.polar_angle) + row.axial);
    plot.series.push_back(exact);
  }
  for (const auto& [name, one] : best) {
    PlotSeries series{
        fmt::format("{} ({})", name, one->nodes), {}, false, true, false, false, colour_of(name)};
    for (std::size_t v = 0; v < one->profile.size(); ++v) {
      const Vec3& x = one->profile[v];
      if (std::abs(x.y()) > 1e-6 || x.x() < -1e-6) continue;
      const Vec3 moved = x + one->displacement[v];
      series.points.emplace_back(moved.x(), moved.z());
    }
    plot.series.push_back(series);
  }
  return plot;
}

PlotTable paper_table(const std::vector<HemisphereCase>& cases) {
  PlotTable table;
  table.title = "Table 1 of the paper, and today";
  table.headings = {"method",      "nodes", "unknowns", "preparation",
                    "per contact", "force", "profile"};
  table.rows = {{"FEM, 2006 machine", "1715", "5145", "-", "4.02 s", "-", "-"},
                {"GPAFF, 2006 machine", "1026", "3078", "-", "0.9 ms", "-", "-"},
                {"LPAFF, 2006 machine", "28", "84", "-", "13.7 ms", "-", "-"}};
  const auto time = [](double seconds) {
    if (seconds < 1e-3) return fmt::format("{:.0f} µs", 1e6 * seconds);
    return seconds < 1.0 ? fmt::format("{:.3g} ms", 1e3 * seconds)
                         : fmt::format("{:.2f} s", seconds);
  };
  const auto percent = [](const std::optional<double>& error, bool sign) {
    if (!error) return std::string("-");
    return sign ? fmt::format("{:+.1f} %", 100.0 * *error)
                : fmt::format("{:.1f} %", 100.0 * *error);
  };
  for (const HemisphereCase& one : cases) {
    if (!is_shown(one)) continue;
    const bool has_online = one.online_us.has_value();
    table.rows.push_back(
        {one.variant.empty() ? one.formulation : one.formulation + ", " + one.variant,
         std::to_string(one.nodes), std::to_string(3 * one.nodes),
         has_online ? time(one.prepare_s) : "-",
         has_online ? time(1e-6 * *one.online_us) : time(one.prepare_s),
         percent(one.force_error, true), percent(one.profile_error, false)});
  }
  table.notes = {
      "2006 machine: as printed, solution alone, on a 2.2 GHz Pentium 4. Today: " + kWhat + ".",
      "Errors against a converged axisymmetric solution; finite elements solve afresh for "
      "every contact."};
  return table;
}

}  // namespace

Result<void> draw_hemisphere_plots(const std::vector<HemisphereCase>& cases,
                                   const std::vector<HemisphereReference>& references,
                                   const fs::path& folder) {
  if (auto made = check_out_folder(folder); !made) return made;
  const std::pair<const char*, Plot> plots[] = {
      {"error_against_preparation.svg", error_plot(cases, false)},
      {"error_against_online.svg", error_plot(cases, true)},
      {"cost_against_unknowns.svg", cost_plot(cases)},
      {"deformed_profile.svg", profile_plot(cases, references)}};
  for (const auto& [name, plot] : plots)
    if (auto written = write(folder / name, plot); !written) return written;
  if (std::none_of(cases.begin(), cases.end(), is_shown)) return {};
  return write_file(folder / "table_1.svg", to_svg(paper_table(cases)));
}

Result<void> draw_convergence_plots(const std::vector<ConvergenceCase>& cases,
                                    const fs::path& folder) {
  if (auto made = check_out_folder(folder); !made) return made;
  for (const double poisson : {0.30, 0.45, 0.49}) {
    Plot plot;
    plot.title = fmt::format("Smooth solution on a cube, Poisson {:.2f}", poisson);
    plot.subtitle = "relative L2 error of the displacement, nodes moved by 0.2 cells";
    plot.x = {"nodes", true};
    plot.y = {"error (%)", true};
    std::vector<std::string> names;
    for (const ConvergenceCase& one : cases)
      if (std::find(names.begin(), names.end(), one.formulation) == names.end())
        names.push_back(one.formulation);
    for (const std::string& name : names) {
      PlotSeries series{name, {}, true, true, false, false, colour_of(name)};
      for (const ConvergenceCase& one : cases)
        if (one.formulation == name && std::abs(one.poisson - poisson) < 1e-9)
          series.points.emplace_back(static_cast<double>(one.nodes), 100.0 * one.error);
      plot.series.push_back(std::move(series));
    }
    if (auto written = write(folder / fmt::format("convergence_nu{:.2f}.svg", poisson), plot);
        !written)
      return written;
  }
  return {};
}

}  // namespace viscera
