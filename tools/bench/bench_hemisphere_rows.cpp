#include "tools/bench/bench_hemisphere_rows.h"

#include <fmt/format.h>
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "engine/features/features.h"
#include "engine/io/interrupt.h"
#include "engine/scene/load_scene.h"
#include "kernels/base/random.h"
#include "tools/bench/scene_accuracy.h"
#include "tools/common/project_paths.h"

namespace viscera {
namespace fs = std::filesystem;

OnlineTimes measure_online(HemisphereBody& body, HemisphereContact contact, double a_over_R,
                           int rings) {
  constexpr double kFor = 0.15;
  const oneapi::tbb::global_control one_core(oneapi::tbb::global_control::max_allowed_parallelism,
                                             1);
  std::vector<float> displacements;
  OnlineTimes times;
  if (contact == HemisphereContact::kPress) {
    const HemispherePressure load = body.pressure(a_over_R);
    times.still =
        1e6 *
        median_call_s([&] { place_displacements(body.compliance(), load.response, displacements); },
                      kFor);
    times.moving = times.still;
    return times;
  }
  constexpr int kPlaces = 64;
  std::vector<std::vector<ContactCell>> patches;
  for (int i = 0; i < kPlaces; ++i)
    patches.push_back(HemisphereBody::cells(contact, body.material().poisson_ratio, a_over_R, rings,
                                            0.1 * i / kPlaces));
  ContactSolution solution;
  ContactResponse response;
  std::size_t at = 0;
  const auto step = [&](std::size_t stride) {
    body.contact().solve(patches[at], solution, response);
    body.contact().place_displacements(displacements);
    at = (at + stride) % patches.size();
  };
  times.still = 1e6 * median_call_s([&] { step(0); }, kFor);
  times.moving = 1e6 * median_call_s([&] { step(1); }, kFor);
  return times;
}

namespace {

/// The paper's size: 1,026 nodes, equally spaced, a patch of 19.
Result<void> add_online_rows(std::vector<BenchRow>& rows) {
  constexpr int kRings = 2;
  HemisphereOptions options;
  options.nodes = 1026;
  auto body = HemisphereBody::prepare(options, until_interrupted());
  if (!body) return std::unexpected(body.error());
  const OnlineTimes times = measure_online(**body, HemisphereContact::kStick, 0.2, kRings);
  const std::string what =
      fmt::format("online, {} nodes, 19 cells, one core", (*body)->cloud().size());
  rows.push_back({what + ", resting patch", "us", times.still, 40.0});
  rows.push_back({what + ", moving patch", "us", times.moving, 40.0});
  return {};
}

/// Loads spread over a matrix that no cache holds, elsewhere each time.
void add_bandwidth_row(std::vector<BenchRow>& rows) {
  constexpr int kPlaces = 14000, kTouchable = 1500, kTouched = 60;
  SurfaceCompliance compliance;
  compliance.places = kPlaces;
  for (int i = 0; i < kTouchable; ++i) compliance.touchable.push_back(i);
  compliance.columns.assign(compliance.rows() * 3 * kTouchable, 1e-3f);
  const Random random(1, 0);
  std::uint64_t draw = 0;
  ContactResponse response;
  response.touched.resize(kTouched);
  response.loads.assign(kTouched, Vec3(1.0, -0.5, 0.25));
  std::vector<float> displacements;
  const double seconds = median_call_s(
      [&] {
        // One node out of each of kTouched equal parts: ascending, and fresh ones every time.
        for (int i = 0; i < kTouched; ++i)
          response.touched[static_cast<std::size_t>(i)] =
              (i * kTouchable + static_cast<int>(random.uniform(draw++) * kTouchable)) / kTouched;
        place_displacements(compliance, response, displacements);
      },
      1.0);
  const double bytes = 4.0 * static_cast<double>(compliance.rows()) * 3 * kTouched;
  const double machine = read_bandwidth();
  rows.push_back(
      {fmt::format("read bandwidth of C_un f, of the machine's {:.1f} GB/s", 1e-9 * machine), "%",
       100.0 * bytes / seconds / machine, 60.0, true});
}

/// A preparation by a process of its own, whose peak memory is that of nothing else.
Result<void> add_large_rows(std::vector<BenchRow>& rows) {
  const auto scratch = ScratchFolder::create();
  if (!scratch) return std::unexpected(scratch.error());
  struct Large {
    std::string what;
    std::size_t nodes;
    double touchable_zone, seconds, gigabytes;
  };
  // A fifth of the whole surface, base included, is the cap within 0.714 R: 2 pi (1 - cos) = 3 pi
  // / 5.
  for (const Large& large : {Large{"full surface compliance", 11600, 1.0, 20.0, 1.0},
                             Large{"compliance of a touchable fifth", 30000, 0.714, 90.0, 4.0}}) {
    const fs::path json = (*scratch)->path() / "large.json";
    const CommandResult done = run_program(
        {"/proc/self/exe", "bench", "hemisphere", "--nodes", std::to_string(large.nodes),
         "--touchable-zone", fmt::format("{}", large.touchable_zone), "--a", "0.2", "--poisson",
         "0.45", "--formulation", "galerkin", "--contact", "press", "--quick", "--json",
         json.string()});
    if (interrupted()) return failure(kCancelled);
    std::ifstream file(json);
    const auto found = nlohmann::json::parse(file, nullptr, false);
    BenchRow time{
        fmt::format("{} nodes, {}, no cache", large.nodes, large.what), "s", {}, large.seconds};
    BenchRow memory{fmt::format("{} nodes, {}, peak memory", large.nodes, large.what),
                    "GB",
                    {},
                    large.gigabytes};
    if (done.code != 0 || !found.is_object() || found["cases"].empty()) {
      time.dropped =
          memory.dropped = {fmt::format("its preparation ended with exit code {}", done.code)};
    } else {
      const auto& one = found["cases"][0];
      time.value = one["prepare_s"].get<double>();
      memory.value = 1e-9 * static_cast<double>(done.peak_memory_bytes);
    }
    rows.push_back(std::move(time));
    rows.push_back(std::move(memory));
  }
  return {};
}

/// The main scene against itself on half the node spacing.
Result<void> add_scene_rows(std::vector<BenchRow>& rows) {
  const fs::path file = scenes_folder() / "laparoscopic_cautery.json";
  SceneLoadOptions load;
  load.assets = assets_folder();
  load.features = feature_keys();
  const auto scene = load_scene(file, load);
  const auto tissues = load_tissues(load.assets / "tissues.json");
  BenchRow force{"main scene: tool forces against half the node spacing", "%", {}, 5.0};
  BenchRow shape{"main scene: organs' shapes against half the node spacing", "%", {}, 5.0};
  if (!scene || !tissues) {
    force.dropped = shape.dropped = {(scene ? tissues.error() : scene.error()).text()};
  } else if (const auto accuracy = compare_with_half_spacing(*scene, *tissues)) {
    force.value = 100.0 * accuracy->force_error;
    shape.value = 100.0 * accuracy->profile_error;
  } else {
    force.dropped = shape.dropped = {accuracy.error().text()};
  }
  if (interrupted()) return failure(kCancelled);
  rows.push_back(std::move(force));
  rows.push_back(std::move(shape));
  return {};
}

}  // namespace

std::vector<BenchRow> hemisphere_error_rows(const std::vector<HemisphereCase>& cases,
                                            const std::vector<RefusedHemisphere>& refused) {
  std::vector<BenchRow> rows;
  for (const std::string& name : formulation_names()) {
    if (!name.starts_with("galerkin")) continue;
    const auto worst = [&](const std::string& what, auto applies, auto value, double target) {
      WorstCase worst;
      for (const HemisphereCase& one : cases) {
        if (one.formulation != name || !one.variant.empty() || one.nodes > kNodesToReach ||
            10 * one.nodes < 9 * kNodesToReach || !applies(one.poisson, one.contact))
          continue;
        worst.add(value(one),
                  fmt::format("nu {:.2f}, a {:.2f} R, {}: {}", one.poisson, one.a_over_R,
                              one.contact, one.note.empty() ? "no error is known" : one.note));
      }
      for (const RefusedHemisphere& one : refused)
        for (const HemisphereContact contact : kHemisphereContacts)
          if (one.formulation == name && one.nodes == kNodesToReach &&
              applies(one.poisson, std::string(name_of(contact))))
            worst.add(std::nullopt,
                      fmt::format("nu {:.2f}, {}: {}", one.poisson, name_of(contact), one.reason));
      if (!worst.empty())
        rows.push_back(worst.row(fmt::format("{}, at most 1,100 nodes: worst {}", name, what), "%",
                                 target, 100.0));
    };
    const auto force = [](const HemisphereCase& one) { return any_force_error(one); };
    const auto profile = [](const HemisphereCase& one) { return any_profile_error(one); };
    const auto soft = [](double poisson) { return poisson < 0.451; };
    worst(
        "pressure profile, nu .30 and .45",
        [&](double nu, const auto& contact) { return soft(nu) && contact == "press"; }, profile,
        2.0);
    worst(
        "reaction, stick or frictionless, nu .30 and .45",
        [&](double nu, const auto& contact) { return soft(nu) && contact != "press"; }, force, 3.0);
    worst(
        "stick profile, nu .30 and .45",
        [&](double nu, const auto& contact) { return soft(nu) && contact == "stick"; }, profile,
        4.0);
    worst(
        "reaction, nu .49",
        [&](double nu, const auto& contact) { return !soft(nu) && contact != "press"; }, force,
        10.0);
  }
  return rows;
}

Result<std::vector<BenchRow>> hemisphere_rows(const std::vector<HemisphereCase>& cases,
                                              const std::vector<RefusedHemisphere>& refused,
                                              bool quick) {
  std::vector<BenchRow> rows = hemisphere_error_rows(cases, refused);
  if (auto done = add_online_rows(rows); !done) return std::unexpected(done.error());
  add_bandwidth_row(rows);
  if (quick) return rows;
  if (auto done = add_scene_rows(rows); !done) return std::unexpected(done.error());
  if (auto done = add_large_rows(rows); !done) return std::unexpected(done.error());
  return rows;
}

}  // namespace viscera
