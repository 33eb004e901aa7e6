#include "tools/profile/profile_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <ostream>

#include "engine/io/atomic_file.h"
#include "engine/io/svg_plot.h"

namespace viscera {
namespace {

std::vector<Vec2> step_medians(const std::vector<ProfileCase>& cases) {
  std::vector<Vec2> points;
  for (const ProfileCase& one : cases)
    points.emplace_back(static_cast<double>(one.occupancy.organs), 1e6 * one.stage("step").median);
  return points;
}

nlohmann::json case_json(const ProfileCase& one, const std::string& stage, const Quantiles& q) {
  return {{"organs", one.occupancy.organs},
          {"touched", one.occupancy.touched},
          {"stage", stage},
          {"median_us", 1e6 * q.median},
          {"p99_us", 1e6 * q.p99},
          {"max_us", 1e6 * q.max},
          {"count", q.count}};
}

nlohmann::json fit_json(const std::optional<LineFit>& fit) {
  if (!fit) return nullptr;
  return {{"slope_us", fit->slope}, {"intercept_us", fit->intercept}};
}

void print_cases(const std::vector<ProfileCase>& cases, std::ostream& out) {
  out << fmt::format("{:>7}{:>9}  {:<18}{:>12}{:>12}{:>12}\n", "organs", "touched", "stage",
                     "median us", "p99 us", "max us");
  for (const ProfileCase& one : cases) {
    for (const auto& [name, values] : one.stages) {
      const Quantiles q = quantiles(values);
      out << fmt::format("{:>7}{:>9}  {:<18}{:>12.2f}{:>12.2f}{:>12.2f}\n", one.occupancy.organs,
                         one.occupancy.touched, name, 1e6 * q.median, 1e6 * q.p99, 1e6 * q.max);
    }
  }
}

/// A straight line, drawn with many points as it bends on logarithmic axes.
PlotSeries line_of(const std::string& name, const LineFit& fit, double from, double to,
                   int colour) {
  PlotSeries series{name, {}, true, false, true, false, colour};
  constexpr int kPoints = 64;
  for (int i = 0; i <= kPoints; ++i) {
    const double x = from * std::pow(to / from, static_cast<double>(i) / kPoints);
    series.points.emplace_back(x, fit.at(x));
  }
  return series;
}

Plot cost_plot(const ProfileReport& report) {
  Plot plot;
  plot.title = "A frame against the number of organs";
  const auto& cases = report.touched.empty() ? report.idle : report.touched;
  const std::size_t touched = cases.front().occupancy.touched;
  plot.subtitle = fmt::format("{}, {} touched; medians over {} rounds; dashed: fitted lines",
                              report.scene, touched, report.rounds);
  plot.x = {"organs", true};
  plot.y = {"time a frame (µs)", true};
  std::map<std::string, PlotSeries> by_stage;
  std::vector<std::string> names;
  for (const ProfileCase& one : cases) {
    for (const auto& [name, values] : one.stages) {
      if (name.starts_with("draw:")) continue;
      auto [entry, fresh] = by_stage.try_emplace(name);
      if (fresh) {
        names.push_back(name);
        entry->second.name = name;
      }
      entry->second.points.emplace_back(static_cast<double>(one.occupancy.organs),
                                        1e6 * quantiles(values).median);
    }
  }
  // The whole step lies under what takes most of it.
  constexpr int kStep = 6, kIdle = 7;
  PlotSeries whole = by_stage["step"];
  whole.colour = kStep;
  whole.hollow = true;
  plot.series.push_back(whole);
  std::erase(names, "step");
  for (std::size_t i = 0; i < names.size(); ++i) {
    by_stage[names[i]].colour = static_cast<int>(i % kStep);
    by_stage[names[i]].hollow = i >= kStep;
    plot.series.push_back(by_stage[names[i]]);
  }
  const double from = static_cast<double>(cases.front().occupancy.organs);
  const double to = static_cast<double>(cases.back().occupancy.organs);
  if (!report.touched.empty()) {
    if (const auto fit = report.touched_fit())
      plot.series.push_back(line_of(fmt::format("{:.3g} + {:.2g} n", fit->intercept, fit->slope),
                                    *fit, from, to, kStep));
    plot.series.push_back(
        {"step, none touched", step_medians(report.idle), true, true, false, true, kIdle});
  }
  if (const auto fit = report.idle_fit())
    plot.series.push_back(line_of(fmt::format("{:.3g} + {:.2g} n", fit->intercept, fit->slope),
                                  *fit, from, to, kIdle));
  return plot;
}

Plot memory_plot(const ProfileReport& report) {
  Plot plot;
  plot.title = "Memory against the number of organs";
  plot.subtitle = report.scene + "; models are shared";
  plot.x = {"organs", false};
  plot.y = {"resident (MB)", false};
  PlotSeries series{"measured", {}, true, true, false, false, 0};
  for (const ProfileReport::Memory& at : report.memory)
    series.points.emplace_back(static_cast<double>(at.organs),
                               1e-6 * static_cast<double>(at.bytes));
  if (const auto fit = fit_line(series.points))
    plot.series.push_back(line_of(fmt::format("{:.1f} + {:.2g} n", fit->intercept, fit->slope),
                                  *fit, series.points.front().x(), series.points.back().x(), 0));
  plot.series.push_back(series);
  return plot;
}

}  // namespace

std::optional<LineFit> fit_line(const std::vector<Vec2>& points) {
  if (points.empty()) return std::nullopt;
  Vec2 mean = Vec2::Zero();
  for (const Vec2& p : points) mean += p / static_cast<double>(points.size());
  double xx = 0.0, xy = 0.0;
  for (const Vec2& p : points) {
    xx += (p.x() - mean.x()) * (p.x() - mean.x());
    xy += (p.x() - mean.x()) * (p.y() - mean.y());
  }
  if (xx <= 0.0) return std::nullopt;
  return LineFit{xy / xx, mean.y() - xy / xx * mean.x()};
}

std::optional<LineFit> ProfileReport::idle_fit() const {
  return fit_line(step_medians(idle));
}

std::optional<LineFit> ProfileReport::touched_fit() const {
  return fit_line(step_medians(touched));
}

std::optional<double> ProfileReport::touched_organ_us() const {
  if (touched.empty()) return std::nullopt;
  // The same frames with the tools elsewhere cost what everything else costs.
  const ProfileCase& with = touched.front();
  const auto same = std::ranges::find_if(
      idle, [&](const ProfileCase& one) { return one.occupancy.organs == with.occupancy.organs; });
  if (same == idle.end()) return std::nullopt;
  const ProfileCase& without = *same;
  std::vector<double> more;
  for (std::size_t k = 0; k < with.best_step.size(); ++k)
    if (with.organs_touched[k] > 0)
      more.push_back((with.best_step[k] - without.best_step[k]) /
                     static_cast<double>(with.organs_touched[k]));
  if (more.empty()) return std::nullopt;
  return 1e6 * quantiles(std::move(more)).median;
}

std::optional<double> ProfileReport::cost_of_organs() const {
  if (touched.size() < 2) return std::nullopt;
  const ProfileCase &few = touched.front(), &many = touched.back();
  std::vector<double> ratios;
  for (std::size_t k = 0; k < few.best_step.size(); ++k)
    if (few.organs_touched[k] > 0) ratios.push_back(many.best_step[k] / few.best_step[k]);
  if (ratios.empty()) return std::nullopt;
  return quantiles(std::move(ratios)).median;
}

std::vector<BenchRow> ProfileReport::rows() const {
  std::vector<BenchRow> rows;
  if (itself.wall_s > 0.0)
    rows.push_back({fmt::format("the scene itself, {} organs, over real time", scene_organs), "x",
                    seconds / itself.wall_s, 1.0, true});
  if (const auto fit = idle_fit())
    rows.push_back({"an idle organ, a frame", "us", fit->slope, 0.5});
  if (const auto ratio = cost_of_organs())
    rows.push_back({fmt::format("a frame of {} organs over one of {}, {} touched",
                                touched.back().occupancy.organs, touched.front().occupancy.organs,
                                touched.back().occupancy.touched),
                    "x", *ratio, 1.1});
  else if (!not_touched.empty())
    rows.push_back(
        {"a frame of many organs over one of few", "x", std::nullopt, 1.1, false, {not_touched}});
  if (memory.size() > 1) {
    const Memory &last = memory.back(), &before = memory[memory.size() - 2];
    const double more = static_cast<double>(last.bytes) - static_cast<double>(before.bytes);
    rows.push_back({fmt::format("organs {} to {} add, each", before.organs + 1, last.organs), "MB",
                    1e-6 * more / static_cast<double>(last.organs - before.organs), 1.0});
  }
  return rows;
}

void print(const ProfileReport& report, std::ostream& out) {
  print_cases(report.idle, out);
  if (!report.touched.empty()) print_cases(report.touched, out);
  out << fmt::format("{:>7}{:>14}\n", "organs", "resident MB");
  for (const ProfileReport::Memory& at : report.memory)
    out << fmt::format("{:>7}{:>14.2f}\n", at.organs, 1e-6 * static_cast<double>(at.bytes));
  if (const auto fit = report.idle_fit())
    out << fmt::format("nothing touched: {:.2f} us + {:.4f} us an organ\n", fit->intercept,
                       fit->slope);
  if (const auto fit = report.touched_fit())
    out << fmt::format("{} touched: {:.2f} us + {:.4f} us an organ\n",
                       report.touched.front().occupancy.touched, fit->intercept, fit->slope);
  if (const auto cost = report.touched_organ_us())
    out << fmt::format("a touched organ: {:.1f} us a frame\n", *cost);
  for (const std::string& one : report.left_out) out << "left out: " << one << '\n';
  if (!report.not_touched.empty()) out << report.not_touched << '\n';
  if (!report.renderer.empty()) out << "pictures by " << report.renderer << '\n';
  out << '\n';
  print_rows(report.rows(),
             fmt::format("{} ({} cores of {})", report.scene, report.cores, report.machine), out);
}

std::string to_json_text(const ProfileReport& report) {
  nlohmann::json json = {{"scene", report.scene},
                         {"machine", report.machine},
                         {"cores", report.cores},
                         {"renderer", report.renderer},
                         {"seconds", report.seconds},
                         {"rounds", report.rounds},
                         {"cases", nlohmann::json::array()},
                         {"memory", nlohmann::json::array()},
                         {"idle_organ_us", nullptr},
                         {"touched_organ_us", nullptr},
                         {"idle_fit", fit_json(report.idle_fit())},
                         {"touched_fit", fit_json(report.touched_fit())},
                         {"left_out", report.left_out},
                         {"not_touched", nullptr},
                         {"rows", to_json(report.rows())}};
  for (const auto* cases : {&report.idle, &report.touched})
    for (const ProfileCase& one : *cases)
      for (const auto& [stage, values] : one.stages)
        json["cases"].push_back(case_json(one, stage, quantiles(values)));
  for (const ProfileReport::Memory& at : report.memory)
    json["memory"].push_back({{"organs", at.organs}, {"bytes", at.bytes}});
  if (const auto fit = report.idle_fit()) json["idle_organ_us"] = fit->slope;
  if (!report.not_touched.empty()) json["not_touched"] = report.not_touched;
  if (const auto cost = report.touched_organ_us()) json["touched_organ_us"] = *cost;
  return json.dump(2) + "\n";
}

Result<void> draw_plots(const ProfileReport& report, const std::filesystem::path& folder) {
  if (auto made = check_out_folder(folder); !made) return made;
  if (auto written = write_file(folder / "cost_against_organs.svg", to_svg(cost_plot(report)));
      !written)
    return written;
  return write_file(folder / "memory_against_organs.svg", to_svg(memory_plot(report)));
}

}  // namespace viscera
