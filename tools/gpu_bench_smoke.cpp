#include "tools/gpu_bench_smoke.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "engine/gpu/egl_context.h"
#include "engine/gpu/gpu_smoke.h"
#include "engine/gpu/memory_bandwidth.h"
#include "engine/verification/bodies.h"
#include "engine/verification/shear_decay.h"
#include "kernels/base/random.h"
#include "kernels/base/stopwatch.h"
#include "kernels/smoke/swirl.h"
#include "kernels/smoke/viscosity.h"
#include "tools/smoke_rows.h"

namespace viscera {
namespace {

using Json = nlohmann::ordered_json;

constexpr float kSupport = 3e-3f;        // [m]
constexpr double kViscosity = 1.375e-5;  // [m2/s]
constexpr double kStep = 1.0 / 60.0;
constexpr int kWarmUps = 3;
constexpr std::size_t kMostParticles = 100'000'000;

/// A cube full of smoke at half the support radius, jittered, with eddies of a few centimetres.
SmokeParticles full_cube(std::size_t count, double& edge) {
  const auto across = static_cast<std::size_t>(std::ceil(std::cbrt(static_cast<double>(count))));
  const double spacing = 0.5 * kSupport;
  edge = spacing * static_cast<double>(across);
  SmokeParticles particles;
  particles.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Random random(4, i);
    const Vec3 lattice(static_cast<double>(i % across), static_cast<double>(i / across % across),
                       static_cast<double>(i / across / across));
    Vec3 at = lattice + Vec3(random.uniform(0), random.uniform(1), random.uniform(2));
    at *= spacing;
    const Vec3 velocity =
        0.05 * Vec3(std::sin(200.0 * at.y()), std::sin(200.0 * at.z()), std::sin(200.0 * at.x()));
    particles.positions[i] = Float4::from(at.cast<float>(), 20.0f);
    particles.velocities[i] =
        Float4::from(velocity.cast<float>(), static_cast<float>(random.uniform(3)));
    particles.masses[i] = 1e-9f;
    particles.ids[i] = static_cast<std::uint32_t>(i);
  }
  return particles;
}

/// Half a ball amid the smoke, that grows and shrinks.
class HalfBall {
 public:
  HalfBall() : shape_(ringed_hemisphere(1.0, 14)), topology_(triangles(shape_)) {}
  void advance(SurfaceCells& cells, double edge, int step) {
    const double radius = 0.2 * edge * (1.0 + 0.01 * (step % 2));
    corners_.clear();
    for (const Vec3& at : shape_.vertices) corners_.push_back((radius * at).cast<float>());
    const SmokeSurface surface = {1, &topology_, corners_,
                                  Pose{Vec3::Constant(0.4 * edge), Quaternion::Identity()}};
    cells.advance({&surface, 1}, Vec3::Zero());
  }

 private:
  static std::vector<SurfaceTopology::Triangle> triangles(const TriangleSurface& shape) {
    std::vector<SurfaceTopology::Triangle> made;
    for (const auto& t : shape.triangles) made.emplace_back(t[0], t[1], t[2]);
    return made;
  }
  TriangleSurface shape_;
  SurfaceTopology topology_;
  std::vector<Vec3f> corners_;
};

double quantile(std::vector<double> values, double q) {
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1) + 0.5)];
}

struct Case {
  std::map<std::string, std::vector<double>> seconds;  // of each pass, and "step"
  double edge = 0.0, cells = 0.0, voxels = 0.0;
  std::size_t bytes = 0;
};

Result<Case> time_passes(GpuSmoke& gpu, std::size_t count, const SmokeBenchArguments& arguments,
                         PassTimer& timer) {
  Case made;
  SmokeParticles particles = full_cube(count, made.edge);
  const auto edge = static_cast<float>(made.edge);
  ViscosityParameters viscosity;
  viscosity.inverse_square = 1.0f / (kSupport * kSupport);
  viscosity.viscosity = static_cast<float>(kViscosity);
  viscosity.crowding = 2e-4f;
  viscosity.fill = 0.196f;
  viscosity.most_excess = 4.0f;
  viscosity.gas_drag = static_cast<float>(18.0 * kViscosity / (kSupport * kSupport));
  viscosity.fewest_neighbours = 4;
  viscosity.laplacian = arguments.paper ? Laplacian::paper : Laplacian::pairwise;
  viscosity.step = static_cast<float>(kStep);
  IntegrateParameters integration;
  integration.extent = {edge, edge, edge, 0.2f};
  integration.step = static_cast<float>(kStep);
  integration.white = 0.15f;
  integration.cooling = 1.0f;
  integration.parcel_mass = 6e-9f;
  integration.entrainment = 20.0f;
  CollideParameters collision;
  collision.gap = 2e-4f;
  collision.friction = 0.2f;
  collision.touch = 7.5e-4f;
  collision.kept = 0.999f;
  collision.rounds = 6;
  collision.extent = {edge, edge, edge, 0.0f};
  std::vector<SmokeCapsule> capsules(2);
  for (SmokeCapsule& capsule : capsules) {
    capsule.from = {0.5f * edge, 0.5f * edge, 0.75f * edge, 2.5e-3f};
    capsule.to = {&capsule == &capsules[0] ? 0.0f : edge, 0.0f, edge, 0.0f};
  }
  const SwirlField swirl(3, 1.0, 20e-3, 0.6);
  HalfBall ball;
  SurfaceCells cells;
  std::vector<SmokeFate> fates;

  Stopwatch upload;
  if (!gpu.start(particles)) return failure(gpu.trouble());
  made.seconds["hand over"].push_back(upload.seconds());
  for (int r = -kWarmUps; r < arguments.repeats; ++r) {
    const Stopwatch watch;
    ball.advance(cells, made.edge, r + kWarmUps);
    timer.start();
    gpu.exchange(kSupport, viscosity);
    gpu.greatest_speed();
    integration.substep = static_cast<std::uint32_t>(r + kWarmUps);
    gpu.integrate(integration, swirl.waves(kStep * (r + kWarmUps)), nullptr);
    const float margin = static_cast<float>(kStep) * gpu.greatest_speed() + 1e-3f;
    gpu.collide(cells, {1.0, kStep, kSupport, margin}, capsules, collision);
    std::map<std::string, double> passes;
    double step = 0.0;
    for (const PassTime& pass : timer.finish()) {
      passes[pass.name] += pass.seconds;
      step += pass.seconds;
    }
    if (!gpu.trouble().empty()) return failure(gpu.trouble());
    if (r < 0) continue;
    for (const auto& [name, seconds] : passes) made.seconds[name].push_back(seconds);
    made.seconds["step"].push_back(step);
    made.seconds["step, with the CPU's share"].push_back(watch.seconds());
  }
  made.cells = gpu.grid().size.w;
  for (int r = -kWarmUps; r < std::min(arguments.repeats, 10); ++r) {
    SplatParameters splatting = splat_parameters(Box(Vec3::Zero(), Vec3::Constant(made.edge)),
                                                 1e-3 * arguments.voxel_mm, kSupport, kViscosity);
    made.voxels = splatting.size.w;
    timer.start();
    if (!gpu.splat_here(splatting)) return failure(gpu.trouble());
    const std::vector<PassTime> passes = timer.finish();
    if (r >= 0) made.seconds["splat"].push_back(passes.back().seconds);
  }
  made.bytes = gpu.bytes();
  Stopwatch download;
  if (!gpu.finish(particles, fates)) return failure(gpu.trouble());
  made.seconds["take back"].push_back(download.seconds());
  return made;
}

Result<void> write_json(const std::filesystem::path& path, const Json& report) {
  std::filesystem::path temporary = path;
  temporary += ".tmp";
  std::ofstream file(temporary);
  file << report.dump(2) << '\n';
  file.close();
  std::error_code error;
  if (file) std::filesystem::rename(temporary, path, error);
  if (!file || error) return failure(path.string() + ": can't be written");
  return {};
}

Result<void> add_decays(GpuSmoke& gpu, Json& report) {
  std::cout << "\ndecay of a shear wave, relative error of the rate\n";
  for (const Laplacian laplacian : {Laplacian::pairwise, Laplacian::paper}) {
    for (const int across : {8, 16}) {
      const std::optional<double> error = shear_decay_error(gpu, laplacian, across, 0.3, 5);
      if (!error) return failure(gpu.trouble());
      const char* name = laplacian == Laplacian::pairwise ? "pairwise" : "paper";
      report["decay"].push_back(Json(to_json(SmokeDecay{name, 1.0 / across, *error})));
      const bool target = laplacian == Laplacian::pairwise && across == 16;
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
  const Result<std::unique_ptr<EglContext>> context = EglContext::create();
  if (!context) return std::unexpected(context.error());
  const std::string device = (*context)->device();
  const bool software = (*context)->software();
  std::cout << "device: " << device
            << (software ? " (a software driver: figures say nothing of a GPU)" : "") << '\n';
  const std::size_t window = static_cast<std::size_t>(arguments.window_mb) * 1'000'000;
  const Result<MemoryBandwidth> memory =
      measure_memory_bandwidth(window, window, std::min(arguments.repeats, 20));
  if (!memory) return std::unexpected(memory.error());
  std::cout << fmt::format("memory: reads {:.1f} GB/s, copies {:.1f} GB/s\n", 1e-9 * memory->read,
                           1e-9 * memory->copy);
  const Stopwatch starting;
  Result<std::unique_ptr<GpuSmoke>> gpu = GpuSmoke::create();
  if (!gpu) return std::unexpected(gpu.error());
  const double start_s = starting.seconds();
  std::cout << fmt::format("kernels ready in {:.2f} s\n", start_s);

  Json report;
  report["device"] = device;
  report["software"] = software;
  report["start_s"] = start_s;
  report["memory"] = {{"read_bytes_per_s", memory->read}, {"copy_bytes_per_s", memory->copy}};
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
      SmokeRow row{"gpu",        device, count, pass, 1e3 * median, 1e3 * quantile(seconds, 0.99),
                   std::nullopt};
      std::string share;
      if (bytes > 0.0) {
        row.bandwidth_share = bytes / std::max(median, 1e-9) / memory->copy;
        share = fmt::format("{:6.1f} % of bandwidth", 100.0 * *row.bandwidth_share);
      }
      std::cout << fmt::format("  {:28} {:9.3f} ms (p99 {:9.3f}) {}\n", pass, 1e3 * median,
                               1e3 * quantile(seconds, 0.99), share);
      report["cases"].push_back(Json(to_json(row)));
    }
  }
  (*gpu)->time_with(nullptr);
  if (const Result<void> done = add_decays(**gpu, report); !done) return done;
  if (!arguments.json.empty()) return write_json(arguments.json, report);
  return {};
}

}  // namespace viscera
