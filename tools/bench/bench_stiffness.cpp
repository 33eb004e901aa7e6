#include "tools/bench/bench_stiffness.h"

#include <fmt/format.h>

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <ostream>

#include "engine/io/interrupt.h"
#include "engine/verification/changed_body.h"
#include "kernels/base/stopwatch.h"
#include "kernels/points/node_placement.h"
#include "kernels/points/surface_tree.h"
#include "tools/common/bench_figures.h"

namespace viscera {
namespace {

// A block of liver, E of 5.4 kPa.
constexpr double kWidth = 60e-3, kHeight = 30e-3;
const IsotropicMaterial kLiver{5.4e3, 0.45};
constexpr double kFactor = 4.0;
constexpr double kChangeable = 12e-3, kTouchable = 20e-3;  // about the middle of the top [m]
const Vec3 kPole(0.0, 0.0, 0.5 * kHeight);

Result<std::unique_ptr<ChangedBody>> block(double finest) {
  NodedBody body{unit_cube(16), {}};
  for (Vec3& x : body.surface.vertices) x = x.cwiseProduct(Vec3(kWidth, kWidth, kHeight));
  const SurfaceTree tree(body.surface);
  auto cloud = place_nodes(body.surface, tree, graded_spacing(3.0 * finest, finest, 0.25, {kPole}),
                           {}, no_progress());
  if (!cloud) return std::unexpected(cloud.error());
  body.cloud = std::move(*cloud);
  const auto near = [](double radius) {
    return [radius](const Vec3& x) { return (x - kPole).norm() < radius; };
  };
  return ChangedBody::prepare(
      std::move(body), kLiver, [](const Vec3& x) { return x.z() < -0.5 * kHeight + 1e-9; },
      near(kTouchable), near(kChangeable));
}

/// A ball's tip of 1.5 mm that moves a little every time, so that nothing is remembered.
double touch_time(const ChangedBody& body, std::shared_ptr<const StiffnessUpdate> update) {
  PatchContact contact(body.sound(), body.touchable(), kLiver);
  contact.stiffen(std::move(update));
  ContactSolution solution;
  ContactResponse response;
  std::vector<float> places;
  int frame = 0;
  return median_call_s(
      [&] {
        std::vector<ContactCell> cells;
        const Vec3 centre = kPole + Vec3(1e-4 * (++frame % 7), 0.0, 0.0);
        for (int i = -3; i <= 3; ++i) {
          for (int j = -3; j <= 3; ++j) {
            if (std::abs(i + j) > 3) continue;
            ContactCell cell;
            cell.position = centre + 0.3e-3 * Vec3(i + 0.5 * j, std::sqrt(0.75) * j, 0.0);
            cell.area = 0.3e-3 * 0.3e-3 * std::sqrt(0.75);
            cell.depth = 0.5e-3 - 0.5 * (cell.position - centre).squaredNorm() / 1.5e-3;
            cells.push_back(cell);
          }
        }
        contact.solve(cells, solution, response);
        contact.place_displacements(places);
      },
      0.3);
}

}  // namespace

Result<StiffnessBench> bench_stiffness(bool quick, std::ostream& out) {
  auto made = block(quick ? 5e-3 : 3e-3);
  if (!made) return std::unexpected(made.error());
  ChangedBody& body = **made;
  StiffnessBench bench;
  bench.body_nodes = body.body().cloud.size();
  bench.places = body.places().size();
  bench.touchable = body.touchable().size();
  bench.region_nodes = body.changeable().tissue.nodes.size();
  bench.region_bytes = body.changeable().memory_bytes();
  {
    auto tissue = body.region([](const Vec3& x) { return (x - kPole).norm() < kChangeable; });
    if (!tissue) return std::unexpected(tissue.error());
    const Stopwatch watch;
    if (auto again =
            changeable_region(body, std::move(*tissue), body.places().fields, no_progress());
        !again)
      return std::unexpected(again.error());
    bench.region_s = watch.seconds();
  }
  out << fmt::format(
      "coagulation in a block of {} nodes, {} places, {} touchable; {} nodes may change "
      "({:.0f} MB, prepared in {:.2f} s)\n{:<10}{:>7}{:>7}{:>12}{:>16}{:>9}{:>11}\n",
      bench.body_nodes, bench.places, bench.touchable, bench.region_nodes,
      1e-6 * static_cast<double>(bench.region_bytes), bench.region_s, "lesion", "nodes", "rank",
      "update", "touch, before", "with", "error");
  const double sound = touch_time(body, nullptr);
  const std::vector<double> radii =
      quick ? std::vector{3e-3, 6e-3} : std::vector{1e-3, 2e-3, 3e-3, 4.5e-3, 6e-3, 8e-3, 11e-3};
  for (const double radius : radii) {
    if (interrupted()) return failure(kCancelled);
    const TissueChange change{
        body.factors(kFactor, [&](const Vec3& x) { return (x - kPole).norm() < radius; }), {}};
    const Stopwatch watch;
    const auto anew = body.recomputed(change.stiffness);
    bench.factor_s = watch.seconds();
    if (!anew) return std::unexpected(anew.error());
    StiffnessUpdate update;
    StiffnessCost cost;
    cost.radius = radius;
    cost.update_s = median_call_s(
        [&] { update = update_stiffness(body.changeable(), change, body.touchable()); }, 0.5);
    cost.nodes = update.nodes;
    cost.rank = update.rank;
    cost.bytes = update.memory_bytes();
    cost.error = compliance_distance(body.updated(update), *anew);
    cost.sound_touch_s = sound;
    cost.touch_s = touch_time(body, std::make_shared<StiffnessUpdate>(std::move(update)));
    bench.costs.push_back(cost);
    out << fmt::format("{:>7.1f} mm{:>7}{:>7}{:>9.1f} ms{:>13.2f} ms{:>6.2f} ms{:>11.1e}\n",
                       1e3 * radius, cost.nodes, cost.rank, 1e3 * cost.update_s,
                       1e3 * cost.sound_touch_s, 1e3 * cost.touch_s, cost.error)
        << std::flush;
  }
  out << fmt::format("  a new factorisation with its compliance, in double precision: {:.2f} s\n",
                     bench.factor_s);
  return bench;
}

nlohmann::json to_json(const StiffnessBench& bench) {
  nlohmann::json rows = nlohmann::json::array();
  for (const StiffnessCost& cost : bench.costs)
    rows.push_back({{"radius_m", cost.radius},
                    {"nodes", cost.nodes},
                    {"rank", cost.rank},
                    {"update_ms", 1e3 * cost.update_s},
                    {"touch_ms", 1e3 * cost.touch_s},
                    {"sound_touch_ms", 1e3 * cost.sound_touch_s},
                    {"bytes", cost.bytes},
                    {"error", cost.error}});
  return {{"body_nodes", bench.body_nodes},     {"places", bench.places},
          {"touchable", bench.touchable},       {"region_nodes", bench.region_nodes},
          {"region_bytes", bench.region_bytes}, {"region_s", bench.region_s},
          {"factor_s", bench.factor_s},         {"lesions", std::move(rows)}};
}

}  // namespace viscera
