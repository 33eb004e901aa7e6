#include "tools/bench_heat.h"

#include <fmt/format.h>
#include <oneapi/tbb/info.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <ostream>

#include "engine/io/interrupt.h"
#include "engine/io/atomic_file.h"
#include "engine/io/report.h"
#include "engine/verification/heat_solutions.h"
#include "engine/verification/standard_burn.h"
#include "tools/bench_figures.h"
#include "tools/bench_heat_plots.h"

namespace viscera {
namespace {

constexpr double kFrame = 1.0 / 60.0;
constexpr double kEdgeError = 2.0, kStepMs = 4.0, kBookPercent = 1.0;  // to reach
constexpr std::size_t kTargetVoxels = 100'000;

/// Recalled, for some seconds at 20 to 40 W; the greatest width is the one that
/// 100 and 200 W made in 10 to 30 s in bovine liver ex vivo [KoreaMed1067937].
const PublishedLesion kPublished{1.5e-3, 5.0e-3, 3.0e-3, 9.3e-3, "recalled"};

/// Where a Gaussian source has warmed tissue by 15 to 35 K after three seconds: about 60 C.
HeatError edge_error(double voxel, double dt) {
  const ThermalTissue tissue = plain_tissue();
  BioheatOptions options;
  options.voxel = voxel;
  options.cooling.coefficient = 0.0;
  Bioheat heat(tissue, options);
  constexpr double kWidth = 1e-3, kPower = 0.7, kTime = 3.0;
  const int steps = static_cast<int>(std::lround(kTime / dt));
  for (int step = 0; step < steps; ++step) {
    heat_gaussian(heat, Vec3::Zero(), kWidth, kPower);
    heat.step(dt);
  }
  HeatError result{voxel, dt, 0.0};
  for (std::size_t b = 0; b < heat.bricks().count(); ++b) {
    const HeatBrick& brick = heat.bricks().brick(b);
    if (!brick.warm) continue;
    for (int i = 0; i < BrickField::kVoxels; ++i) {
      const double r = heat.bricks().centre(brick, i).norm();
      const double exact = gaussian_source(tissue, kPower, kWidth, r, kTime);
      if (exact < 15.0 || exact > 35.0) continue;
      result.error = std::max(result.error, std::abs(brick.warm->excess[i] - exact) / exact);
    }
  }
  return result;
}

/// A cube of warm, half-cooked tissue with blood under a surface; its middle boils.
HeatTime step_time(int edge_bricks) {
  Bioheat heat(ThermalTissue{}, BioheatOptions{},
               [](const Vec3& p) { return p.z() - 0.2e-3; });
  const double edge = edge_bricks * HeatBricks::kEdge * heat.options().voxel;
  const Box box(Vec3(0.0, 0.0, -edge + 1e-6), Vec3(edge - 1e-6, edge - 1e-6, 0.0));
  const Vec3 middle(0.5 * edge, 0.5 * edge, -0.2e-3);
  set_excess(heat, box, [&](const Vec3& p) {
    return 12.0 + 8.0 * std::sin(2e3 * p.x()) * std::sin(3e3 * p.y()) + 5.0 * std::sin(1e3 * p.z());
  });
  // The sides' heat isn't followed, so that the number of voxels stays.
  for (std::size_t b = 0; b < heat.bricks().count(); ++b) {
    HeatBrick& brick = heat.bricks().brick(b);
    for (float& damage : brick.damage) damage = 0.2f;
  }
  HeatTime time;
  std::vector<std::size_t> counts;
  time.step_s = median_call_s(
      [&] {
        heat_gaussian(heat, middle, 0.5e-3, 15.0);
        heat.step(kFrame);
        counts.push_back(heat.warm_voxels());
      },
      1.0);
  std::nth_element(counts.begin(), counts.begin() + static_cast<std::ptrdiff_t>(counts.size() / 2),
                   counts.end());
  time.voxels = counts[counts.size() / 2];
  return time;
}

/// Between the two sizes around it, in proportion.
double at_target(const std::vector<HeatTime>& times) {
  for (std::size_t i = 1; i < times.size(); ++i) {
    if (times[i].voxels < kTargetVoxels) continue;
    const double t = (static_cast<double>(kTargetVoxels) - static_cast<double>(times[i - 1].voxels)) /
                     static_cast<double>(times[i].voxels - times[i - 1].voxels);
    return times[i - 1].step_s + std::max(0.0, t) * (times[i].step_s - times[i - 1].step_s);
  }
  const HeatTime& last = times.back();
  return last.step_s * static_cast<double>(kTargetVoxels) / static_cast<double>(last.voxels);
}

nlohmann::json to_json(const HeatBook& book) {
  return {{"delivered_J", book.delivered}, {"metabolic_J", book.metabolic},
          {"stored_J", book.stored},       {"latent_J", book.latent},
          {"vapour_J", book.vapour},       {"pyrolysis_J", book.pyrolysis},
          {"perfused_J", book.perfused},   {"gas_J", book.gas},
          {"instrument_J", book.instrument}, {"boundary_J", book.boundary},
          {"residual_J", book.residual()}};
}

nlohmann::json to_json(const BurnResult& burn) {
  nlohmann::json rows = nlohmann::json::array();
  for (std::size_t i = 5; i < burn.rows.size(); i += 6) {
    const BurnRow& row = burn.rows[i];
    rows.push_back({{"time_s", row.time},
                    {"depth_m", row.lesion.depth},
                    {"width_m", row.lesion.width},
                    {"power_W", row.current.power},
                    {"resistance_Ohm", row.current.resistance},
                    {"greatest_K", row.greatest},
                    {"water_kg", row.water}});
  }
  return {{"rows", rows},
          {"generated_J", burn.generated},
          {"warm_voxels", burn.warm_voxels},
          {"book", to_json(burn.book)},
          {"published", {{"depth_m", {kPublished.least_depth, kPublished.most_depth}},
                         {"width_m", {kPublished.least_width, kPublished.most_width}},
                         {"mark", "R"}}}};
}

void print_burn(const BurnResult& burn, std::ostream& out) {
  const BurnRow& last = burn.rows.back();
  out << fmt::format(
      "standard burn (liver, 30 W, 3 s, ball of 2 mm): {:.1f} mm deep, {:.1f} mm wide, {:.0f} C at "
      "most, {:.1f} mg of water boiled\n  published, recalled: {:.1f} to {:.1f} mm deep, {:.1f} to "
      "{:.1f} mm wide\n",
      1e3 * last.lesion.depth, 1e3 * last.lesion.width, last.greatest - kZeroCelsius,
      1e6 * last.water, 1e3 * kPublished.least_depth, 1e3 * kPublished.most_depth,
      1e3 * kPublished.least_width, 1e3 * kPublished.most_width);
  const HeatBook& book = burn.book;
  out << fmt::format(
      "  of {:.1f} J delivered: stored {:.1f}, latent {:.1f}, vapour {:.1f}, pyrolysis {:.1f}, blood "
      "{:.1f}, gas {:.2f}, instrument {:.2f}, boundary {:.2f}, residual {:.1e} J\n",
      book.delivered, book.stored, book.latent, book.vapour, book.pyrolysis, book.perfused,
      book.gas, book.instrument, book.boundary, book.residual());
}

}  // namespace

Result<void> bench_heat(const HeatBenchOptions& options, std::ostream& out) {
  if (auto able = check_outputs({options.json}, options.plots); !able) return able;
  std::vector<HeatError> errors;
  out << fmt::format("{:<12}{:>12}{:>14}\n", "voxel", "step", "edge error");
  const std::vector<double> voxels =
      options.quick ? std::vector{1e-3, 0.5e-3} : std::vector{1e-3, 0.5e-3, 0.25e-3};
  for (const double dt : {1.0 / 30.0, kFrame, 1.0 / 240.0}) {
    if (options.quick && dt < kFrame) continue;
    for (const double voxel : voxels) {
      if (interrupted()) return failure(kCancelled);
      errors.push_back(edge_error(voxel, dt));
      out << fmt::format("{:>7.2f} mm{:>9.2f} ms{:>12.3f} %\n", 1e3 * voxel, 1e3 * dt,
                         100.0 * errors.back().error)
          << std::flush;
    }
  }
  std::vector<HeatTime> times;
  out << fmt::format("{:<12}{:>14}{:>16}\n", "voxels", "step", "a voxel");
  const std::vector<int> edges = options.quick ? std::vector{2, 4} : std::vector{2, 3, 4, 5, 6, 7};
  for (const int edge : edges) {
    if (interrupted()) return failure(kCancelled);
    times.push_back(step_time(edge));
    const HeatTime& one = times.back();
    out << fmt::format("{:<12}{:>11.3f} ms{:>13.1f} ns\n", one.voxels, 1e3 * one.step_s,
                       1e9 * one.step_s / static_cast<double>(one.voxels))
        << std::flush;
  }
  const BurnResult burn = make_burn({});
  print_burn(burn, out);

  const auto wanted = std::find_if(errors.begin(), errors.end(), [](const HeatError& one) {
    return one.voxel == 0.5e-3 && one.dt == kFrame;
  });
  const std::vector<BenchRow> rows = {
      {"error at the lesion's edge, 0.5 mm", "%", 100.0 * wanted->error, kEdgeError},
      {"step with 100,000 active voxels", "ms", 1e3 * at_target(times), kStepMs},
      {"residual of the energy book", "%",
       100.0 * std::abs(burn.book.residual()) / burn.book.delivered, kBookPercent}};
  print_rows(rows, "heat", out);

  if (!options.plots.empty())
    if (auto drawn = draw_heat_plots(errors, times, burn, kPublished, options.plots); !drawn)
      return drawn;
  if (options.json.empty()) return {};
  nlohmann::json json = {{"machine", this_machine().cpu},
                         {"threads", oneapi::tbb::info::default_concurrency()},
                         {"errors", nlohmann::json::array()},
                         {"times", nlohmann::json::array()},
                         {"burn", to_json(burn)},
                         {"rows", to_json(rows)}};
  for (const HeatError& one : errors)
    json["errors"].push_back({{"voxel_m", one.voxel}, {"step_s", one.dt}, {"error", one.error}});
  for (const HeatTime& one : times)
    json["times"].push_back({{"voxels", one.voxels}, {"step_ms", 1e3 * one.step_s}});
  return write_file(options.json, json.dump(2) + "\n");
}

}  // namespace viscera
