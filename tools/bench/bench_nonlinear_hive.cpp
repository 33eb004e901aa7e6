#include "tools/bench/bench_nonlinear_hive.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>
#include <ostream>

#include "engine/io/interrupt.h"
#include "engine/verification/ball_and_hive.h"
#include "engine/verification/pressed_block.h"

namespace viscera {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kBall = 5e-3, kModulus = 5e3;  // [m], [Pa]
constexpr double kStep = 25e-6;                 // of a tick: 25 mm/s
constexpr int kRings = 3;                       // of cells: 37
constexpr int kSweeps = 20;
constexpr double kDeadline = 0.4e-3;  // [s]: haptics/hive_tissue.h

/// St Venant-Kirchhoff tissue gives way a little deeper than these.
std::vector<double> depths_of(HyperelasticModel model) {
  return model == HyperelasticModel::kStvk ? std::vector<double>{0.05, 0.1}
                                           : std::vector<double>{0.1, 0.3, 0.6};
}

double percentile(std::vector<double>& sorted, double share) {
  return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
}

NonlinearBenchOutcome::Case measure(const NonlinearSettings& settings, double depth, double exact) {
  NonlinearBenchOutcome::Case one;
  BallAndHive tool(settings, kBall);
  one.model = settings.model;
  one.poisson = settings.material.poisson_ratio;
  one.depth = depth / kBall;
  one.nodes = tool.nonlinear().nodes();
  one.unknowns = tool.nonlinear().unknowns();
  const NonlinearForce there_at_last = tool.go(0.0, depth, kStep);
  one.force_error = there_at_last.hive.force.z() / exact - 1.0;
  one.settled = !there_at_last.by_tangent;
  one.linear_error = tool.linear(depth) / exact - 1.0;
  one.cells = static_cast<int>(tool.cells().size());
  Clock::time_point due;
  const TimeIsUp time{
      [](void* user) { return Clock::now() >= *static_cast<Clock::time_point*>(user); }, &due};
  std::vector<double> times;
  int steps = 0;
  const int there = static_cast<int>(std::ceil(depth / kStep));
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    tool.nonlinear().release();
    for (int i = 1; i < 2 * there; ++i) {
      const auto began = Clock::now();
      due = began +
            std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(kDeadline));
      const NonlinearForce force =
          tool.press(depth * (i <= there ? i : 2 * there - i) / there, time);
      times.push_back(1e6 * std::chrono::duration<double>(Clock::now() - began).count());
      steps += force.steps;
      one.tangent_answers += force.by_tangent;
      one.deadline_misses += force.out_of_time;
    }
  }
  one.ticks = static_cast<int>(times.size());
  one.steps = static_cast<double>(steps) / one.ticks;
  std::sort(times.begin(), times.end());
  one.tick_p50 = percentile(times, 0.5);
  one.tick_p99 = percentile(times, 0.99);
  return one;
}

void print_case(const NonlinearBenchOutcome::Case& one, std::ostream& out) {
  out << fmt::format(
             "{:<12}{:>5.2f}{:>8.2f}{:>7}{:>10}{:>8.2f}{:>10.1f}{:>10.1f}{:>9.1f}{:>10.2f}{:>10.2f}"
             "\n",
             name_of(one.model), one.poisson, one.depth, one.nodes, one.unknowns, one.steps,
             one.tick_p50, one.tick_p99, 100.0 * one.tangent_answers / one.ticks,
             100.0 * one.force_error, 100.0 * one.linear_error)
      << std::flush;
}

}  // namespace

nlohmann::json NonlinearBenchOutcome::cases() const {
  nlohmann::json json = nlohmann::json::array();
  for (const Case& one : all)
    json.push_back({{"material", name_of(one.model)},
                    {"poisson", one.poisson},
                    {"depth_over_ball_radius", one.depth},
                    {"nodes", one.nodes},
                    {"unknowns", one.unknowns},
                    {"cells", one.cells},
                    {"newton_steps_per_tick", one.steps},
                    {"ticks", one.ticks},
                    {"tick_us", {{"p50", one.tick_p50}, {"p99", one.tick_p99}}},
                    {"tangent_answers", one.tangent_answers},
                    {"deadline_misses", one.deadline_misses},
                    {"settled", one.settled},
                    {"force_error", one.force_error},
                    {"linear_force_error", one.linear_error}});
  return json;
}

std::vector<BenchRow> NonlinearBenchOutcome::rows() const {
  WorstCase slowest, error;
  for (const Case& one : all) {
    if (one.nodes > 80) continue;
    slowest.add(one.tick_p99, "");
    if (one.model == HyperelasticModel::kNeoHookean)
      error.add(one.settled ? std::optional(one.force_error) : std::nullopt,
                fmt::format("nu {:.2f}, {:.2f} R deep, {} nodes: Newton's steps didn't settle",
                            one.poisson, one.depth, one.nodes));
  }
  for (const std::string& one : without_reference) error.add(std::nullopt, one);
  return {slowest.row("beyond linear, at most 80 nodes, moving tick, p99", "us", 400.0),
          error.row("beyond linear, at most 80 nodes, neo-Hookean, force error", "%", 5.0, 100.0)};
}

Result<NonlinearBenchOutcome> bench_nonlinear_hive(const NonlinearBench& options,
                                                   std::ostream& out) {
  NonlinearBenchOutcome outcome;
  out << fmt::format(
      "\nbeyond linear: a ball on flat, deep tissue; errors against the whole body\n"
      "{:<12}{:>5}{:>8}{:>7}{:>10}{:>8}{:>10}{:>10}{:>9}{:>10}{:>10}\n",
      "material", "nu", "depth/R", "nodes", "unknowns", "steps", "p50 us", "p99 us", "tangent%",
      "force %", "linear %");
  const std::vector<int> grids =
      options.quick ? std::vector<int>{80} : std::vector<int>{28, 50, 80, 200};
  for (const double nu : options.poisson_ratios)
    for (const HyperelasticModel model :
         {HyperelasticModel::kNeoHookean, HyperelasticModel::kStvk}) {
      PressedBlockOptions block;
      block.model = model;
      block.material = {kModulus, nu};
      block.ball_radius = kBall;
      for (const double depth : depths_of(model)) block.depths.push_back(depth * kBall);
      const std::vector<double> exact = press_block(block);
      for (std::size_t i = exact.size(); i < block.depths.size(); ++i) {
        const std::string which = fmt::format(
            "{}, nu {:.2f}, {:.2f} R deep: the whole body has no "
            "equilibrium to compare with",
            name_of(model), nu, block.depths[i] / kBall);
        out << which << '\n';
        if (model == HyperelasticModel::kNeoHookean) outcome.without_reference.push_back(which);
      }
      for (const int nodes : grids)
        for (std::size_t i = 0; i < exact.size(); ++i) {
          if (interrupted()) return failure(kCancelled);
          NonlinearSettings settings;
          settings.model = model;
          settings.material = block.material;
          settings.rings = kRings;
          settings.nodes = nodes;
          outcome.all.push_back(measure(settings, block.depths[i], exact[i]));
          print_case(outcome.all.back(), out);
        }
    }
  return outcome;
}

}  // namespace viscera
