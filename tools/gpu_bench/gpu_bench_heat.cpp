#include "tools/gpu_bench/gpu_bench_heat.h"

#include <fmt/format.h>
#include <oneapi/tbb/info.h>

#include <algorithm>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "engine/gpu/gpu_heat.h"
#include "engine/verification/heat_case.h"
#include "kernels/base/stopwatch.h"
#include "tools/gpu_bench/gpu_bench_device.h"

namespace viscera {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kWarmUps = 3;
constexpr double kEdgeError = 0.02;  // to reach, at 0.5 mm

/// What a pass can't do without reading or writing once a voxel, caches being perfect [bytes].
const std::map<std::string, double> kBytesAVoxel = {
    // The state, openings and sources in; conductivity, capacity and blood out and in; the rate
    // out.
    {"rates", 17 * sizeof(float)},
    {"advance", 4 * sizeof(float)},
    // The state before and after, fraction and surface; damage out.
    {"settle", 8 * sizeof(float)}};

double quantile(std::vector<double> values, double q) {
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1) + 0.5)];
}

using Times = std::map<std::string, std::vector<double>>;

struct Case {
  Times seconds;  // of each pass, and of whole steps
  std::size_t bricks = 0, voxels = 0, bytes = 0;
  HeatDifference difference;  // from the CPU
};

/// Steps from the same start; the CPU's sources aren't timed.
template <class Step>
void repeat(HeatCase& made, int repeats, const Step& step) {
  for (int r = -kWarmUps; r < repeats; ++r) {
    made.heat_middle();
    step(made.heat(), r >= 0);
  }
}

Result<Case> time_case(const GpuHeat& device, int edge, const GpuHeatBenchArguments& arguments) {
  Case timed;
  PassTimer timer;
  const std::shared_ptr<GpuHeat> every = device.another(), asked = device.another();
  HeatCase gpu(edge, every), kept(edge, asked, HeatReturn::kWhenAsked), cpu(edge);
  every->time_with(&timer);
  repeat(gpu, arguments.repeats, [&](Bioheat& heat, bool counts) {
    const Stopwatch watch;
    timer.start();
    heat.step(HeatCase::kStep);
    const double whole = watch.seconds();
    std::map<std::string, double> passes;
    for (const PassTime& pass : timer.finish()) passes[pass.name] += pass.seconds;
    if (!counts) return;
    timed.seconds["step, fields back"].push_back(whole);
    for (const auto& [name, seconds] : passes) timed.seconds[name].push_back(seconds);
  });
  every->time_with(nullptr);
  repeat(kept, arguments.repeats, [&](Bioheat& heat, bool counts) {
    const Stopwatch watch;
    heat.step(HeatCase::kStep);
    if (counts) timed.seconds["step, fields stay"].push_back(watch.seconds());
  });
  repeat(cpu, arguments.repeats, [&](Bioheat& heat, bool counts) {
    const Stopwatch watch;
    heat.step(HeatCase::kStep);
    if (counts) timed.seconds["step on the CPU"].push_back(watch.seconds());
  });
  for (const HeatCase* one : {&gpu, &kept})
    if (!one->heat().device_failure().empty()) return failure(one->heat().device_failure());
  timed.bricks = gpu.heat().warm_bricks();
  timed.voxels = gpu.heat().warm_voxels();
  timed.bytes = every->bytes();
  timed.difference = heat_difference(cpu.heat(), gpu.heat());
  return timed;
}

void report_case(const Case& timed, const std::string& device, const MemoryBandwidth& memory,
                 Json& report) {
  const auto voxels = static_cast<double>(timed.voxels);
  std::cout << fmt::format("\n{} active voxels in {} bricks; {:.1f} MB on the device\n",
                           timed.voxels, timed.bricks, 1e-6 * static_cast<double>(timed.bytes));
  for (const auto& [pass, seconds] : timed.seconds) {
    const double median = quantile(seconds, 0.5), p99 = quantile(seconds, 0.99);
    const bool on_cpu = pass == "step on the CPU";
    Json row = {{"backend", on_cpu ? "cpu" : "gpu"},
                {"voxels", timed.voxels},
                {"pass", pass},
                {"median_ms", 1e3 * median},
                {"p99_ms", 1e3 * p99}};
    if (!on_cpu) row["device"] = device;
    std::string share;
    if (const auto bytes = kBytesAVoxel.find(pass); bytes != kBytesAVoxel.end()) {
      const double part = bytes->second * voxels / std::max(median, 1e-9) / memory.copy;
      row["bandwidth_share"] = part;
      share = fmt::format("{:6.1f} % of bandwidth", 100.0 * part);
    }
    std::cout << fmt::format("  {:20} {:9.3f} ms (p99 {:9.3f}) {}\n", pass, 1e3 * median, 1e3 * p99,
                             share);
    report["cases"].push_back(std::move(row));
  }
  const HeatDifference& off = timed.difference;
  if (off.same_bricks) {
    std::cout << fmt::format(
        "  from the CPU: temperature {:.1e} of the greatest, water {:.1e}, char {:.1e}, damage "
        "{:.1e}\n",
        off.excess, off.water, off.charred, off.damage);
  } else {
    std::cout << "  NOT the bricks that the CPU has\n";
  }
  report["differences"].push_back({{"voxels", timed.voxels},
                                   {"same_bricks", off.same_bricks},
                                   {"excess", off.excess},
                                   {"water", off.water},
                                   {"charred", off.charred},
                                   {"damage", off.damage}});
}

}  // namespace

Result<void> bench_gpu_heat(const GpuHeatBenchArguments& arguments) {
  const Result<BenchDevice> opened = open_bench_device(arguments.window_mb, arguments.repeats);
  if (!opened) return std::unexpected(opened.error());
  const std::string device = opened->context->device();
  const Stopwatch starting;
  Result<std::unique_ptr<GpuHeat>> gpu = GpuHeat::create();
  if (!gpu) return std::unexpected(gpu.error());
  const double start_s = starting.seconds();
  std::cout << fmt::format("start-up: kernels ready in {:.2f} s\n", start_s);

  Json report;
  report["device"] = device;
  report["software"] = opened->context->software();
  report["threads"] = oneapi::tbb::info::default_concurrency();
  report["start_s"] = start_s;
  report["memory"] = {{"read_bytes_per_s", opened->memory.read},
                      {"copy_bytes_per_s", opened->memory.copy}};
  report["repeats"] = arguments.repeats;
  report["step_s"] = HeatCase::kStep;
  report["cases"] = report["differences"] = Json::array();
  for (const int edge : arguments.bricks) {
    const Result<Case> timed = time_case(**gpu, edge, arguments);
    if (!timed) return std::unexpected(timed.error());
    report_case(*timed, device, opened->memory, report);
  }
  const std::shared_ptr<GpuHeat> own = (*gpu)->another();
  const double error = lesion_edge_error(0.5e-3, HeatCase::kStep, own);
  if (!own->trouble().empty()) return failure(own->trouble());
  report["edge_error"] = error;
  std::cout << fmt::format(
      "\nerror at a lesion's edge at 0.5 mm {:.2f} %  (to reach {:.0f} %: {})\n", 100.0 * error,
      100.0 * kEdgeError, error <= kEdgeError ? "met" : "NOT met");
  if (!arguments.json.empty()) return write_bench_json(arguments.json, report);
  return {};
}

}  // namespace viscera
