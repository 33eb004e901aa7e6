// The `viscera_gpu_finite_bench` program: what a quasi-Newton step of tissue at finite strain asks
// for most, on this machine's GPU and on its CPU, with the difference. Beside the libraries of
// `viscera_gpu_bench` it needs those that factor.
#include <fmt/format.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/info.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <functional>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>

#include "engine/gpu/gpu_finite.h"
#include "engine/gpu/pass_timer.h"
#include "engine/verification/lifted_body.h"
#include "kernels/base/stopwatch.h"
#include "tools/gpu_bench/gpu_bench_device.h"

namespace viscera {
namespace {

using Json = nlohmann::ordered_json;

struct Arguments {
  std::vector<double> spacings_mm = {4.0, 3.17, 2.5};  // of a gallbladder's nodes, a case each
  int repeats = 200;
  int window_mb = 256;
  std::string json;
};

constexpr int kWarmUps = 10;
constexpr double kLift = 20e-3, kLiftTime = 0.5;  // [m], [s]
constexpr std::size_t kColumnsAtOnce = 64;

double median(std::vector<double> seconds) {
  std::sort(seconds.begin(), seconds.end());
  return seconds[seconds.size() / 2];
}

double median_of(int repeats, const std::function<void()>& what) {
  std::vector<double> seconds;
  for (int i = -kWarmUps; i < repeats; ++i) {
    const Stopwatch watch;
    what();
    if (i >= 0) seconds.push_back(watch.seconds());
  }
  return median(seconds);
}

double relative_distance(std::span<const double> x, std::span<const double> y) {
  double apart = 0.0, size = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    apart += (x[i] - y[i]) * (x[i] - y[i]);
    size += y[i] * y[i];
  }
  return std::sqrt(apart / size);
}

/// What preconditions a body, unturned, as a dense matrix over its greatest entry, and that.
std::pair<std::vector<float>, double> dense_inverse(const FiniteSolver& solver) {
  const std::size_t nodes = solver.body().nodes(), n = 3 * nodes;
  const NodalRotations unturned = no_rotations(nodes);
  std::vector<float> columns(n * n);
  std::vector<double> unit, answer;
  for (std::size_t first = 0; first < n; first += kColumnsAtOnce) {
    const std::size_t count = std::min(kColumnsAtOnce, n - first);
    unit.assign(n * count, 0.0);
    answer.assign(n * count, 0.0);
    for (std::size_t c = 0; c < count; ++c) unit[n * c + first + c] = 1.0;
    solver.precondition(unturned, unit, answer);
    std::transform(answer.begin(), answer.end(),
                   columns.begin() + static_cast<std::ptrdiff_t>(n * first),
                   [](double value) { return static_cast<float>(value); });
  }
  float most = 0.0f;
  for (const float value : columns) most = std::max(most, std::abs(value));
  for (float& value : columns) value /= most;
  return {std::move(columns), static_cast<double>(most)};
}

Result<Json> time_case(double spacing, const Arguments& arguments) {
  LiftedBodyOptions options;
  options.spacing = spacing;
  const auto lifted_body = LiftedBody::prepare(options);
  if (!lifted_body) return std::unexpected(lifted_body.error());
  const FiniteSolver& solver = (*lifted_body)->solver();
  const FiniteBody& body = solver.body();
  FiniteState state = solver.at_rest();
  FiniteStep step;
  std::vector<double> before;
  for (int frame = 1; frame <= static_cast<int>(kLiftTime / options.solver.time_step); ++frame) {
    before = state.displacements;
    GripTouch grip =
        (*lifted_body)->held_at(lifted(frame * options.solver.time_step, kLift, kLiftTime), step);
    step = solver.step(grip, state);
  }
  const std::vector<double>& u = state.displacements;
  const Strains strains = body.strains(before);
  const Viscosity viscosity{options.solver.viscous_time / options.solver.time_step, strains};

  auto gpu = GpuFiniteBody::create(body, GpuLimits::of_device());
  if (!gpu) return std::unexpected(gpu.error());
  (*gpu)->set({}, viscosity);
  std::vector<double> on_cpu(u.size(), 0.0), on_gpu(u.size(), 0.0);
  FiniteBody::Workspace workspace;
  const double energy = body.energy(u, on_cpu, workspace, viscosity);
  const auto found = (*gpu)->energy(u, on_gpu);
  if (!found) return std::unexpected(found.error());
  const double energy_error = std::abs(*found + body.hold_energy(u, on_gpu) - energy) / energy;
  const double force_error = relative_distance(on_gpu, on_cpu);

  std::vector<double> work(u.size());
  const auto cpu_energy = [&] { body.energy(u, work, workspace, viscosity); };
  const auto [columns, scale] = dense_inverse(solver);
  auto inverse = GpuInverse::create(columns, u.size(), GpuLimits::of_device());
  if (!inverse) return std::unexpected(inverse.error());
  const NodalRotations unturned = no_rotations(body.nodes());
  std::vector<double> z(u.size()), z_gpu(u.size());
  const auto cpu_solve = [&] { solver.precondition(unturned, on_cpu, z); };
  cpu_solve();
  if (const auto done = (*inverse)->apply(on_cpu, z_gpu); !done)
    return std::unexpected(done.error());
  for (double& value : z_gpu) value *= scale;
  const double solve_error = relative_distance(z_gpu, z);

  Json row = {{"case", fmt::format("gallbladder_{}", body.nodes())},
              {"nodes", body.nodes()},
              {"points", body.points()},
              {"cells", body.cells()},
              {"device_bytes", (*gpu)->bytes() + (*inverse)->bytes()},
              {"energy_error", energy_error},
              {"force_error", force_error},
              {"solve_error", solve_error}};
  row["cpu_energy_ms"] = 1e3 * median_of(arguments.repeats, cpu_energy);
  row["cpu_solve_ms"] = 1e3 * median_of(arguments.repeats, cpu_solve);
  {
    const oneapi::tbb::global_control two(oneapi::tbb::global_control::max_allowed_parallelism, 2);
    row["two_cores_energy_ms"] = 1e3 * median_of(arguments.repeats, cpu_energy);
    row["two_cores_solve_ms"] = 1e3 * median_of(arguments.repeats, cpu_solve);
  }
  row["gpu_energy_ms"] = 1e3 * median_of(arguments.repeats, [&] { (void)(*gpu)->energy(u, work); });
  row["gpu_solve_ms"] =
      1e3 * median_of(arguments.repeats, [&] { (void)(*inverse)->apply(on_cpu, z_gpu); });
  PassTimer timer;
  (*gpu)->time_with(&timer);
  std::map<std::string, std::vector<double>> passes;
  for (int i = 0; i < arguments.repeats; ++i) {
    timer.start();
    (void)(*gpu)->energy(u, work);
    for (const PassTime& pass : timer.finish()) passes[pass.name].push_back(pass.seconds);
  }
  for (const auto& [name, seconds] : passes) row["gpu_passes_ms"][name] = 1e3 * median(seconds);
  return row;
}

/// Prints a table and writes the JSON file, if one is named.
Result<void> bench(const Arguments& arguments) {
  const Result<BenchDevice> opened = open_bench_device(arguments.window_mb, arguments.repeats);
  if (!opened) return std::unexpected(opened.error());
  Json report;
  report["device"] = opened->context->device();
  report["software"] = opened->context->software();
  report["threads"] = oneapi::tbb::info::default_concurrency();
  report["repeats"] = arguments.repeats;
  report["cases"] = Json::array();
  for (const double spacing : arguments.spacings_mm) {
    const Result<Json> row = time_case(1e-3 * spacing, arguments);
    if (!row) return std::unexpected(row.error());
    const auto number = [&](const char* name) { return (*row)[name].get<double>(); };
    std::cout << fmt::format(
        "\ngallbladder lifted by 20 mm, {} nodes, {} points in {} cells; {:.1f} MB on the device\n"
        "  energy and forces: GPU {:.3f} ms there and back; {} cores {:.3f}, two {:.3f} ms\n"
        "    error {:.1e} of the energy, {:.1e} of the forces\n"
        "  what the factor answers: GPU {:.3f} ms there and back; {} cores {:.3f}, two {:.3f} ms\n"
        "    apart by {:.1e}, in half precision\n",
        (*row)["nodes"].get<int>(), (*row)["points"].get<int>(), (*row)["cells"].get<int>(),
        1e-6 * number("device_bytes"), number("gpu_energy_ms"), report["threads"].get<int>(),
        number("cpu_energy_ms"), number("two_cores_energy_ms"), number("energy_error"),
        number("force_error"), number("gpu_solve_ms"), report["threads"].get<int>(),
        number("cpu_solve_ms"), number("two_cores_solve_ms"), number("solve_error"));
    for (const auto& [name, ms] : (*row)["gpu_passes_ms"].items())
      std::cout << fmt::format("    {:10} {:.4f} ms\n", name, ms.get<double>());
    report["cases"].push_back(*row);
  }
  if (!arguments.json.empty()) return write_bench_json(arguments.json, report);
  return {};
}

}  // namespace
}  // namespace viscera

int main(int argc, char** argv) {
  viscera::Arguments arguments;
  CLI::App app("Speed and error of tissue at finite strain on this machine's GPU.");
  app.add_option("--spacings-mm", arguments.spacings_mm,
                 "of a gallbladder's nodes, a case each: 4,3.17,2.5")
      ->delimiter(',')
      ->check(CLI::Range(2.0, 10.0));
  app.add_option("--repeats", arguments.repeats, "timed evaluations a case")
      ->check(CLI::Range(1, 100'000));
  app.add_option("--window-mb", arguments.window_mb, "memory that bandwidth is measured on")
      ->check(CLI::Range(1, 100'000));
  app.add_option("--json", arguments.json, "file for the figures");
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    app.exit(error);
    return 2;
  }
  const viscera::Result<void> done = viscera::bench(arguments);
  if (done) return 0;
  std::cerr << done.error().text() << '\n';
  return 2;
}
