#include "tools/bench/bench_heat.h"

#include <fmt/format.h>
#include <oneapi/tbb/info.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <ostream>

#include "engine/gpu/gpu_heat.h"
#include "engine/io/atomic_file.h"
#include "engine/io/interrupt.h"
#include "engine/io/report.h"
#include "engine/verification/heat_case.h"
#include "engine/verification/standard_burn.h"
#include "tools/bench/bench_heat_plots.h"
#include "tools/bench/bench_stiffness.h"
#include "tools/common/bench_figures.h"

namespace viscera {
namespace {

constexpr double kFrame = HeatCase::kStep;
constexpr double kEdgeError = 2.0, kStepMs = 4.0, kBookPercent = 1.0;  // to reach
constexpr std::size_t kTargetVoxels = 100'000;

/// Of burns like it nothing was found; with so much more power and time they become no wider.
const PublishedLesion kPublished{
    .most_width = 9.3e-3, .source = "bovine liver, 100 and 200 W, 10 to 30 s [KoreaMed1067937]"};

HeatTime step_time(int edge_bricks, std::shared_ptr<HeatPasses> passes) {
  HeatCase made(edge_bricks, std::move(passes));
  HeatTime time;
  std::vector<std::size_t> counts;
  time.step_s = median_call_s(
      [&] {
        made.heat_middle();
        made.heat().step(HeatCase::kStep);
        counts.push_back(made.heat().warm_voxels());
      },
      1.0);
  std::nth_element(counts.begin(), counts.begin() + static_cast<std::ptrdiff_t>(counts.size() / 2),
                   counts.end());
  time.voxels = counts[counts.size() / 2];
  return time;
}

/// Times steps of more and more voxels, on the CPU or on `gpu`, and prints them.
Result<std::vector<HeatTime>> step_times(const std::vector<int>& edges, const GpuHeat* gpu,
                                         const std::string& device, std::ostream& out) {
  std::vector<HeatTime> times;
  for (const int edge : edges) {
    if (interrupted()) return failure(kCancelled);
    const std::shared_ptr<GpuHeat> passes = gpu ? gpu->another() : nullptr;
    HeatTime one = step_time(edge, passes);
    if (passes && !passes->trouble().empty()) return failure(passes->trouble());
    one.backend = gpu ? Backend::kGpu : Backend::kCpu;
    one.device = device;
    out << fmt::format("{:<12}{:<8}{:>11.3f} ms{:>13.1f} ns\n", one.voxels, name_of(one.backend),
                       1e3 * one.step_s, 1e9 * one.step_s / static_cast<double>(one.voxels))
        << std::flush;
    times.push_back(std::move(one));
  }
  return times;
}

struct GpuTimes {
  std::vector<HeatTime> times;  ///< none: no driver
  bool software = false;
};

Result<GpuTimes> step_times_on_gpu(const std::vector<int>& edges, std::ostream& out) {
  const auto context = EglContext::create();
  if (!context) {
    out << "on the GPU: skipped, " << context.error().text() << '\n';
    return GpuTimes{};
  }
  const auto gpu = GpuHeat::create();
  if (!gpu) return std::unexpected(gpu.error());
  const std::string device = (*context)->device();
  out << "on the GPU: " << device
      << ((*context)->software() ? " (a software driver: figures say nothing of a GPU)" : "")
      << '\n';
  auto times = step_times(edges, gpu->get(), device, out);
  if (!times) return std::unexpected(times.error());
  return GpuTimes{*std::move(times), (*context)->software()};
}

/// Between the two sizes around it, in proportion.
double at_target(const std::vector<HeatTime>& times) {
  for (std::size_t i = 1; i < times.size(); ++i) {
    if (times[i].voxels < kTargetVoxels) continue;
    const double t =
        (static_cast<double>(kTargetVoxels) - static_cast<double>(times[i - 1].voxels)) /
        static_cast<double>(times[i].voxels - times[i - 1].voxels);
    return times[i - 1].step_s + std::max(0.0, t) * (times[i].step_s - times[i - 1].step_s);
  }
  const HeatTime& last = times.back();
  return last.step_s * static_cast<double>(kTargetVoxels) / static_cast<double>(last.voxels);
}

nlohmann::json to_json(const HeatBook& book) {
  return {{"delivered_J", book.delivered},   {"metabolic_J", book.metabolic},
          {"stored_J", book.stored},         {"latent_J", book.latent},
          {"vapour_J", book.vapour},         {"pyrolysis_J", book.pyrolysis},
          {"perfused_J", book.perfused},     {"gas_J", book.gas},
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
  return {
      {"rows", rows},
      {"generated_J", burn.generated},
      {"warm_voxels", burn.warm_voxels},
      {"book", to_json(burn.book)},
      {"published",
       {{"most_width_m", *kPublished.most_width}, {"source", kPublished.source}, {"mark", "A"}}}};
}

void print_burn(const BurnResult& burn, std::ostream& out) {
  const BurnRow& last = burn.rows.back();
  out << fmt::format(
      "standard burn (liver, 30 W, 3 s, ball of 2 mm): {:.1f} mm deep, {:.1f} mm wide, {:.0f} C at "
      "most, {:.1f} mg of water boiled\n  dead: {:.1f} mm deep, {:.1f} mm wide; published, of {}: "
      "{:.1f} mm wide at most\n",
      1e3 * last.lesion.depth, 1e3 * last.lesion.width, last.greatest - kZeroCelsius,
      1e6 * last.water, 1e3 * last.dead.depth, 1e3 * last.dead.width, kPublished.source,
      1e3 * *kPublished.most_width);
  const HeatBook& book = burn.book;
  out << fmt::format(
      "  of {:.1f} J delivered: stored {:.1f}, latent {:.1f}, vapour {:.1f}, pyrolysis {:.1f}, "
      "blood "
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
      errors.push_back({voxel, dt, lesion_edge_error(voxel, dt)});
      out << fmt::format("{:>7.2f} mm{:>9.2f} ms{:>12.3f} %\n", 1e3 * voxel, 1e3 * dt,
                         100.0 * errors.back().error)
          << std::flush;
    }
  }
  out << fmt::format("{:<12}{:<8}{:>14}{:>16}\n", "voxels", "on", "step", "a voxel");
  const std::vector<int> edges = options.quick ? std::vector{2, 4} : std::vector{2, 3, 4, 5, 6, 7};
  auto times = step_times(edges, nullptr, this_machine().cpu, out);
  if (!times) return std::unexpected(times.error());
  auto gpu_times = step_times_on_gpu(edges, out);
  if (!gpu_times) return std::unexpected(gpu_times.error());
  const BurnResult burn = make_burn({});
  print_burn(burn, out);
  const auto stiffness = bench_stiffness(options.quick, out);
  if (!stiffness) return std::unexpected(stiffness.error());

  const auto wanted = std::find_if(errors.begin(), errors.end(), [](const HeatError& one) {
    return one.voxel == 0.5e-3 && one.dt == kFrame;
  });
  std::vector<BenchRow> rows = {
      {"error at the lesion's edge, 0.5 mm", "%", 100.0 * wanted->error, kEdgeError},
      {"step with 100,000 active voxels", "ms", 1e3 * at_target(*times), kStepMs},
      {"residual of the energy book", "%",
       100.0 * std::abs(burn.book.residual()) / burn.book.delivered, kBookPercent}};
  rows.push_back({"the same on the GPU, fields back", "ms", std::nullopt, kStepMs});
  if (gpu_times->times.empty())
    rows.back().dropped = {"no OpenGL driver"};
  else if (gpu_times->software)
    rows.back().dropped = {"a driver in software says nothing of a GPU"};
  else
    rows.back().value = 1e3 * at_target(gpu_times->times);
  print_rows(rows, "heat", out);
  times->insert(times->end(), gpu_times->times.begin(), gpu_times->times.end());

  if (!options.plots.empty())
    if (auto drawn = draw_heat_plots(errors, *times, burn, kPublished, options.plots); !drawn)
      return drawn;
  if (options.json.empty()) return {};
  nlohmann::json json = {{"machine", this_machine().cpu},
                         {"threads", oneapi::tbb::info::default_concurrency()},
                         {"errors", nlohmann::json::array()},
                         {"times", nlohmann::json::array()},
                         {"burn", to_json(burn)},
                         {"stiffness", to_json(*stiffness)},
                         {"rows", to_json(rows)}};
  for (const HeatError& one : errors)
    json["errors"].push_back({{"voxel_m", one.voxel}, {"step_s", one.dt}, {"error", one.error}});
  for (const HeatTime& one : *times)
    json["times"].push_back({{"voxels", one.voxels},
                             {"step_ms", 1e3 * one.step_s},
                             {"backend", name_of(one.backend)},
                             {"device", one.device}});
  return write_file(options.json, json.dump(2) + "\n");
}

}  // namespace viscera
