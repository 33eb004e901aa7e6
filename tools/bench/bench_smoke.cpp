#include "tools/bench/bench_smoke.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <ostream>

#include "engine/gpu/gpu_smoke.h"
#include "engine/gpu/memory_bandwidth.h"
#include "engine/io/atomic_file.h"
#include "engine/io/interrupt.h"
#include "engine/io/progress_bar.h"
#include "engine/io/report.h"
#include "engine/io/trace.h"
#include "engine/verification/shear_decay.h"
#include "engine/verification/smoke_case.h"
#include "kernels/base/stopwatch.h"
#include "kernels/smoke/gas_around.h"
#include "kernels/smoke/solid_cells.h"
#include "tools/bench/bench_smoke_picture.h"
#include "tools/bench/bench_smoke_plots.h"
#include "tools/bench/smoke_rows.h"
#include "tools/common/bench_figures.h"

namespace viscera {
namespace {

constexpr double kStep = 1.0 / 60.0;
constexpr int kWarmUps = 3;
constexpr double kVoxel = 2e-3;  // of the splatted grid, as in the main scene [m]
constexpr int kGasCells = 32;    // likewise
constexpr std::size_t kFewest = 1'000, kMost = 100'000'000;
constexpr int kMostRepeats = 100'000;
constexpr std::size_t kGpuWindow = 256'000'000;  // that the GPU's bandwidth is measured on [bytes]
/// Of a particle with the passes' arrays, and how much of the machine's memory is left to them.
constexpr double kBytesPerParticle = 400.0, kMostMemory = 0.8;
constexpr double kDecayJitter = 0.3;
constexpr std::uint64_t kDecaySeed = 5;
constexpr double kDecayToReach = 3.0;  // at a sixteenth [%]
constexpr double kPictureToReach = 0.35;

/// The passes in the order in which they stand in the table; "rest" is all that isn't one of them:
/// where surfaces went, what ended, and on the GPU the way there and back.
constexpr const char* kPasses[] = {"box",     "bin",   "viscosity", "integrate",
                                   "collide", "splat", "gas",       "rest"};

/// The seconds of a step that the gas takes: its own step, and what particles ask of it.
class TimedGas final : public SurroundingGas {
 public:
  TimedGas(GasGrid& grid, const Vec3& origin) : gas_(grid, origin) {}

  void velocity(std::span<const Float4> positions, std::span<Float4> velocities) override {
    const Stopwatch watch;
    gas_.velocity(positions, velocities);
    seconds_ += watch.seconds();
    ++substeps_;
  }
  void excess(std::span<const Float4> positions, std::span<float> kelvin) override {
    const Stopwatch watch;
    gas_.excess(positions, kelvin);
    seconds_ += watch.seconds();
  }
  double seconds() const { return seconds_; }
  int substeps() const { return substeps_; }

 private:
  GasAround gas_;
  double seconds_ = 0.0;
  int substeps_ = 0;
};

/// The passes of either backend, and what each took since start().
class Timed {
 public:
  static Result<Timed> create(const ComputeDevice& device) {
    Timed timed;
    if (device.decision.backend == Backend::kCpu) {
      timed.cpu_ = std::make_shared<CpuSmokePasses>();
      timed.passes_ = timed.cpu_;
      return timed;
    }
    const Stopwatch watch;
    device.context->make_current();
    auto gpu = GpuSmoke::create(GpuLimits::of_device(), device.context);
    if (!gpu) return std::unexpected(gpu.error());
    timed.start_s_ = watch.seconds();
    timed.gpu_ = *std::move(gpu);
    timed.passes_ = timed.gpu_;
    timed.timer_ = std::make_unique<PassTimer>();
    return timed;
  }

  const std::shared_ptr<SmokePasses>& passes() const { return passes_; }
  double start_s() const { return start_s_; }  ///< to make the kernels ready
  void start() {
    seconds_.clear();
    if (cpu_) cpu_->time_with(&seconds_);
    if (!gpu_) return;
    gpu_->time_with(timer_.get());
    timer_->start();
  }
  std::map<std::string, double> finish() {
    if (cpu_) cpu_->time_with(nullptr);
    if (gpu_) {
      for (const PassTime& pass : timer_->finish())
        seconds_[pass.name == "surface cells" ? "collide" : pass.name] += pass.seconds;
      gpu_->time_with(nullptr);
    }
    return std::move(seconds_);
  }

 private:
  Timed() = default;
  std::shared_ptr<CpuSmokePasses> cpu_;  // one of these two
  std::shared_ptr<GpuSmoke> gpu_;
  std::shared_ptr<SmokePasses> passes_;
  std::unique_ptr<PassTimer> timer_;
  std::map<std::string, double> seconds_;
  double start_s_ = 0.0;
};

/// What a case took: of each pass and "step", one value a step [ms].
struct CaseTimes {
  std::map<std::string, std::vector<double>> ms;
  double substeps = 0.0;  ///< of a step, on average
  double cells = 0.0, voxels = 0.0;
  std::size_t left = 0;  ///< particles at the end
  SmokeGrid grid;

  /// Of the steps without their splats, the median [ms].
  double without_splat() const {
    std::vector<double> rest = ms.at("step");
    const std::vector<double>& splats = ms.at("splat");
    for (std::size_t s = 0; s < rest.size(); ++s) rest[s] -= splats[s];
    return quantiles(rest).median;
  }
};

Result<GasGrid> gas_of(const SmokeCase& smoke) {
  GasParameters parameters;
  parameters.domain = smoke.parameters().domain;
  parameters.cells = kGasCells;
  if (auto sound = check_gas(parameters); !sound) return std::unexpected(sound.error());
  GasGrid gas(parameters);
  const SolidGrid grid{parameters.domain.min(), gas.spacing(), gas.cells()};
  std::vector<std::uint8_t> solid(grid.size(), 0);
  std::vector<Vec3f> corners;
  for (const Vec3& at : smoke.sheet().vertices) corners.push_back(at.cast<float>());
  mark_solid(corners, smoke.sheet().triangles, Pose{}, grid, solid);
  gas.set_solids(solid);
  gas.set_velocity([&](const Vec3& at) { return smoke.stirring(at); });
  return gas;
}

Result<CaseTimes> time_case(SmokeCase& smoke, Timed& timed, int steps, ProgressBar& bar) {
  auto gas = gas_of(smoke);
  if (!gas) return std::unexpected(gas.error());
  SmokeVolume volume(smoke.parameters());
  smoke.fill(volume);
  volume.compute_on(timed.passes());
  const std::string size = particles_text(volume.particles().size());

  CaseTimes made;
  int substeps = 0;
  for (int s = -kWarmUps; s < steps; ++s) {
    if (interrupted()) return failure(kCancelled);
    bar.update(static_cast<double>(s + kWarmUps) / (steps + kWarmUps),
               "stepping " + size + " particles");
    SmokeSurroundings around = smoke.around(kStep * (s + kWarmUps));
    TimedGas timed_gas(*gas, smoke.parameters().domain.min());
    around.gas = &timed_gas;
    const Stopwatch whole;
    timed.start();
    volume.step(kStep, around);
    const Stopwatch gas_step;
    gas->step(kStep);
    const double gas_s = gas_step.seconds();
    splat(volume, kVoxel, made.grid);
    std::map<std::string, double> seconds = timed.finish();
    const double step_s = whole.seconds();
    if (!volume.device_failure().empty()) return failure(volume.device_failure());
    if (s < 0) continue;
    seconds["gas"] = timed_gas.seconds() + gas_s;
    double rest = step_s;
    for (const auto& [pass, taken] : seconds) rest -= taken;
    seconds["rest"] = std::max(0.0, rest);
    seconds["step"] = step_s;
    for (const auto& [pass, taken] : seconds) made.ms[pass].push_back(1e3 * taken);
    substeps += timed_gas.substeps();
  }
  made.substeps = static_cast<double>(substeps) / steps;
  made.cells = smoke.parameters().domain.volume() / std::pow(smoke.parameters().spacing, 3);
  made.voxels = made.grid.size.cast<double>().prod();
  made.left = volume.particles().size();
  return made;
}

SmokeRow row_of(const std::string& pass, const std::vector<double>& ms, double bytes,
                double bandwidth) {
  const Quantiles found = quantiles(ms);
  SmokeRow row;
  row.pass = pass;
  row.median_ms = found.median;
  row.p99_ms = found.p99;
  if (bytes > 0.0 && found.median > 0.0)
    row.bandwidth_share = bytes / (1e-3 * found.median) / bandwidth;
  return row;
}

/// In the order of the table, the step last.
std::vector<SmokeRow> rows_of(const CaseTimes& times, std::size_t particles, double bandwidth) {
  std::vector<SmokeRow> rows;
  double sum = 0.0;
  for (const char* pass : kPasses) {
    const auto found = times.ms.find(pass);
    if (found == times.ms.end()) continue;
    const double bytes =
        least_bytes(pass, static_cast<double>(particles), times.cells, times.voxels);
    sum += bytes;
    rows.push_back(row_of(pass, found->second, bytes, bandwidth));
  }
  rows.push_back(row_of("step", times.ms.at("step"), sum, bandwidth));
  return rows;
}

Result<std::vector<std::size_t>> sizes_of(const SmokeBenchOptions& options) {
  Error mistakes;
  const auto expect = [&](bool right, std::string message) {
    if (!right) mistakes.messages.push_back(std::move(message));
  };
  std::vector<std::size_t> sizes;
  expect(!options.particles.empty(), "--particles: found none, expected sizes such as 10k,100k");
  const double memory = kMostMemory * static_cast<double>(this_machine().memory_bytes);
  for (const std::string& text : options.particles) {
    const std::optional<std::size_t> size = number_of_particles(text);
    if (!size || *size < kFewest || *size > kMost) {
      expect(false, fmt::format("--particles: found \"{}\", expected a whole number from {} to {}, "
                                "such as 100k",
                                text, particles_text(kFewest), particles_text(kMost)));
      continue;
    }
    const double bytes = kBytesPerParticle * static_cast<double>(*size);
    expect(bytes <= memory,
           fmt::format("--particles: found {}, which need {:.1f} GB, expected at most {:.1f} GB of "
                       "this machine's memory",
                       text, 1e-9 * bytes, 1e-9 * memory));
    if (std::find(sizes.begin(), sizes.end(), *size) == sizes.end()) sizes.push_back(*size);
  }
  expect(options.steps >= 1 && options.steps <= kMostRepeats,
         fmt::format("--steps: found {}, expected from 1 to {}", options.steps, kMostRepeats));
  expect(
      options.pictures >= 0 && options.pictures <= kMostRepeats,
      fmt::format("--pictures: found {}, expected from 0 to {}", options.pictures, kMostRepeats));
  if (!mistakes.messages.empty()) return std::unexpected(mistakes);
  std::sort(sizes.begin(), sizes.end());
  return sizes;
}

/// What a step of so many particles is to take [ms].
std::optional<double> step_to_reach(std::size_t particles, Backend backend) {
  const std::map<std::size_t, double> cpu = {{100'000, 30.0}, {1'000'000, 450.0}};
  const std::map<std::size_t, double> gpu = {{1'000'000, 1.5}, {10'000'000, 15.0}};
  const auto& known = backend == Backend::kCpu ? cpu : gpu;
  const auto found = known.find(particles);
  return found == known.end() ? std::nullopt : std::optional(found->second);
}

void print_case(const std::vector<SmokeRow>& rows, const CaseTimes& times, std::ostream& out) {
  const SmokeRow& step = rows.back();
  out << fmt::format("\n{:<26}{:>10}{:>13}{:>10}{:>16}\n",
                     particles_text(step.particles) + " particles", "median", "p99", "of step",
                     "of bandwidth");
  for (const SmokeRow& row : rows) {
    const std::string share =
        row.bandwidth_share ? fmt::format("{:.1f} %", 100.0 * *row.bandwidth_share) : "-";
    out << fmt::format("  {:<22}{:>9.3f} ms{:>10.3f} ms{:>8.1f} %{:>16}\n", row.pass, row.median_ms,
                       row.p99_ms, 100.0 * row.median_ms / step.median_ms, share);
  }
  const double without = times.without_splat();
  out << fmt::format(
      "  \"step\" is all rows above once, the splat and the gas's own step too. A run "
      "splats for pictures only:\n  without it a step takes {:.3f} ms, with a picture "
      "every second step {:.3f} ms on average\n",
      without, 0.5 * (without + step.median_ms));
  if (times.substeps > 1.0) out << fmt::format("  {:.2f} substeps a step\n", times.substeps);
}

Result<std::vector<SmokeDecay>> measure_decays(SmokePasses& passes) {
  std::vector<SmokeDecay> decays;
  for (const Laplacian laplacian : {Laplacian::kPairwise, Laplacian::kPaper}) {
    for (const int across : {8, 16, 24}) {
      if (interrupted()) return failure(kCancelled);
      const auto error = shear_decay_error(passes, laplacian, across, kDecayJitter, kDecaySeed);
      if (!error) return failure(passes.trouble());
      decays.push_back(
          {laplacian == Laplacian::kPairwise ? "pairwise" : "paper", 1.0 / across, *error});
    }
  }
  return decays;
}

void print_decays(const std::vector<SmokeDecay>& decays, std::ostream& out) {
  out << fmt::format("\n{:<28}{:>10}{:>10}{:>10}\n", "decay of a shear wave, error", "1/8", "1/16",
                     "1/24");
  for (std::size_t i = 0; i < decays.size(); i += 3)
    out << fmt::format("  {:<26}{:>8.2f} %{:>8.2f} %{:>8.2f} %\n", decays[i].laplacian,
                       100.0 * decays[i].error, 100.0 * decays[i + 1].error,
                       100.0 * decays[i + 2].error);
}

/// In this run [bytes/s].
Result<double> bandwidth_of(const ComputeDevice& device) {
  if (device.decision.backend == Backend::kCpu) return read_bandwidth();
  device.context->make_current();
  const auto found = measure_memory_bandwidth(kGpuWindow, kGpuWindow, 9);
  if (!found) return std::unexpected(found.error());
  return found->copy;  // passes write as much as they read
}

class SmokeBench {
 public:
  SmokeBench(const SmokeBenchOptions& options, ComputeDevice device, std::ostream& out)
      : options_(options), device_(std::move(device)), out_(out) {
    backend_ = name_of(device_.decision.backend);
    name_ = on_cpu() ? this_machine().cpu : device_.context->device();
    hardware_ = on_cpu() || !device_.context->software();
  }

  Result<void> run(const std::vector<std::size_t>& sizes) {
    auto timed = Timed::create(device_);
    if (!timed) return std::unexpected(timed.error());
    auto bandwidth = bandwidth_of(device_);
    if (!bandwidth) return std::unexpected(bandwidth.error());
    bandwidth_ = *bandwidth;
    if (!device_.decision.warning.empty()) out_ << "warning: " << device_.decision.warning << '\n';
    out_ << fmt::format("smoke on the {}: {}, {} cores, memory at {:.1f} GB/s\n", backend_, name_,
                        this_machine().cores, 1e-9 * bandwidth_);
    if (!on_cpu()) {
      start_s_ = device_.start_s + timed->start_s();
      out_ << fmt::format("start-up: context and kernels ready in {:.2f} s\n", start_s_);
    }
    open_pictures();
    for (const std::size_t size : sizes)
      if (auto done = run_case(size, *timed); !done) return done;
    auto decays = measure_decays(*timed->passes());
    if (!decays) return std::unexpected(decays.error());
    decays_ = *std::move(decays);
    print_decays(decays_, out_);
    add_decay_target();
    out_ << '\n';
    print_rows(targets_, "smoke", out_);
    return write();
  }

 private:
  bool on_cpu() const { return device_.decision.backend == Backend::kCpu; }

  void open_pictures() {
    if (options_.pictures == 0) {
      no_pictures_ = "--pictures 0";
      return;
    }
    auto made = SmokePictures::create(device_.context);
    if (made) {
      pictures_.emplace(*std::move(made));
      return;
    }
    no_pictures_ = made.error().text();
    out_ << "no pictures: " << no_pictures_ << '\n';
  }

  Result<void> run_case(std::size_t size, Timed& timed) {
    SmokeCase smoke(size);
    std::optional<CaseTimes> times;
    std::optional<SmokePictureTimes> picture;
    {
      ProgressBar bar("smoke");
      auto found = time_case(smoke, timed, options_.steps, bar);
      if (!found) return std::unexpected(found.error());
      times = *std::move(found);
      if (pictures_) {
        bar.update(1.0, "drawing");
        auto drawn = pictures_->time(smoke, times->grid, options_.pictures);
        if (!drawn) return std::unexpected(drawn.error());
        picture = *drawn;
      }
    }
    std::vector<SmokeRow> rows = rows_of(*times, size, bandwidth_);
    for (SmokeRow& row : rows) {
      row.backend = backend_;
      row.device = name_;
      row.particles = size;
    }
    print_case(rows, *times, out_);
    const double step_ms = rows.back().median_ms;
    if (const auto target = step_to_reach(size, device_.decision.backend)) {
      targets_.push_back({particles_text(size) + " particles: a step, all passes", "ms",
                          hardware_ ? std::optional(step_ms) : std::nullopt, *target});
      if (!hardware_) targets_.back().dropped = {"a driver in software says nothing of a GPU"};
    }
    if (picture)
      add_picture(size, step_ms, *picture);
    else if (options_.pictures > 0)
      targets_.push_back(
          {picture_row(size), "s", std::nullopt, kPictureToReach, false, {no_pictures_}});
    for (SmokeRow& row : rows) rows_.push_back(std::move(row));
    return {};
  }

  void add_picture(std::size_t size, double step_ms, const SmokePictureTimes& picture) {
    const double per_second = 1e3 / (step_ms + picture.median_ms);
    out_ << fmt::format(
        "  {:<22}{:>9.3f} ms{:>10.3f} ms: {:.1f} frames a second, a step and a "
        "picture each ({})\n",
        "picture", picture.median_ms, picture.p99_ms, per_second, pictures_->device());
    rendering_.push_back({{"backend", backend_},
                          {"device", pictures_->device()},
                          {"particles", size},
                          {"width", SmokePictures::kWidth},
                          {"height", SmokePictures::kHeight},
                          {"quality", name_of(Quality::kReview)},
                          {"picture_median_ms", picture.median_ms},
                          {"picture_p99_ms", picture.p99_ms},
                          {"frames_per_second", per_second}});
    targets_.push_back({picture_row(size), "s", 1e-3 * picture.median_ms, kPictureToReach});
  }

  static std::string picture_row(std::size_t size) {
    return particles_text(size) + " particles: a picture full of them, 1280x720";
  }

  void add_decay_target() {
    for (const SmokeDecay& decay : decays_)
      if (decay.laplacian == "pairwise" && decay.spacing_over_wavelength == 1.0 / 16.0)
        targets_.push_back({"decay of a shear wave, spacing 1/16, default Laplacian", "%",
                            100.0 * std::abs(decay.error), kDecayToReach});
  }

  Result<void> write() const {
    if (!options_.plots.empty())
      if (auto drawn = draw_smoke_plots(rows_, decays_, options_.plots); !drawn) return drawn;
    if (options_.json.empty()) return {};
    const MachineReport machine = this_machine();
    nlohmann::json json = {
        {"machine",
         {{"cpu", machine.cpu}, {"cores", machine.cores}, {"memory_bytes", machine.memory_bytes}}},
        {"memory_bytes_per_s", bandwidth_},
        {"start_s", start_s_},
        {"step_includes", "every pass once, the splat and the gas's own step too"},
        {"steps", options_.steps},
        {"cases", nlohmann::json::array()},
        {"decay", nlohmann::json::array()},
        {"rendering", rendering_},
        {"targets", to_json(targets_)}};
    for (const SmokeRow& row : rows_) json["cases"].push_back(to_json(row));
    for (const SmokeDecay& decay : decays_) json["decay"].push_back(to_json(decay));
    if (!no_pictures_.empty()) json["no_rendering"] = no_pictures_;
    return write_file(options_.json, json.dump(2) + "\n");
  }

  const SmokeBenchOptions& options_;
  ComputeDevice device_;
  std::ostream& out_;
  std::string backend_, name_;
  bool hardware_ = true;  // else no target applies
  double bandwidth_ = 0.0, start_s_ = 0.0;
  std::optional<SmokePictures> pictures_;
  std::string no_pictures_;  // why
  std::vector<SmokeRow> rows_;
  std::vector<SmokeDecay> decays_;
  std::vector<BenchRow> targets_;
  nlohmann::json rendering_ = nlohmann::json::array();
};

}  // namespace

Result<void> bench_smoke(const SmokeBenchOptions& options, std::ostream& out) {
  const auto sizes = sizes_of(options);
  if (!sizes) return std::unexpected(sizes.error());
  if (auto writable = check_outputs({options.json}, options.plots); !writable) return writable;
  auto device = open_compute_device(options.backend, false);
  if (!device) return std::unexpected(device.error());
  return SmokeBench(options, *std::move(device), out).run(*sizes);
}

}  // namespace viscera
