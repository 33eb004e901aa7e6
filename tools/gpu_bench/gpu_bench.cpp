// The `viscera_gpu_bench` program: how fast this machine's GPU moves organs, beside what its memory
// gives and beside the error against the CPU. Needs neither scenes nor prepared organs, and few
// libraries, so that it can be carried to a machine with a GPU.
#include <fmt/format.h>
#include <oneapi/tbb/info.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "engine/gpu/gpu_deformation.h"
#include "engine/verification/ring_organ.h"
#include "kernels/base/stopwatch.h"
#include "tools/gpu_bench/gpu_bench_device.h"
#include "tools/gpu_bench/gpu_bench_heat.h"
#include "tools/gpu_bench/gpu_bench_smoke.h"

namespace viscera {
namespace {

using Json = nlohmann::ordered_json;

/// Of the device's memory bandwidth, for the compliance product of 20,000 places.
constexpr double kShareToReach = 0.7;
constexpr int kWarmUps = 5;

struct Arguments {
  int places = 20000, vertices = 40000, touchable = 600, touched = 60;
  std::vector<int> organs = {1, 8};
  int repeats = 100;
  int window_mb = 1000;
  bool half = false;
  std::string json;
};

struct Times {
  std::vector<double> seconds;
  double quantile(double q) const {
    std::vector<double> sorted = seconds;
    std::sort(sorted.begin(), sorted.end());
    const auto last = static_cast<double>(sorted.size() - 1);
    return sorted[static_cast<std::size_t>(q * last + 0.5)];
  }
  double median() const { return quantile(0.5); }
  Json json() const {
    return {{"median_us", 1e6 * median()},
            {"p99_us", 1e6 * quantile(0.99)},
            {"max_us", 1e6 * quantile(1.0)}};
  }
};

/// A grid of about `count` points on a ring, three times as many around it as across.
std::pair<int, int> grid_of(int count) {
  const int across = std::max(3, static_cast<int>(std::lround(std::sqrt(count / 3.0))));
  return {std::max(3, (count + across - 1) / across), across};
}

std::unique_ptr<RingOrgan> make_organ(const Arguments& arguments) {
  RingSize size;
  std::tie(size.places_around, size.places_across) = grid_of(arguments.places);
  std::tie(size.vertices_around, size.vertices_across) = grid_of(arguments.vertices);
  size.touchable = arguments.touchable;
  return make_ring_organ(size);
}

/// By columns in half precision where there are some.
void place(const RingOrgan& organ, const HalfColumns* half, const ContactResponse& response,
           std::vector<float>& displacements) {
  if (half != nullptr) {
    place_displacements(*half, response, displacements);
  } else {
    place_displacements(organ.compliance, response, displacements);
  }
}

/// A tip of 19 cells on one organ, and the loads that it puts on places.
struct Press {
  ContactResponse response;
  std::vector<ContactCell> cells;
  std::vector<NearField> near_fields;
  std::vector<Vec3> forces;
  std::vector<int> near_vertices;
  std::vector<Vec3f> near_field;

  GpuLoads on(std::size_t organ) const {
    return {organ, response.touched, response.loads, near_vertices, near_field};
  }
};

/// The `set`-th patch of touchable places: another patch for every organ and frame, so that a frame
/// reads columns that no cache holds from the frame before.
Press press(const RingOrgan& organ, const Arguments& arguments, int set) {
  Press made;
  const int sets = std::max(arguments.touchable / arguments.touched, 1);
  const int first = set % sets * arguments.touched;
  for (int j = 0; j < arguments.touched; ++j) {
    const int touchable = first + j;
    const auto place =
        static_cast<std::size_t>(organ.compliance.touchable[static_cast<std::size_t>(touchable)]);
    made.response.touched.push_back(touchable);
    made.response.loads.push_back(-0.05 / arguments.touched * organ.places.normals[place]);
  }
  const std::size_t vertices = organ.surface.vertices.size();
  const auto start =
      static_cast<std::size_t>(set % sets) * (vertices / static_cast<std::size_t>(sets));
  for (std::size_t k = 0; k < 19; ++k) {
    const std::size_t at = (start + k) % vertices;
    ContactCell cell;
    cell.position = organ.surface.vertices[at];
    cell.normal = organ.drawn.rest_normals[at];
    cell.area = 1e-7;
    made.cells.push_back(cell);
    made.near_fields.emplace_back(IsotropicMaterial{5e3, 0.45}, 2e-3);
    made.forces.push_back(-0.002 * cell.normal);
  }
  near_field_on_surface(organ.drawn, made.near_fields, made.cells, made.forces, made.near_vertices,
                        made.near_field);
  return made;
}

/// Greatest differences between the GPU's answer and the CPU's.
struct Difference {
  double displacement = 0.0;  // over the greatest displacement
  double position = 0.0;      // [m]
  double normal = 0.0;        // [rad]

  void add(const RingOrgan& organ, const HalfColumns* half, const Press& load,
           const GpuDeformation& gpu, std::size_t index) {
    std::vector<float> u;
    std::vector<Vec3f> positions, normals;
    place(organ, half, load.response, u);
    deform_drawn_surface(organ.drawn, u, load.near_fields, load.cells, load.forces, positions,
                         normals);
    const std::vector<float> gpu_u = gpu.read_displacements(index);
    const std::vector<Vec3f> gpu_positions = gpu.read_positions(index);
    const std::vector<Vec3f> gpu_normals = gpu.read_normals(index);
    double greatest = 0.0, apart = 0.0;
    for (std::size_t i = 0; i < u.size(); ++i) {
      greatest = std::max(greatest, std::abs(static_cast<double>(u[i])));
      apart = worse(apart, std::abs(static_cast<double>(gpu_u[i]) - u[i]));
    }
    displacement = worse(displacement, apart / greatest);
    for (std::size_t v = 0; v < positions.size(); ++v) {
      position = worse(position, (gpu_positions[v] - positions[v]).cast<double>().norm());
      normal = worse(normal, (gpu_normals[v] - normals[v]).cast<double>().norm());
    }
  }

 private:
  /// The greater one; what isn't finite is worst.
  static double worse(double a, double b) { return b <= a ? a : b; }
};

/// The same work by the CPU kernels, all its threads.
Json cpu_times(const RingOrgan& organ, const HalfColumns* half, const Arguments& arguments,
               int organs) {
  Times product, surface, near;
  std::vector<float> u;
  std::vector<Vec3f> positions, normals;
  int set = 0;
  for (int r = 0; r < 9; ++r) {
    double product_s = 0.0, surface_s = 0.0, near_s = 0.0;
    for (int o = 0; o < organs; ++o) {
      Press load = press(organ, arguments, set++);
      const Stopwatch start;
      place(organ, half, load.response, u);
      const double multiplied = start.seconds();
      deform_drawn_surface(organ.drawn, u, load.near_fields, load.cells, load.forces, positions,
                           normals);
      const double moved = start.seconds();
      near_field_on_surface(organ.drawn, load.near_fields, load.cells, load.forces,
                            load.near_vertices, load.near_field);
      product_s += multiplied;
      surface_s += moved - multiplied;
      near_s += start.seconds() - moved;
    }
    product.seconds.push_back(product_s);
    surface.seconds.push_back(surface_s);
    near.seconds.push_back(near_s);
  }
  return {{"threads", oneapi::tbb::info::default_concurrency()},
          {"product_us", 1e6 * product.median()},
          {"surface_us", 1e6 * surface.median()},
          {"near_field_us", 1e6 * near.median()}};
}

void print_case(const Json& row, const EglContext& context) {
  const auto us = [&](const char* pass) { return row["gpu"][pass]["median_us"].get<double>(); };
  std::cout << fmt::format("\n{} organ{} at once, {} places, {} vertices, {} touched places each\n",
                           row["organs"].get<int>(), row["organs"] == 1 ? "" : "s",
                           row["places"].get<int>(), row["vertices"].get<int>(),
                           row["touched"].get<int>());
  std::cout << fmt::format("  compliance product  {:9.1f} us (p99 {:.1f}), {:.1f} GB/s\n",
                           us("product"), row["gpu"]["product"]["p99_us"].get<double>(),
                           1e-9 * row["product_bytes_per_s"].get<double>());
  const double share = row["share_of_read"].get<double>();
  std::cout << fmt::format(
      "    reading as many bytes: {:.1f} GB/s, so {:.0f} %; of a long read {:.0f} %{}\n",
      1e-9 * row["read_bytes_per_s"].get<double>(), 100.0 * share,
      100.0 * row["share_of_long_read"].get<double>(),
      context.software() ? "  (software driver: the target is for hardware)"
      : row["share_of_long_read"].get<double>() >= kShareToReach ? "  (to reach 70 %: met)"
                                                                 : "  (to reach 70 %: NOT met)");
  std::cout << fmt::format(
      "    error {:.1e} of the greatest displacement; the CPU takes {:.1f} us\n",
      row["error"]["displacement"].get<double>(), row["cpu"]["product_us"].get<double>());
  std::cout << fmt::format(
      "  drawn surface       {:9.1f} us: carry {:.1f}, near {:.1f}, normals {:.1f}\n"
      "    error {:.1e} m, normals {:.1e} rad; the CPU takes {:.1f} us\n",
      us("carry") + us("near") + us("normals"), us("carry"), us("near"), us("normals"),
      row["error"]["position_m"].get<double>(), row["error"]["normal_rad"].get<double>(),
      row["cpu"]["surface_us"].get<double>());
  std::cout << fmt::format(
      "  uploading loads     {:9.1f} us; the near field that goes with them costs the CPU {:.1f} "
      "us\n",
      us("upload"), row["cpu"]["near_field_us"].get<double>());
}

Result<Json> bench_case(const RingOrgan& organ, const HalfColumns* half, const Arguments& arguments,
                        int organs, const MemoryBandwidth& long_read) {
  const std::vector<GpuOrgan> given(static_cast<std::size_t>(organs),
                                    {"ring", &organ.compliance, &organ.drawn, half});
  Result<GpuDeformation> made = GpuDeformation::create(given);
  if (!made) return std::unexpected(made.error());
  GpuDeformation& gpu = *made;
  for (std::size_t o = 0; o < given.size(); ++o) {
    if (!gpu.refusal(o).empty()) return failure(gpu.refusal(o));
  }
  std::map<std::string, Times> times;
  Times whole;
  PassTimer timer;
  // Prepared, so that the device is as busy as it is when its bandwidth is measured.
  std::vector<Press> presses;
  for (int set = 0; set < std::max(arguments.touchable / arguments.touched, 1); ++set) {
    presses.push_back(press(organ, arguments, set));
  }
  std::vector<GpuLoads> loads;
  std::vector<std::size_t> pressed(given.size());  // which one each organ has
  std::size_t next = 0;
  for (int r = 0; r < arguments.repeats + kWarmUps; ++r) {
    loads.clear();
    for (std::size_t o = 0; o < given.size(); ++o) {
      pressed[o] = next++ % presses.size();
      loads.push_back(presses[pressed[o]].on(o));
    }
    const Stopwatch watch;
    timer.start();
    if (const Result<void> done = gpu.deform(loads, &timer); !done) {
      return std::unexpected(done.error());
    }
    const std::vector<PassTime> passes = timer.finish();
    if (r < kWarmUps) continue;
    whole.seconds.push_back(watch.seconds());
    for (const PassTime& pass : passes) times[pass.name].seconds.push_back(pass.seconds);
  }
  Difference difference;
  for (std::size_t o = 0; o < given.size(); ++o) {
    difference.add(organ, half, presses[pressed[o]], gpu, o);
  }

  const std::size_t rows = organ.compliance.rows();
  // Columns read, displacements written.
  const std::size_t entry = half != nullptr ? sizeof(std::uint16_t) : sizeof(float);
  const std::size_t bytes =
      static_cast<std::size_t>(organs) * rows *
      (3 * static_cast<std::size_t>(arguments.touched) * entry + sizeof(float));
  const Result<MemoryBandwidth> same = measure_memory_bandwidth(
      bytes, static_cast<std::size_t>(arguments.window_mb) * 1'000'000, arguments.repeats);
  if (!same) return std::unexpected(same.error());
  const double speed = static_cast<double>(bytes) / std::max(times["product"].median(), 1e-9);
  Json row;
  row["organs"] = organs;
  row["storage"] = half != nullptr ? "half" : "single";
  row["places"] = organ.compliance.places;
  row["touchable"] = arguments.touchable;
  row["touched"] = arguments.touched;
  row["vertices"] = organ.surface.vertices.size();
  row["device_bytes"] = gpu.bytes();
  row["storage_buffers"] = gpu.shards();
  for (const auto& [name, pass] : times) row["gpu"][name] = pass.json();
  row["frame_wall_us"] = 1e6 * whole.median();
  row["product_bytes"] = bytes;
  row["product_bytes_per_s"] = speed;
  row["read_bytes"] = same->bytes;
  row["read_bytes_per_s"] = same->read;
  row["share_of_read"] = speed / same->read;
  row["share_of_long_read"] = speed / long_read.read;
  row["near_vertices"] = presses[0].near_vertices.size();
  row["cpu"] = cpu_times(organ, half, arguments, organs);
  row["error"] = {{"displacement", difference.displacement},
                  {"position_m", difference.position},
                  {"normal_rad", difference.normal}};
  return row;
}

Result<void> bench(const Arguments& arguments) {
  if (arguments.touched > arguments.touchable || arguments.touchable > arguments.places) {
    return failure(
        fmt::format("--touched {} --touchable {} --places {}: expected at most as many "
                    "touched as touchable as there are places",
                    arguments.touched, arguments.touchable, arguments.places));
  }
  const Result<BenchDevice> device = open_bench_device(arguments.window_mb, arguments.repeats);
  if (!device) return std::unexpected(device.error());
  const EglContext& context = *device->context;
  const MemoryBandwidth& long_read = device->memory;
  const std::unique_ptr<RingOrgan> organ = make_organ(arguments);
  std::optional<HalfColumns> half;
  if (arguments.half) half = half_precision(organ->compliance);
  Json report;
  report["device"] = context.device();
  report["software"] = context.software();
  report["storage_block_bytes"] = GpuLimits::of_device().block_bytes;
  report["memory"] = {{"bytes", long_read.bytes},
                      {"read_bytes_per_s", long_read.read},
                      {"copy_bytes_per_s", long_read.copy}};
  report["share_to_reach"] = kShareToReach;
  report["repeats"] = arguments.repeats;
  for (const int organs : arguments.organs) {
    Result<Json> row = bench_case(*organ, half ? &*half : nullptr, arguments, organs, long_read);
    if (!row) return std::unexpected(row.error());
    print_case(*row, context);
    report["cases"].push_back(*std::move(row));
  }
  if (!arguments.json.empty()) return write_bench_json(arguments.json, report);
  return {};
}

}  // namespace
}  // namespace viscera

int main(int argc, char** argv) {
  viscera::Arguments arguments;
  CLI::App app(
      "Speed and error of the deformation kernels on this machine's GPU; with `smoke` or "
      "`heat`, of their passes.");
  viscera::SmokeBenchArguments smoke_arguments;
  CLI::App* smoke = app.add_subcommand("smoke", "the passes of smoke");
  smoke->add_option("--particles", smoke_arguments.particles, "a case each: 10k,100k,1M")
      ->delimiter(',');
  smoke->add_option("--repeats", smoke_arguments.repeats, "timed steps a case")
      ->check(CLI::Range(1, 100'000));
  smoke->add_option("--voxel-mm", smoke_arguments.voxel_mm, "of the splatted grid")
      ->check(CLI::Range(0.1, 100.0));
  smoke
      ->add_option("--window-mb", smoke_arguments.window_mb, "memory that bandwidth is measured on")
      ->check(CLI::Range(1, 100'000));
  smoke->add_flag("--paper", smoke_arguments.paper, "times the paper's Laplacian");
  smoke->add_option("--json", smoke_arguments.json, "file for the figures");
  viscera::GpuHeatBenchArguments heat_arguments;
  CLI::App* heat = app.add_subcommand("heat", "the passes of heat");
  heat->add_option("--bricks", heat_arguments.bricks,
                   "of 8 x 8 x 8 voxels along a cube's edge, a case each: 2,4,6")
      ->delimiter(',')
      ->check(CLI::Range(1, 20));
  heat->add_option("--repeats", heat_arguments.repeats, "timed steps a case")
      ->check(CLI::Range(1, 100'000));
  heat->add_option("--window-mb", heat_arguments.window_mb, "memory that bandwidth is measured on")
      ->check(CLI::Range(1, 100'000));
  heat->add_option("--json", heat_arguments.json, "file for the figures");
  app.add_option("--places", arguments.places, "displaced places of an organ")
      ->check(CLI::Range(12, 1'000'000));
  app.add_option("--vertices", arguments.vertices, "drawn vertices of an organ")
      ->check(CLI::Range(12, 5'000'000));
  app.add_option("--touchable", arguments.touchable, "places with columns")
      ->check(CLI::Range(1, 1'000'000));
  app.add_option("--touched", arguments.touched, "places under load a frame")
      ->check(CLI::Range(1, 1'000'000));
  app.add_option("--organs", arguments.organs, "organs at once, a case each: 1,8")
      ->delimiter(',')
      ->check(CLI::Range(1, 1000));
  app.add_option("--repeats", arguments.repeats, "timed frames a case")
      ->check(CLI::Range(1, 100'000));
  app.add_option("--window-mb", arguments.window_mb, "memory that bandwidth is measured on")
      ->check(CLI::Range(1, 100'000));
  app.add_flag("--half", arguments.half, "compliances in half precision");
  app.add_option("--json", arguments.json, "file for the figures");
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    app.exit(error);
    return 2;
  }
  const viscera::Result<void> done = smoke->parsed()  ? viscera::bench_smoke(smoke_arguments)
                                     : heat->parsed() ? viscera::bench_gpu_heat(heat_arguments)
                                                      : viscera::bench(arguments);
  if (done) return 0;
  std::cerr << done.error().text() << '\n';
  return 2;
}
