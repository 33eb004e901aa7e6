#include "tools/bench/bench_zwidth.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <ostream>

#include "engine/io/atomic_file.h"
#include "engine/io/interrupt.h"
#include "engine/io/report.h"
#include "engine/io/svg_plot.h"
#include "haptics/z_width.h"
#include "tools/common/bench_figures.h"

namespace viscera {
namespace {

constexpr double kMostDamping = 1000.0;  // [N s/m]

struct Case {
  double grip = 0.0, damping = 0.0;
  double controlled = 0.0, uncontrolled = 0.0;  // greatest stable stiffness [N/m]
};

Result<void> check(const ZWidthBenchOptions& options) {
  Error mistakes;
  for (const double grip : options.grips)
    if (!(grip >= 0.0 && grip <= 1.0))
      mistakes.messages.push_back(
          fmt::format("--grip: found {:g}, expected 0 (loose) to 1 (firm)", grip));
  for (const double damping : options.dampings)
    if (!(damping >= 0.0 && damping <= kMostDamping))
      mistakes.messages.push_back(
          fmt::format("--damping: found {:g}, expected 0 to {:g} N s/m", damping, kMostDamping));
  if (!mistakes.messages.empty()) return std::unexpected(mistakes);
  return check_outputs({options.json}, options.plots);
}

Case measure(double grip, double damping) {
  ZWidthCase trial;
  trial.grip = grip;
  trial.damping = damping;
  Case one{grip, damping};
  one.controlled = greatest_stable_stiffness(trial);
  trial.passivity = false;
  one.uncontrolled = greatest_stable_stiffness(trial);
  return one;
}

nlohmann::json to_json(const std::vector<Case>& cases) {
  const CouplingSettings coupling;
  nlohmann::json json = {
      {"machine", this_machine().cpu},
      {"device", "PHANToM Premium 1.0A, simulated"},
      {"default_coupling",
       {{"stiffness_N_per_m", coupling.stiffness}, {"damping_Ns_per_m", coupling.damping}}},
      {"cases", nlohmann::json::array()}};
  for (const Case& one : cases)
    for (const bool controller : {true, false})
      json["cases"].push_back(
          {{"grip", one.grip},
           {"damping_Ns_per_m", one.damping},
           {"passivity_controller", controller},
           {"greatest_stable_N_per_m", controller ? one.controlled : one.uncontrolled}});
  return json;
}

Result<void> draw(const std::vector<Case>& cases, const std::filesystem::path& folder) {
  Plot plot;
  plot.title = "Z-width: the stiffest wall without rattling";
  plot.subtitle =
      "simulated PHANToM Premium 1.0A, pressed with 1 N on a rigid wall; dashed: not kept passive";
  plot.x = {"damping of the coupling (N s/m)"};
  plot.y = {"greatest stable stiffness (N/m)", true};
  int colour = 0;
  for (std::size_t first = 0; first < cases.size(); ++colour) {
    PlotSeries with, without;
    const double grip = cases[first].grip;
    with.name = fmt::format("grip {:g}", grip);
    with.colour = without.colour = colour;
    without.dashed = without.hollow = true;
    for (; first < cases.size() && cases[first].grip == grip; ++first) {
      with.points.emplace_back(cases[first].damping, cases[first].controlled);
      without.points.emplace_back(cases[first].damping, cases[first].uncontrolled);
    }
    plot.series.push_back(std::move(with));
    plot.series.push_back(std::move(without));
  }
  return write_file(folder / "zwidth.svg", to_svg(plot));
}

}  // namespace

Result<void> bench_zwidth(const ZWidthBenchOptions& options, std::ostream& out) {
  if (auto sound = check(options); !sound) return sound;
  using List = std::vector<double>;
  const List grips = !options.grips.empty() ? options.grips
                     : options.quick        ? List{0.0, 0.5, 1.0}
                                            : List{0.0, 0.25, 0.5, 0.75, 1.0};
  const List dampings = !options.dampings.empty() ? options.dampings
                        : options.quick           ? List{0.0, 2.0, 10.0}
                                                  : List{0.0, 1.0, 2.0, 5.0, 10.0, 15.0, 20.0};
  const CouplingSettings coupling;
  out << fmt::format(
      "greatest stable stiffness (N/m); the default coupling has {:g} N/m and {:g} N "
      "s/m\n{:>6}{:>16}"
      "{:>18}{:>22}\n",
      coupling.stiffness, coupling.damping, "grip", "damping N s/m", "with controller",
      "without controller");
  std::vector<Case> cases;
  for (const double grip : grips)
    for (const double damping : dampings) {
      if (interrupted()) return failure(kCancelled);
      const Case one = measure(grip, damping);
      out << fmt::format("{:>6.2f}{:>16g}{:>18.0f}{:>22.0f}\n", grip, damping, one.controlled,
                         one.uncontrolled)
          << std::flush;
      cases.push_back(one);
    }
  if (!options.plots.empty())
    if (auto drawn = draw(cases, options.plots); !drawn) return drawn;
  if (options.json.empty()) return {};
  return write_file(options.json, to_json(cases).dump(2) + "\n");
}

}  // namespace viscera
