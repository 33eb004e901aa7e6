#include "tools/gpu_bench/gpu_bench_smoke.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "engine/gpu/gpu_smoke.h"
#include "engine/verification/shear_decay.h"
#include "engine/verification/smoke_case.h"
#include "kernels/base/stopwatch.h"
#include "kernels/smoke/swirl.h"
#include "kernels/smoke/viscosity.h"
#include "tools/bench/smoke_rows.h"
#include "tools/gpu_bench/gpu_bench_device.h"

namespace viscera {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kStep = 1.0 / 60.0;
constexpr int kWarmUps = 3;
constexpr std::size_t kMostParticles = 100'000'000;

double quantile(std::vector<double> values, double q) {
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1) + 0.5)];
}

struct Case {
  std::map<std::string, std::vector<double>> seconds;  // of each pass, and "step"
  double cells = 0.0, voxels = 0.0;
  std::size_t bytes = 0;
};

/// What the passes do to the case's particles. SmokeVolume would do the same with more ways to the
/// device and back; here the particles stay on it.
struct Passes {
  ViscosityParameters viscosity;
  IntegrateParameters integration;
  CollideParameters collision;

  Passes(const SmokeParameters& smoke, Laplacian laplacian) {
    const double h = smoke.spacing, nu = effective_viscosity(smoke);
    const Float4 extent = Float4::from(smoke.domain.sizes().cast<float>());
    viscosity.inverse_square = static_cast<float>(1.0 / (h * h));
    viscosity.viscosity = static_cast<float>(nu);
    viscosity.crowding = static_cast<float>(0.5 * smoke.crowding_speed * smoke.crowding_speed);
    viscosity.fill = 0.196f;
    viscosity.most_excess = 4.0f;
    viscosity.gas_drag = static_cast<float>(jet_drag(smoke).linear);
    viscosity.fewest_neighbours = 4;
    viscosity.laplacian = laplacian;
    viscosity.step = static_cast<float>(kStep);
    integration.extent = {extent.x, extent.y, extent.z, 0.2f};
    integration.step = static_cast<float>(kStep);
    integration.white = static_cast<float>(smoke.eddies.white);
    integration.entrainment = static_cast<float>(jet_drag(smoke).quadratic);
    integration.gas_temperature = static_cast<float>(smoke.gas_temperature);
    integration.turbulence = static_cast<float>(smoke.eddies.share);
    collision.gap = static_cast<float>(smoke.surface_gap);
    collision.friction = 0.2f;
    collision.touch = static_cast<float>(std::max(0.25 * h, smoke.surface_gap));
    collision.kept = 0.999f;
    collision.rounds = 6;
    collision.extent = extent;
  }
};

std::vector<SmokeCapsule> capsules_of(std::span<const SmokeObstacle> obstacles,
                                      const Vec3& origin) {
  std::vector<SmokeCapsule> capsules;
  for (const SmokeObstacle& obstacle : obstacles) {
    SmokeCapsule& capsule = capsules.emplace_back();
    capsule.from =
        Float4::from((obstacle.from - origin).cast<float>(), static_cast<float>(obstacle.radius));
    capsule.to = Float4::from((obstacle.to - origin).cast<float>());
  }
  return capsules;
}

Result<Case> time_passes(GpuSmoke& gpu, std::size_t count, const SmokeBenchArguments& arguments,
                         PassTimer& timer) {
  Case made;
  SmokeCase smoke(count);
  const SmokeParameters& parameters = smoke.parameters();
  const Vec3 origin = parameters.domain.min();
  SmokeParticles particles = [&] {
    SmokeVolume volume(parameters);
    smoke.fill(volume);
    return volume.particles();
  }();
  Passes passes(parameters, arguments.paper ? Laplacian::kPaper : Laplacian::kPairwise);
  const SwirlField swirl(parameters.seed, std::sqrt(3.0), parameters.eddies.wavelength,
                         parameters.eddies.period);
  const auto support = static_cast<float>(parameters.spacing);
  SurfaceCells cells;
  std::vector<SmokeFate> fates;

  Stopwatch upload;
  if (!gpu.start(particles)) return failure(gpu.trouble());
  made.seconds["hand over"].push_back(upload.seconds());
  for (int r = -kWarmUps; r < arguments.repeats; ++r) {
    const double time = kStep * (r + kWarmUps);
    const SmokeSurroundings around = smoke.around(time);
    const Stopwatch watch;
    cells.advance(around.surfaces, origin);
    timer.start();
    gpu.exchange(support, passes.viscosity);
    gpu.greatest_speed();
    passes.integration.substep = static_cast<std::uint32_t>(r + kWarmUps);
    gpu.integrate(passes.integration, swirl.waves(time), nullptr);
    const float margin = static_cast<float>(kStep) * gpu.greatest_speed() + 1e-3f;
    gpu.collide(cells, {1.0, kStep, support, margin}, capsules_of(around.obstacles, origin),
                passes.collision);
    std::map<std::string, double> seconds;
    double step = 0.0;
    for (const PassTime& pass : timer.finish()) {
      seconds[pass.name] += pass.seconds;
      step += pass.seconds;
    }
    if (!gpu.trouble().empty()) return failure(gpu.trouble());
    if (r < 0) continue;
    for (const auto& [name, taken] : seconds) made.seconds[name].push_back(taken);
    made.seconds["step"].push_back(step);
    made.seconds["step, with the CPU's share"].push_back(watch.seconds());
  }
  made.cells = gpu.grid().size.w;
  for (int r = -kWarmUps; r < std::min(arguments.repeats, 10); ++r) {
    SplatParameters splatting =
        splat_parameters(parameters.domain, 1e-3 * arguments.voxel_mm, parameters.spacing,
                         effective_viscosity(parameters));
    made.voxels = splatting.size.w;
    timer.start();
    if (!gpu.splat_here(splatting)) return failure(gpu.trouble());
    const std::vector<PassTime> splatted = timer.finish();
    if (r >= 0) made.seconds["splat"].push_back(splatted.back().seconds);
  }
  made.bytes = gpu.bytes();
  Stopwatch download;
  if (!gpu.finish(particles, fates)) return failure(gpu.trouble());
  made.seconds["take back"].push_back(download.seconds());
  return made;
}

Result<void> add_decays(GpuSmoke& gpu, Json& report) {
  std::cout << "\ndecay of a shear wave, relative error of the rate\n";
  for (const Laplacian laplacian : {Laplacian::kPairwise, Laplacian::kPaper}) {
    for (const int across : {8, 16}) {
      const std::optional<double> error = shear_decay_error(gpu, laplacian, across, 0.3, 5);
      if (!error) return failure(gpu.trouble());
      const char* name = laplacian == Laplacian::kPairwise ? "pairwise" : "paper";
      report["decay"].push_back(Json(to_json(SmokeDecay{name, 1.0 / across, *error})));
      const bool target = laplacian == Laplacian::kPairwise && across == 16;
      std::cout << fmt::format("  {:8} at 1/{:<3} of the wavelength {:7.2f} %{}\n", name, across,
                               100.0 * *error,
                               !target                    ? ""
                               : std::abs(*error) <= 0.03 ? "  (to reach 3 %: met)"
                                                          : "  (to reach 3 %: NOT met)");
    }
  }
  return {};
}

}  // namespace

Result<void> bench_smoke(const SmokeBenchArguments& arguments) {
  std::vector<std::size_t> counts;
  Error error;
  for (const std::string& text : arguments.particles) {
    const auto count = number_of_particles(text);
    if (count && *count >= 1 && *count <= kMostParticles) {
      counts.push_back(*count);
    } else {
      error.messages.push_back("--particles: found \"" + text +
                               "\", expected a number from 1 to 100M, such as 100k");
    }
  }
  if (!error.messages.empty()) return std::unexpected(error);
  const Result<BenchDevice> opened = open_bench_device(arguments.window_mb, arguments.repeats);
  if (!opened) return std::unexpected(opened.error());
  const std::string device = opened->context->device();
  const MemoryBandwidth& memory = opened->memory;
  const Stopwatch starting;
  Result<std::unique_ptr<GpuSmoke>> gpu = GpuSmoke::create();
  if (!gpu) return std::unexpected(gpu.error());
  const double start_s = starting.seconds();
  std::cout << fmt::format("start-up: kernels ready in {:.2f} s\n", start_s);

  Json report;
  report["device"] = device;
  report["software"] = opened->context->software();
  report["start_s"] = start_s;
  report["memory"] = {{"read_bytes_per_s", memory.read}, {"copy_bytes_per_s", memory.copy}};
  report["repeats"] = arguments.repeats;
  report["laplacian"] = arguments.paper ? "paper" : "pairwise";
  report["cases"] = Json::array();
  PassTimer timer;
  (*gpu)->time_with(&timer);
  for (const std::size_t count : counts) {
    const Result<Case> timed = time_passes(**gpu, count, arguments, timer);
    if (!timed) return std::unexpected(timed.error());
    std::cout << fmt::format(
        "\n{} particles in {:.0f} cells, splatted on {:.0f}; {:.1f} MB on the device\n", count,
        timed->cells, timed->voxels, 1e-6 * static_cast<double>(timed->bytes));
    for (const auto& [pass, seconds] : timed->seconds) {
      const double median = quantile(seconds, 0.5);
      const double bytes =
          least_bytes(pass, static_cast<double>(count), timed->cells, timed->voxels);
      SmokeRow row{"gpu",       device, count, pass, 1e3 * median, 1e3 * quantile(seconds, 0.99),
                   std::nullopt};
      std::string share;
      if (bytes > 0.0) {
        row.bandwidth_share = bytes / std::max(median, 1e-9) / memory.copy;
        share = fmt::format("{:6.1f} % of bandwidth", 100.0 * *row.bandwidth_share);
      }
      std::cout << fmt::format("  {:28} {:9.3f} ms (p99 {:9.3f}) {}\n", pass, 1e3 * median,
                               1e3 * quantile(seconds, 0.99), share);
      report["cases"].push_back(Json(to_json(row)));
    }
  }
  (*gpu)->time_with(nullptr);
  if (const Result<void> done = add_decays(**gpu, report); !done) return done;
  if (!arguments.json.empty()) return write_bench_json(arguments.json, report);
  return {};
}

}  // namespace viscera
