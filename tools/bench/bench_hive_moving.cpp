#include "tools/bench/bench_hive_moving.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <ostream>
#include <thread>

#include "engine/io/interrupt.h"
#include "engine/verification/hemisphere_body.h"
#include "haptics/hive_tissue.h"
#include "haptics/servo_loop.h"

namespace viscera {
namespace {

constexpr double kTool = 0.1, kDepth = 0.05, kRadius = 0.4;  // over R
constexpr double kAmplitude = 0.45;                          // of the way over the dome [rad]
constexpr double kComesDown = 0.5;                           // [s]

/// Where a steady hand would lead the tool, whatever it feels.
class LedDevice final : public HapticDevice {
 public:
  explicit LedDevice(double speed) : rate_(speed / kHemisphereRadius) {
    limits_.work_space = Box(Vec3::Constant(-0.1), Vec3::Constant(0.1));
    limits_.peak_force = 8.5;
    limits_.continuous_force = 8.5;
    limits_.resolution = 3e-5;
    limits_.apparent_mass = 0.075;
    limits_.stiffness = 3500.0;
  }
  const std::string& name() const override { return name_; }
  const DeviceLimits& limits() const override { return limits_; }
  DeviceState read(std::uint64_t tick) noexcept override {
    const double time = 1e-3 * static_cast<double>(tick);
    const double depth = std::min(1.0, time / kComesDown);
    // A triangle wave of the angle: the speed is the same everywhere but at its ends.
    const double turn = std::fmod(rate_ * std::max(0.0, time - kComesDown), 4.0 * kAmplitude);
    const double angle = turn < kAmplitude         ? turn
                         : turn < 3.0 * kAmplitude ? 2.0 * kAmplitude - turn
                                                   : turn - 4.0 * kAmplitude;
    const double height = kHemisphereRadius * (1.0 + kTool + 0.1 - (0.1 + kDepth) * depth);
    DeviceState state;
    state.pose.position = height * Vec3(std::sin(angle), 0.0, std::cos(angle));
    state.sample = tick + 1;
    return state;
  }
  void write(const Vec3&) noexcept override {}

 private:
  const std::string name_ = "led";
  double rate_;  // [rad/s]
  DeviceLimits limits_;
};

}  // namespace

Result<MovingHiveCase> measure_moving_hive(const MovingHiveOptions& options) {
  HemisphereOptions wanted;
  wanted.poisson_ratio = options.poisson;
  wanted.touchable_zone = 1.2;
  auto body = HemisphereBody::prepare(wanted, until_interrupted());
  if (!body) return std::unexpected(body.error());
  auto surface = WalkableSurface::make((*body)->surface());
  if (!surface) return std::unexpected(surface.error());
  HiveTissueSettings settings;
  settings.tool_radius = kTool * kHemisphereRadius;
  settings.building = HiveBuilding::kOnAThread;
  settings.hive.periphery = HivePeriphery::kCoupled;
  settings.hive.material = (*body)->material();
  settings.hive.radius = kRadius * kHemisphereRadius;
  settings.hive.nodes = options.nodes;
  auto tissue =
      HiveTissue::create({&*surface, &(*body)->compliance(), &(*body)->touchable()}, settings);
  if (!tissue) return std::unexpected(tissue.error());
  TissueSnapshot& told = (*tissue)->snapshots().back();
  told.nearest = surface->nearest(Vec3(0.0, 0.0, kHemisphereRadius)).point;
  (*tissue)->snapshots().publish();

  LedDevice device(options.speed);
  ServoTick tick(device, **tissue, ServoSettings());
  ServoLoop loop(tick);
  MovingHiveCase one;
  loop.start();
  const auto end =
      std::chrono::steady_clock::now() + std::chrono::duration<double>(options.seconds);
  while (std::chrono::steady_clock::now() < end && !interrupted()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    if (loop.outputs().update())
      one.greatest_force = std::max(one.greatest_force, loop.outputs().front().tissue.norm());
  }
  loop.stop();
  if (interrupted()) return failure(kCancelled);
  one.nodes = (*tissue)->hive() ? (*tissue)->hive()->figures().nodes : 0;
  one.poisson = options.poisson;
  one.speed = options.speed;
  one.seconds = options.seconds;
  one.ticks = loop.statistics().ticks;
  one.missed = loop.statistics().missed;
  one.tissue = (*tissue)->figures();
  one.lateness = percentiles_of(loop.statistics().lateness);
  one.compute = percentiles_of(loop.statistics().compute);
  one.scheduler = loop.scheduler();
  return one;
}

void print(const MovingHiveCase& one, std::ostream& out) {
  out << fmt::format(
      "moving: {} nodes, {:.0f} mm/s over the dome, {:.0f} s on the wall clock, {}\n"
      "  {} ticks, {} missed; {} hives built beside; {} ticks without an answer\n"
      "  computing us: p50 {:.1f}, p99 {:.1f}, p99.9 {:.1f}, greatest {:.1f}; late us: p50 {:.1f}, "
      "p99 {:.1f}\n",
      one.nodes, 1e3 * one.speed, one.seconds, one.scheduler, one.ticks, one.missed,
      one.tissue.hives, one.tissue.uncovered + one.tissue.refused, one.compute.p50, one.compute.p99,
      one.compute.p999, one.compute.max, one.lateness.p50, one.lateness.p99);
}

nlohmann::json to_json(const MovingHiveCase& one) {
  const auto percentiles = [](const Percentiles& p) {
    return nlohmann::json{{"p50", p.p50}, {"p99", p.p99}, {"p999", p.p999}, {"max", p.max}};
  };
  return {{"nodes", one.nodes},
          {"poisson", one.poisson},
          {"speed_mm_per_s", 1e3 * one.speed},
          {"seconds", one.seconds},
          {"ticks", one.ticks},
          {"missed", one.missed},
          {"hives", one.tissue.hives},
          {"uncovered", one.tissue.uncovered},
          {"refused", one.tissue.refused},
          {"greatest_force_N", one.greatest_force},
          {"lateness_us", percentiles(one.lateness)},
          {"compute_us", percentiles(one.compute)},
          {"scheduler", one.scheduler}};
}

std::vector<BenchRow> rows_of(const MovingHiveCase& one) {
  std::optional<double> p99;
  std::vector<std::string> dropped;
  if (one.ticks > 0 && one.nodes > 0)
    p99 = one.compute.p99;
  else
    dropped = {"no tick was answered by a hive"};
  const auto without = static_cast<double>(one.missed + one.tissue.uncovered + one.tissue.refused);
  return {
      {fmt::format("moving hive of {} nodes, tick beside the next hive's building, p99", one.nodes),
       "us", p99, 200.0, false, dropped},
      {"ticks of it missed or without an answer", "", without, 0.0}};
}

}  // namespace viscera
