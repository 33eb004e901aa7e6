#include "tools/viscera/haptics_report.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <ostream>

#include "engine/io/atomic_file.h"
#include "engine/io/svg_plot.h"

namespace viscera {
namespace {

using Json = nlohmann::ordered_json;

/// To reach, on two cores.
constexpr double kLatenessP50 = 20.0, kLatenessP99 = 200.0, kComputeP999 = 500.0;  // [us]

Json to_json(const Percentiles& p) {
  return {{"p50", p.p50}, {"p99", p.p99}, {"p999", p.p999}, {"max", p.max}};
}

Json to_json(const HapticToolReport& tool) {
  Json parts = Json::object();
  for (std::size_t i = 0; i < kTickParts; ++i) parts[kTickPartNames[i]] = to_json(tool.parts[i]);
  return {{"name", tool.name},
          {"device", tool.device},
          {"ticks", tool.ticks},
          {"missed", tool.missed},
          {"lateness_us", to_json(tool.lateness)},
          {"compute_us", to_json(tool.compute)},
          {"parts_us", std::move(parts)},
          {"energy_J", tool.energy},
          {"passivity_violations", tool.passivity_violations},
          {"scheduler", tool.scheduler},
          {"greatest_force_N", tool.greatest_force},
          {"hives",
           {{"built", tool.tissue.hives},
            {"refused", tool.tissue.refused},
            {"searches", tool.tissue.searches},
            {"ticks_without_a_hive", tool.tissue.uncovered}}},
          {"beyond_linear",
           {{"newton_steps", tool.tissue.newton_steps},
            {"tangent_answers", tool.tissue.tangent_answers},
            {"deadline_misses", tool.tissue.deadline_misses},
            {"linear_answers", tool.tissue.linear_answers}}},
          {"events", tool.events}};
}

void print_row(std::ostream& out, std::string_view name, const Percentiles& p,
               std::string_view target) {
  out << fmt::format("  {:<22}{:>10.2f}{:>10.2f}{:>10.2f}{:>10.2f}  {}\n", name, p.p50, p.p99,
                     p.p999, p.max, target);
}

PlotSeries series_of(const LatencyHistogram& histogram, std::string name) {
  PlotSeries series;
  series.name = std::move(name);
  series.markers = false;
  const double all = static_cast<double>(std::max<std::uint64_t>(1, histogram.count()));
  // Buckets are narrow; an eighth of an octave reads better.
  constexpr int kTogether = 4;
  for (int i = 0; i < LatencyHistogram::kBuckets; i += kTogether) {
    std::uint64_t sum = 0;
    for (int k = i; k < i + kTogether; ++k) sum += histogram.in_bucket(k);
    if (sum == 0) continue;
    series.points.emplace_back(
        1e-3 * static_cast<double>(LatencyHistogram::end_ns(i + kTogether - 1)),
        100.0 * static_cast<double>(sum) / all);
  }
  return series;
}

}  // namespace

HapticToolReport report_of(HapticTool& tool) {
  const ServoStatistics& statistics = tool.loop->statistics();
  HapticToolReport report;
  report.name = tool.name;
  report.device = tool.device->name();
  report.scheduler = tool.loop->scheduler();
  report.ticks = statistics.ticks;
  report.missed = statistics.missed;
  report.lateness = percentiles_of(statistics.lateness);
  report.compute = percentiles_of(statistics.compute);
  for (std::size_t i = 0; i < kTickParts; ++i)
    report.parts[i] = percentiles_of(statistics.parts[i]);
  report.energy = statistics.energy_given;
  report.passivity_violations = statistics.passivity_violations;
  report.events = tool.events;
  report.greatest_force = statistics.greatest_force;
  report.tissue = tool.tissue->figures();
  if (report.tissue.last_refusal != HiveVerdict::kSound)
    report.events.push_back(
        fmt::format("a hive was refused: {}", name_of(report.tissue.last_refusal)));
  return report;
}

void print(const HapticsReport& report, std::ostream& out) {
  out << fmt::format("{}: {:.1f} s on {} ({} cores)\n", report.scene, report.seconds,
                     report.machine, report.cores);
  out << fmt::format("frames {} ({} late), scene time {:.1f} s, pictures {}{}\n", report.frames,
                     report.late_frames, report.simulated, report.pictures,
                     report.renderer.empty() ? "" : " by " + report.renderer);
  for (const HapticToolReport& tool : report.tools) {
    out << fmt::format("\n{} ({}), {}\n", tool.name, tool.device, tool.scheduler);
    out << fmt::format("  ticks {}, missed {}, greatest force {:.2f} N\n", tool.ticks, tool.missed,
                       tool.greatest_force);
    out << fmt::format("  {:<22}{:>10}{:>10}{:>10}{:>10}\n", "us", "p50", "p99", "p99.9", "max");
    print_row(out, "lateness", tool.lateness,
              fmt::format("to reach: p50 {:.0f}, p99 {:.0f}", kLatenessP50, kLatenessP99));
    print_row(out, "computing", tool.compute, fmt::format("to reach: p99.9 {:.0f}", kComputeP999));
    for (std::size_t i = 0; i < kTickParts; ++i)
      print_row(out, fmt::format("  {}", kTickPartNames[i]), tool.parts[i], "");
    out << fmt::format("  energy given to the hand {:.3g} J, passivity violations {}\n",
                       tool.energy, tool.passivity_violations);
    out << fmt::format("  hives built {}, refused {}, ticks in contact without one {}\n",
                       tool.tissue.hives, tool.tissue.refused, tool.tissue.uncovered);
    if (tool.tissue.newton_steps > 0)
      out << fmt::format(
          "  beyond linear: Newton steps {}, ticks by the last good tangent {} ({} for want of "
          "time), by "
          "the linear hive {}\n",
          tool.tissue.newton_steps, tool.tissue.tangent_answers, tool.tissue.deadline_misses,
          tool.tissue.linear_answers);
    for (const std::string& event : tool.events) out << "  " << event << '\n';
  }
}

std::string to_json_text(const HapticsReport& report) {
  Json root = report.tools.empty() ? Json::object() : to_json(report.tools.front());
  root["scene"] = report.scene;
  root["machine"] = report.machine;
  root["cores"] = report.cores;
  root["seconds"] = report.seconds;
  root["frames"] = report.frames;
  root["late_frames"] = report.late_frames;
  root["scene_s"] = report.simulated;
  root["pictures"] = report.pictures;
  root["renderer"] = report.renderer;
  Json tools = Json::array();
  for (const HapticToolReport& tool : report.tools) tools.push_back(to_json(tool));
  root["tools"] = std::move(tools);
  return root.dump(2) + "\n";
}

Result<void> draw_latency_plots(const std::vector<HapticTool>& tools,
                                const std::filesystem::path& folder) {
  if (auto made = check_out_folder(folder); !made) return made;
  for (const HapticTool& tool : tools) {
    const ServoStatistics& statistics = tool.loop->statistics();
    Plot plot;
    plot.title = "Lateness and computing time of a tick";
    plot.subtitle =
        fmt::format("{}, {} ticks, {}", tool.name, statistics.ticks.load(), tool.loop->scheduler());
    plot.x = {"time (us)", true};
    plot.y = {"share of the ticks (%)", true};
    plot.series = {series_of(statistics.lateness, "lateness"),
                   series_of(statistics.compute, "computing")};
    if (auto written = write_file(folder / fmt::format("latency_{}.svg", tool.name), to_svg(plot));
        !written)
      return written;
  }
  return {};
}

}  // namespace viscera
