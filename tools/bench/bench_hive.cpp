#include "tools/bench/bench_hive.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <ostream>

#include "engine/io/atomic_file.h"
#include "engine/io/interrupt.h"
#include "engine/io/report.h"
#include "engine/io/svg_plot.h"
#include "engine/verification/hemisphere_body.h"
#include "kernels/hive/hive.h"
#include "tools/bench/bench_hive_moving.h"
#include "tools/bench/bench_nonlinear_hive.h"
#include "tools/common/bench_figures.h"
#include "tools/common/project_paths.h"

namespace viscera {
namespace {

constexpr double kTool = 0.1;         // contact radius over R
constexpr int kRings = 3;             // of cells in the tool's patch: 37
constexpr double kShownRadius = 0.4;  // of the hive over R, of the figures to reach
constexpr double kTimedFor = 0.02;    // [s]
constexpr double kForceUnit =
    kHemisphereModulus * kHemisphereRadius * kHemisphereRadius * kHemisphereDepth;  // [N]
/// [De2006]: a hive of 28 nodes, built and solved, on a Pentium 4 of 2.2 GHz.
constexpr double kPublishedNodes = 28.0, kPublishedUs = 13'700.0;

struct HiveCase {
  HiveFormulation formulation{};
  HivePeriphery periphery{};
  int nodes = 0, unknowns = 0;
  double radius = 0.0, poisson = 0.0;
  double build_us = 0.0;  ///< walk, nodes, equations, factor, condensed to the surface
  double solve_us = 0.0;  ///< condensed to a tool's cells, and pressed
  double tick_us = 0.0;   ///< pressed again, the hive at rest
  std::optional<double> force_error, profile_error;
  std::string refused;
};

nlohmann::json or_null(const std::optional<double>& value) {
  return value ? nlohmann::json(*value) : nlohmann::json(nullptr);
}

nlohmann::json to_json(const HiveCase& one) {
  nlohmann::json json = {{"formulation", name_of(one.formulation)},
                         {"nodes", one.nodes},
                         {"unknowns", one.unknowns},
                         {"radius_over_R", one.radius},
                         {"periphery", name_of(one.periphery)},
                         {"poisson", one.poisson},
                         {"build_us", one.build_us},
                         {"solve_us", one.solve_us},
                         {"tick_us", one.tick_us},
                         {"force_error", or_null(one.force_error)},
                         {"profile_error", or_null(one.profile_error)}};
  if (!one.refused.empty()) json["refused"] = one.refused;
  return json;
}

struct Ground {
  std::unique_ptr<HemisphereBody> body;
  std::unique_ptr<WalkableSurface> surface;
  const HemisphereReference* reference = nullptr;
};

/// Relative L2 over the dome within the hive's radius.
double profile_error(const Hive& hive, const Ground& ground) {
  constexpr int kAcross = 48, kAround = 8;
  const HemisphereProfile& exact = ground.reference->profile(HemisphereContact::kFrictionless);
  const double farthest = hive.settings().radius / kHemisphereRadius;
  double error = 0.0, size = 0.0;
  for (int i = 0; i < kAcross; ++i) {
    const double polar = farthest * (i + 0.5) / kAcross;
    for (int k = 0; k < kAround; ++k) {
      const double angle = 2.0 * 3.14159265358979 * (k + 0.3) / kAround;
      const SurfaceSpot spot = ground.surface->nearest(
          kHemisphereRadius * Vec3(std::sin(polar) * std::cos(angle),
                                   std::sin(polar) * std::sin(angle), std::cos(polar)));
      const Vec3 expected = kHemisphereRadius * exact.at(spot.position.normalized());
      error += std::sin(polar) * (hive.displacement(spot) - expected).squaredNorm();
      size += std::sin(polar) * expected.squaredNorm();
    }
  }
  return std::sqrt(error / size);
}

HiveCase measure(const Ground& ground, HiveFormulation formulation, HivePeriphery periphery,
                 int nodes, double radius) {
  HiveCase one;
  one.formulation = formulation;
  one.periphery = periphery;
  one.nodes = nodes;
  one.radius = radius;
  one.poisson = ground.body->material().poisson_ratio;
  HiveSettings settings;
  settings.formulation = formulation;
  settings.periphery = periphery;
  settings.material = ground.body->material();
  settings.radius = radius * kHemisphereRadius;
  settings.nodes = nodes;
  auto hive = Hive::create(
      {ground.surface.get(), &ground.body->compliance(), &ground.body->touchable()}, settings, 127);
  if (!hive) {
    one.refused = hive.error().text();
    return one;
  }
  one.nodes = hive->figures().nodes;
  one.unknowns = hive->figures().unknowns;
  const SurfaceSpot pole = ground.surface->nearest(Vec3(0.0, 0.0, kHemisphereRadius));
  const auto cells_of = [&](int rings) {
    return HemisphereBody::cells(HemisphereContact::kFrictionless, one.poisson, kTool, rings, 0.0);
  };
  const auto cells = cells_of(kRings);
  std::vector<double> depths;
  for (const ContactCell& cell : cells) depths.push_back(cell.depth);
  HiveVerdict verdict = hive->build(pole);
  if (verdict == HiveVerdict::kSound) verdict = hive->seat(cells);
  HiveForce force;
  if (verdict == HiveVerdict::kSound) {
    force = hive->press(depths);
    verdict = force.verdict;
  }
  if (verdict != HiveVerdict::kSound) {
    one.refused = name_of(verdict);
    return one;
  }
  one.force_error = force.force.z() / kForceUnit / ground.reference->frictionless - 1.0;
  one.build_us = 1e6 * median_call_s([&] { hive->build(pole); }, kTimedFor);
  one.solve_us = 1e6 * median_call_s(
                           [&] {
                             hive->seat(cells);
                             hive->press(depths);
                           },
                           kTimedFor);
  double sum = 0.0;
  int tick = 0;
  one.tick_us = 1e6 * median_call_s(
                          [&] {
                            const double scale = 1.0 + 0.01 * (++tick % 7);
                            for (std::size_t k = 0; k < depths.size(); ++k)
                              depths[k] = scale * cells[k].depth;
                            sum += hive->press(depths).energy;
                          },
                          kTimedFor);
  // The profile on cells as fine as the tool's edge asks for.
  const auto fine = cells_of(6);
  std::vector<double> fine_depths;
  for (const ContactCell& cell : fine) fine_depths.push_back(cell.depth);
  if (hive->seat(fine) == HiveVerdict::kSound &&
      hive->press(fine_depths).verdict == HiveVerdict::kSound && sum > 0.0)
    one.profile_error = profile_error(*hive, ground);
  return one;
}

void print_heading(std::ostream& out) {
  out << fmt::format("{:<12}{:<12}{:>5}{:>7}{:>10}{:>10}{:>10}{:>10}{:>10}{:>10}\n", "formulation",
                     "periphery", "nu", "nodes", "radius/R", "build us", "solve us", "tick us",
                     "force %", "profile %");
}

void print_case(const HiveCase& one, std::ostream& out) {
  out << fmt::format("{:<12}{:<12}{:>5.2f}{:>7}{:>10.2f}", name_of(one.formulation),
                     name_of(one.periphery), one.poisson, one.nodes, one.radius);
  if (!one.refused.empty()) {
    out << "  refused: " << one.refused << '\n';
    return;
  }
  out << fmt::format("{:>10.1f}{:>10.1f}{:>10.2f}{:>+10.2f}{:>10}\n", one.build_us, one.solve_us,
                     one.tick_us, 100.0 * *one.force_error,
                     one.profile_error ? fmt::format("{:.2f}", 100.0 * *one.profile_error) : "-")
      << std::flush;
}

/// What was asked for, from the cases that show it; rows without a case are left out, and a case
/// that was refused is dropped from its row by name.
std::vector<BenchRow> rows_of(const std::vector<HiveCase>& cases) {
  std::vector<BenchRow> rows;
  const auto is_default = [](const HiveCase& one) {
    return one.formulation == HiveFormulation::kSubtracted &&
           one.periphery == HivePeriphery::kCoupled && std::abs(one.radius - kShownRadius) < 1e-9;
  };
  const auto worst = [&](const std::string& what, const std::string& unit, double target,
                         const auto& is_meant, const auto& value, double scale = 1.0) {
    WorstCase worst;
    for (const HiveCase& one : cases) {
      if (!is_meant(one)) continue;
      worst.add(one.refused.empty() ? value(one) : std::nullopt,
                fmt::format("nu {:.2f}, {} nodes, radius {:.2f} R: {}", one.poisson, one.nodes,
                            one.radius, one.refused.empty() ? "no error is known" : one.refused));
    }
    if (!worst.empty()) rows.push_back(worst.row(what, unit, target, scale));
  };
  const auto whole = [](const HiveCase& one) { return std::optional(one.build_us + one.solve_us); };
  worst(
      "28-node hive of the paper's kind, build + solve", "us", 120.0,
      [](const HiveCase& one) {
        return one.formulation == HiveFormulation::kPaper && one.nodes == 28 &&
               one.periphery == HivePeriphery::kFixed;
      },
      whole);
  worst(
      "80-node hive, default kind, build + solve", "us", 700.0,
      [&](const HiveCase& one) { return is_default(one) && one.nodes > 60 && one.nodes <= 80; },
      whole);
  const auto large = [&](const HiveCase& one) { return is_default(one) && one.nodes > 150; };
  worst("resting hive of 200 nodes, tick", "us", 20.0, large,
        [](const HiveCase& one) { return std::optional(one.tick_us); });
  worst("moving hive of 200 nodes, tick without building", "us", 200.0, large,
        [](const HiveCase& one) { return std::optional(one.solve_us); });
  for (const double nu : {0.30, 0.45})
    worst(
        fmt::format("force error, coupled, at most 120 nodes, radius 0.4 R, nu {:.2f}", nu), "%",
        5.0,
        [&](const HiveCase& one) {
          return is_default(one) && one.nodes <= 120 && std::abs(one.poisson - nu) < 1e-9;
        },
        [](const HiveCase& one) { return one.force_error; }, 100.0);
  return rows;
}

struct Kind {
  HiveFormulation formulation;
  HivePeriphery periphery;
  const char* name;
};
constexpr Kind kKinds[] = {
    {HiveFormulation::kSubtracted, HivePeriphery::kCoupled, "coupled"},
    {HiveFormulation::kSubtracted, HivePeriphery::kBoussinesq, "boussinesq"},
    {HiveFormulation::kSubtracted, HivePeriphery::kFixed, "fixed"},
    {HiveFormulation::kPaper, HivePeriphery::kBoussinesq, "paper, boussinesq"},
    {HiveFormulation::kPaper, HivePeriphery::kFixed, "paper"},
};

/// A line a kind through (x, y) of the cases that `is_meant` picks.
template <class Meant, class X, class Y>
std::vector<PlotSeries> series_of(const std::vector<HiveCase>& cases, const Meant& is_meant,
                                  const X& x, const Y& y) {
  std::vector<PlotSeries> all;
  for (std::size_t k = 0; k < std::size(kKinds); ++k) {
    PlotSeries series;
    series.name = kKinds[k].name;
    series.colour = static_cast<int>(k);
    series.dashed = series.hollow = kKinds[k].formulation == HiveFormulation::kPaper;
    for (const HiveCase& one : cases)
      if (one.refused.empty() && one.formulation == kKinds[k].formulation &&
          one.periphery == kKinds[k].periphery && is_meant(one))
        series.points.emplace_back(x(one), y(one));
    std::sort(series.points.begin(), series.points.end(),
              [](const Vec2& a, const Vec2& b) { return a.x() < b.x(); });
    if (!series.points.empty()) all.push_back(std::move(series));
  }
  return all;
}

/// [De2006] figure 8, and what a hive's radius does to its force.
Result<void> draw_plots(const std::vector<HiveCase>& cases, const std::filesystem::path& folder) {
  const double nu = cases.front().poisson;
  const auto same = [&](const HiveCase& one) { return std::abs(one.poisson - nu) < 1e-9; };
  Plot cost;
  cost.title = "Cost of a hive against its degrees of freedom";
  cost.subtitle = fmt::format(
      "build + solve, one thread; hive radius 0.4 R, tool 0.1 R, Poisson's ratio {:.2f}; "
      "[De2006] on a Pentium 4 of 2.2 GHz",
      nu);
  cost.x = {"degrees of freedom (three a node)", true};
  cost.y = {"time (us)", true};
  const auto shown = [&](const HiveCase& one) {
    return same(one) && std::abs(one.radius - kShownRadius) < 1e-9;
  };
  const auto unknowns = [](const HiveCase& one) { return 3.0 * one.nodes; };
  cost.series = series_of(cases, shown, unknowns,
                          [](const HiveCase& one) { return one.build_us + one.solve_us; });
  PlotSeries tick;
  tick.name = "coupled, tick at rest";
  tick.colour = 5;
  tick.dashed = true;
  for (const HiveCase& one : cases)
    if (shown(one) && one.refused.empty() && one.formulation == HiveFormulation::kSubtracted &&
        one.periphery == HivePeriphery::kCoupled)
      tick.points.emplace_back(unknowns(one), one.tick_us);
  cost.series.push_back(tick);
  PlotSeries published;
  published.name = "published, 2006 machine";
  published.colour = 6;
  published.line = false;
  published.points.emplace_back(3.0 * kPublishedNodes, kPublishedUs);
  cost.series.push_back(published);
  if (auto written = write_file(folder / "cost_against_unknowns.svg", to_svg(cost)); !written)
    return written;

  for (const double ratio : {0.30, 0.45}) {
    int nodes = 0;  // the largest number that every kind has
    for (const HiveCase& one : cases)
      if (one.refused.empty() && one.nodes <= 80) nodes = std::max(nodes, one.nodes);
    Plot error;
    error.title = "Force of a hive against its radius";
    error.subtitle = fmt::format(
        "{} nodes, tool 0.1 R, without friction, Poisson's ratio {:.2f}; against the reference",
        nodes, ratio);
    error.x = {"hive radius over R", false};
    error.y = {"error of the force (%)", false};
    error.series = series_of(
        cases,
        [&](const HiveCase& one) {
          return std::abs(one.poisson - ratio) < 1e-9 && one.nodes == nodes &&
                 one.formulation == HiveFormulation::kSubtracted;
        },
        [](const HiveCase& one) { return one.radius; },
        [](const HiveCase& one) { return 100.0 * *one.force_error; });
    if (error.series.empty()) continue;
    if (auto written = write_file(folder / fmt::format("force_against_radius_nu{:.2f}.svg", ratio),
                                  to_svg(error));
        !written)
      return written;
  }
  return {};
}

Result<void> check_options(const HiveBenchOptions& options,
                           const std::vector<HemisphereReference>& references) {
  Error mistakes;
  for (const int nodes : options.nodes)
    if (nodes < 14 || nodes > 512)
      mistakes.messages.push_back(fmt::format("--nodes: found {}, expected from 14 to 512", nodes));
  for (const double radius : options.radii)
    if (!(radius > 0.0 && radius <= 1.2))
      mistakes.messages.push_back(
          fmt::format("--radius: found {:g}, expected above 0 and at most 1.2", radius));
  for (const double nu : options.poisson_ratios)
    if (!find_reference(references, nu, kTool))
      mistakes.messages.push_back(fmt::format(
          "--poisson: found {:g}, expected 0.3, 0.45 or 0.49, which have a reference", nu));
  if (mistakes.messages.empty()) return {};
  return std::unexpected(mistakes);
}

}  // namespace

Result<void> bench_hive(const HiveBenchOptions& options, std::ostream& out) {
  const auto references = read_hemisphere_references(assets_folder() / "reference/hemisphere");
  if (!references) return std::unexpected(references.error());
  if (auto sound = check_options(options, *references); !sound) return sound;
  if (auto can = check_outputs({options.json}, options.plots); !can) return can;
  const auto nodes = !options.nodes.empty() ? options.nodes
                     : options.quick        ? std::vector<int>{28, 80, 200}
                                            : std::vector<int>{14, 28, 57, 80, 120, 200};
  const auto radii = !options.radii.empty() ? options.radii
                     : options.quick        ? std::vector<double>{kShownRadius}
                                            : std::vector<double>{0.2, 0.3, 0.4, 0.6, 0.8};
  const auto ratios =
      !options.poisson_ratios.empty() ? options.poisson_ratios : std::vector<double>{0.30, 0.45};
  std::vector<HiveCase> cases;
  print_heading(out);
  for (const double nu : ratios) {
    HemisphereOptions wanted;
    wanted.poisson_ratio = nu;
    Ground ground;
    auto body = HemisphereBody::prepare(wanted, until_interrupted());
    if (!body) return std::unexpected(body.error());
    ground.body = std::move(*body);
    auto surface = WalkableSurface::make(ground.body->surface());
    if (!surface) return std::unexpected(surface.error());
    ground.surface = std::make_unique<WalkableSurface>(std::move(*surface));
    ground.reference = find_reference(*references, nu, kTool);
    for (const Kind& kind : kKinds) {
      for (const int count : nodes) {
        for (const double radius : radii) {
          if (interrupted()) return failure(kCancelled);
          cases.push_back(measure(ground, kind.formulation, kind.periphery, count, radius));
          print_case(cases.back(), out);
        }
      }
    }
  }
  const auto beyond = bench_nonlinear_hive({ratios, options.quick}, out);
  if (!beyond) return std::unexpected(beyond.error());
  std::vector<BenchRow> rows = rows_of(cases);
  for (BenchRow& row : beyond->rows()) rows.push_back(std::move(row));
  out << '\n';
  MovingHiveOptions led;
  led.nodes = *std::max_element(nodes.begin(), nodes.end());
  if (options.quick) led.seconds = 2.0;
  const auto moving = measure_moving_hive(led);
  if (!moving) return std::unexpected(moving.error());
  print(*moving, out);
  for (BenchRow& row : rows_of(*moving)) rows.push_back(std::move(row));
  const MachineReport machine = this_machine();
  out << '\n';
  print_rows(rows, fmt::format("{} cores of {}, one thread", machine.cores, machine.cpu), out);
  if (!options.plots.empty())
    if (auto drawn = draw_plots(cases, options.plots); !drawn) return drawn;
  if (options.json.empty()) return {};
  nlohmann::json json = {{"machine", machine.cpu},
                         {"cores", machine.cores},
                         {"tool_over_R", kTool},
                         {"cells", 1 + 3 * kRings * (kRings + 1)},
                         {"cases", nlohmann::json::array()},
                         {"moving", to_json(*moving)},
                         {"beyond_linear", beyond->cases()},
                         {"rows", to_json(rows)}};
  for (const HiveCase& one : cases) json["cases"].push_back(to_json(one));
  return write_file(options.json, json.dump(2) + "\n");
}

}  // namespace viscera
