#include "tools/bench/bench_lift.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <ostream>

#include "engine/io/atomic_file.h"
#include "engine/io/interrupt.h"
#include "engine/io/svg_plot.h"
#include "engine/verification/bent_block.h"
#include "engine/verification/lifted_body.h"
#include "kernels/base/stopwatch.h"
#include "tools/common/bench_figures.h"
#include "tools/peers/bent_block_calculix.h"

namespace viscera {
namespace {

constexpr double kFrame = 1.0 / 60.0;
constexpr int kConverged = 40;          // iterations a frame
constexpr double kConvergedTo = 1e-11;  // of the energy
// Of the elastica's search.
constexpr int kApproach = 10, kMostSearches = 8, kMostSteps = 10;
constexpr double kSettled = 1e-7;  // of the energy
constexpr double kBent = 30e-3;    // [m]
constexpr double kForceError = 0.005, kForceErrorNearIncompressible = 0.01;
constexpr double kBlockError = 0.01, kElasticaError = 0.02;
constexpr double kSmallFrame = 6e-3, kLargeFrame = 14e-3;  // [s]
constexpr double kSlender = 100e-3, kThick = 5e-3;         // of the slender bar [m]

/// A body of the benchmark that is lifted in frames.
struct Lift {
  const char* name;
  LiftedShape shape;
  double spacing;  ///< [m]
  double poisson;
  double height;  ///< [m]
  bool large = false;
  bool in_levels = false;
};
constexpr std::array kLifts = {
    Lift{"gallbladder", LiftedShape::kGallbladder, 4e-3, 0.45, 30e-3},
    Lift{"gallbladder_0.49", LiftedShape::kGallbladder, 4e-3, 0.49, 30e-3},
    Lift{"gallbladder_2200", LiftedShape::kGallbladder, 3.05e-3, 0.45, 30e-3, true},
    Lift{"in_levels", LiftedShape::kGallbladder, 4e-3, 0.45, 30e-3, false, true},
    Lift{"in_levels_0.49", LiftedShape::kGallbladder, 4e-3, 0.49, 30e-3, false, true},
    Lift{"in_levels_2200", LiftedShape::kGallbladder, 3.05e-3, 0.45, 30e-3, true, true},
    Lift{"tube", LiftedShape::kTube, 2.4e-3, 0.45, 20e-3},
};
constexpr const char* kBlock = "block";
/// The load of the elastica, P L^2 / (E I), with the sag and the shortening of its end over its
/// length by elliptic integrals [Bisshopp1945].
struct Elastica {
  const char* name;
  double load, sag, shortening;
};
constexpr std::array kElasticas = {Elastica{"elastica_1", 1.0, 0.3017, 0.0564},
                                   Elastica{"elastica_2", 2.0, 0.4935, 0.1606}};

struct Case {
  std::string name, response;
  std::size_t nodes = 0;
  double poisson = 0.0;
  std::optional<int> iterations;
  std::optional<double> force_error_p90, shape_error_m, frame_ms;
  std::string reference;
  std::optional<double> sag_error, shortening_error;  ///< of an elastica's end, over the exact one
};

std::vector<std::string> all_names() {
  std::vector<std::string> names;
  for (const Lift& lift : kLifts) names.emplace_back(lift.name);
  names.emplace_back(kBlock);
  for (const Elastica& elastica : kElasticas) names.emplace_back(elastica.name);
  return names;
}

std::string or_dash(const std::optional<double>& value, double scale, const char* format) {
  return value ? fmt::format(fmt::runtime(format), scale * *value) : "-";
}

nlohmann::json to_json(const Case& one) {
  const auto or_null = [](const auto& value) {
    return value ? nlohmann::json(*value) : nlohmann::json(nullptr);
  };
  return {{"case", one.name},
          {"response", one.response},
          {"nodes", one.nodes},
          {"poisson", one.poisson},
          {"iterations", or_null(one.iterations)},
          {"force_error_p90", or_null(one.force_error_p90)},
          {"shape_error_m", or_null(one.shape_error_m)},
          {"frame_ms", or_null(one.frame_ms)},
          {"reference", one.reference}};
}

struct Bench {
  std::ostream& out;
  std::vector<int> iterations;
  bool peers = false;
  std::vector<Case> cases;

  void add(const Case& one) {
    out << fmt::format("{:<18}{:<8}{:>6}{:>7.2f}{:>4}{:>12}{:>12}{:>11}  {}\n", one.name,
                       one.response, one.nodes, one.poisson,
                       one.iterations ? std::to_string(*one.iterations) : "-",
                       or_dash(one.force_error_p90, 100.0, "{:.3f} %"),
                       or_dash(one.shape_error_m, 1e3, "{:.3f} mm"),
                       or_dash(one.frame_ms, 1.0, "{:.2f} ms"), one.reference)
        << std::flush;
    cases.push_back(one);
  }
};

double at_share(std::vector<double> values, double share) {
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

/// The greatest distance of a node [m].
double farthest(std::span<const double> one, std::span<const double> other) {
  double most = 0.0;
  for (std::size_t at = 0; at < one.size(); at += 3)
    most = std::max(most, (Vec3::Map(one.data() + at) - Vec3::Map(other.data() + at)).norm());
  return most;
}

/// What each frame of a lift comes to when it is solved to the end.
struct Converged {
  std::vector<Vec3> forces;
  std::vector<std::vector<double>> shapes;
};

std::vector<Vec3> way_of(const Lift& lift) {
  std::vector<Vec3> way;
  for (int frame = 1; frame <= 90; ++frame)
    way.push_back(lifted(frame * kFrame, lift.height, 90 * kFrame));
  return way;
}

Converged converge(const LiftedBody& body, const std::vector<Vec3>& way) {
  Converged all;
  const FiniteSolver solver = body.solver().with(kConverged, kConvergedTo);
  FiniteState state = solver.at_rest();
  FiniteStep last;
  for (const Vec3& moved : way) {
    if (interrupted()) return all;
    GripTouch touch = body.held_at(moved, last);
    last = solver.step(touch, state);
    all.forces.push_back(LiftedBody::force(last));
    all.shapes.push_back(state.displacements);
  }
  return all;
}

/// Errors under a thousandth of a newton don't count as shares of less.
double force_error(const Vec3& force, const Vec3& exact) {
  return (force - exact).norm() / std::max(1e-3, exact.norm());
}

Result<void> measure_lift(Bench& bench, const Lift& lift) {
  LiftedBodyOptions options;
  options.shape = lift.shape;
  options.spacing = lift.spacing;
  options.material.poisson_ratio = lift.poisson;
  options.in_levels = lift.in_levels;
  const auto body = LiftedBody::prepare(options);
  if (!body) return std::unexpected(body.error());
  const std::vector<Vec3> way = way_of(lift);
  const Converged exact = converge(**body, way);
  if (interrupted()) return failure(kCancelled);
  Case one{.name = lift.name,
           .response = "finite",
           .nodes = (*body)->body().cloud.size(),
           .poisson = lift.poisson,
           .reference = "its own steps, converged"};
  for (const int iterations : bench.iterations) {
    const FiniteSolver solver = (*body)->solver().with(iterations, options.solver.decrement);
    FiniteState state = solver.at_rest();
    std::vector<double> errors, times;
    double shape = 0.0;
    FiniteStep step;
    for (std::size_t frame = 0; frame < way.size(); ++frame) {
      GripTouch touch = (*body)->held_at(way[frame], step);
      const Stopwatch watch;
      step = solver.step(touch, state);
      times.push_back(watch.seconds());
      errors.push_back(force_error(LiftedBody::force(step), exact.forces[frame]));
      shape = std::max(shape, farthest(state.displacements, exact.shapes[frame]));
    }
    one.iterations = iterations;
    one.force_error_p90 = at_share(errors, 0.9);
    one.shape_error_m = shape;
    one.frame_ms = 1e3 * at_share(times, 0.5);
    bench.add(one);
    if (interrupted()) return failure(kCancelled);
  }
  one.response = "linear";
  one.iterations.reset();
  one.frame_ms.reset();
  std::vector<double> errors;
  double shape = 0.0;
  for (std::size_t frame = 0; frame < way.size(); ++frame) {
    errors.push_back(force_error((*body)->linear_force(way[frame]), exact.forces[frame]));
    const VectorX linear = (*body)->linear_displacements(way[frame]);
    shape = std::max(shape, farthest({linear.data(), static_cast<std::size_t>(linear.size())},
                                     exact.shapes[frame]));
  }
  one.force_error_p90 = at_share(errors, 0.9);
  one.shape_error_m = shape;
  bench.add(one);
  return {};
}

constexpr int kPeerElements = 30;  // along the block

/// What CalculiX makes of the block, where it is asked for and installed.
Result<std::optional<BentBlockByCalculix>> peer_of(const Bench& bench,
                                                   const BentBlockOptions& options) {
  if (!bench.peers) return std::optional<BentBlockByCalculix>();
  if (!calculix_installed()) {
    bench.out << "CalculiX isn't installed: tools/setup --peers\n";
    return std::optional<BentBlockByCalculix>();
  }
  const auto folder = ScratchFolder::create();
  if (!folder) return std::unexpected(folder.error());
  auto bent = bend_by_calculix(options, kPeerElements, (*folder)->path());
  if (!bent) return std::unexpected(bent.error());
  return std::optional(*bent);
}

/// At rest, end by end: equilibrium against finite elements of the same law.
Result<void> measure_block(Bench& bench) {
  LiftedBodyOptions options;
  options.shape = LiftedShape::kBar;
  options.spacing = 3.35e-3;
  options.solver.dynamic = false;
  const auto body = LiftedBody::prepare(options);
  if (!body) return std::unexpected(body.error());
  const BentBlockOptions bent = {.moved = Vec3(0.0, 0.0, kBent), .material = options.material};
  const auto exact = BentBlock::solve(bent);
  if (!exact) return std::unexpected(exact.error());
  const auto peer = peer_of(bench, bent);
  if (!peer) return std::unexpected(peer.error());
  const auto shape_error = [&](std::span<const double> displacements) {
    double most = 0.0;
    for (std::size_t node = 0; node < (*body)->body().cloud.size(); ++node)
      most = std::max(most, (Vec3::Map(displacements.data() + 3 * node) -
                             exact->at((*body)->body().cloud.positions[node]))
                                .norm());
    return most;
  };
  Case one{.name = kBlock,
           .response = "finite",
           .nodes = (*body)->body().cloud.size(),
           .poisson = options.material.poisson_ratio,
           .reference = "27-node elements of the same law"};
  const FiniteSolver solver = (*body)->solver().with(kConverged, kConvergedTo);
  FiniteState state = solver.at_rest();
  Vec3 force = Vec3::Zero();
  for (int step = 1; step <= 6; ++step) {
    GripTouch touch = (*body)->held_at(Vec3(0.0, 0.0, kBent * step / 6.0));
    force = LiftedBody::force(solver.step(touch, state));
    if (interrupted()) return failure(kCancelled);
  }
  one.force_error_p90 = force_error(force, exact->force());
  one.shape_error_m = shape_error(state.displacements);
  bench.add(one);
  if (*peer) {
    Case beside = one;
    beside.force_error_p90 = force_error(force, (*peer)->force);
    beside.shape_error_m.reset();
    beside.reference = fmt::format("CalculiX, {} nodes of T10, the same law", (*peer)->nodes);
    bench.add(beside);
  }
  one.response = "linear";
  const Vec3 moved(0.0, 0.0, kBent);
  one.force_error_p90 = force_error((*body)->linear_force(moved), exact->force());
  const VectorX linear = (*body)->linear_displacements(moved);
  one.shape_error_m = shape_error({linear.data(), static_cast<std::size_t>(linear.size())});
  bench.add(one);
  return {};
}

/// Where the mean of the slender bar's end comes to under a dead load across it: its place is
/// sought whose force is that load.
Result<void> measure_elastica(Bench& bench, const Elastica& elastica) {
  LiftedBodyOptions options;
  options.shape = LiftedShape::kSlenderBar;
  options.spacing = 1.7e-3;
  options.material = {12e3, 0.3};
  options.solver.dynamic = false;
  const auto body = LiftedBody::prepare(options);
  if (!body) return std::unexpected(body.error());
  const double moment = std::pow(kThick, 4) / 12.0;
  const Vec3 load(0.0, 0.0,
                  elastica.load * options.material.youngs_modulus * moment / (kSlender * kSlender));
  const Vec3 exact = kSlender * Vec3(-elastica.shortening, 0.0, elastica.sag);
  const FiniteSolver solver = (*body)->solver().with(kConverged, kConvergedTo);
  FiniteState state = solver.at_rest();
  const auto force_at = [&](const Vec3& moved, FiniteState& from) {
    GripTouch touch = (*body)->held_at(moved);
    // From afar a slender bar takes more iterations than one step has.
    FiniteStep step = solver.step(touch, from);
    for (int more = 0; more < kMostSteps && step.residual > kSettled; ++more)
      step = solver.step(touch, from);
    return LiftedBody::force(step);
  };
  for (int step = 1; step < kApproach; ++step) {
    // Sag goes with the load, shortening with its square, as long as both are small.
    const double share = static_cast<double>(step) / kApproach;
    force_at({share * share * exact.x(), 0.0, share * exact.z()}, state);
    if (interrupted()) return failure(kCancelled);
  }
  const double at_exact = force_error(force_at(exact, state), load);
  Vec3 place = exact;
  for (int search = 0; search < kMostSearches; ++search) {
    const Vec3 force = force_at(place, state);
    const Vec3 missing = load - force;
    if (missing.norm() < 1e-4 * load.norm()) break;
    // The slope by differences, in the plane of the load.
    Eigen::Matrix2d slope;
    constexpr double kProbe = 1e-4;
    for (int k = 0; k < 2; ++k) {
      FiniteState probe = state;
      Vec3 aside = place;
      aside[2 * k] += kProbe;
      const Vec3 change = (force_at(aside, probe) - force) / kProbe;
      slope.col(k) << change.x(), change.z();
    }
    const Eigen::Vector2d way =
        slope.partialPivLu().solve(Eigen::Vector2d(missing.x(), missing.z()));
    place += Vec3(way.x(), 0.0, way.y());
    if (interrupted()) return failure(kCancelled);
  }
  Case one{.name = elastica.name,
           .response = "finite",
           .nodes = (*body)->body().cloud.size(),
           .poisson = options.material.poisson_ratio,
           .reference = "elastica"};
  one.force_error_p90 = at_exact;
  one.shape_error_m = (place - exact).norm();
  one.sag_error = std::abs(place.z() / exact.z() - 1.0);
  one.shortening_error = std::abs(place.x() / exact.x() - 1.0);
  bench.add(one);
  return {};
}

std::vector<BenchRow> rows_of(const std::vector<Case>& cases) {
  std::vector<BenchRow> rows;
  const auto find = [&](const std::string& name, std::optional<int> iterations) -> const Case* {
    for (const Case& one : cases)
      if (one.name == name && one.response == "finite" && one.iterations == iterations) return &one;
    return nullptr;
  };
  const auto add = [&](const Case* of, const std::string& what, const char* unit, auto value,
                       double target, double scale) {
    if (!of) return;
    BenchRow row{.what = what, .unit = unit, .value = (*of).*value, .target = scale * target};
    if (row.value) *row.value *= scale;
    rows.push_back(row);
  };
  const auto force = &Case::force_error_p90, frame = &Case::frame_ms;
  add(find("gallbladder", 1), "lift, n = 1: force, p90", "%", force, kForceError, 100.0);
  add(find("gallbladder", 1), "lift, n = 1: a frame", "ms", frame, 1e3 * kSmallFrame, 1.0);
  add(find("gallbladder_2200", 1), "2,200 nodes, n = 1: force, p90", "%", force, kForceError,
      100.0);
  add(find("gallbladder_2200", 1), "2,200 nodes, n = 1: a frame", "ms", frame, 1e3 * kLargeFrame,
      1.0);
  add(find("gallbladder_0.49", 2), "Poisson .49, n = 2: force, p90", "%", force,
      kForceErrorNearIncompressible, 100.0);
  add(find("in_levels", 1), "in two levels, n = 1: force, p90", "%", force, kForceError, 100.0);
  add(find("in_levels_2200", 1), "in two levels, 2,200 nodes, n = 1: force, p90", "%", force,
      kForceError, 100.0);
  add(find("in_levels_0.49", 2), "in two levels, Poisson .49, n = 2: force, p90", "%", force,
      kForceErrorNearIncompressible, 100.0);
  add(find(kBlock, {}), "bent block: force", "%", force, kBlockError, 100.0);
  for (const Elastica& elastica : kElasticas) {
    const std::string load = fmt::format("elastica, load {:g}: ", elastica.load);
    add(find(elastica.name, {}), load + "sag", "%", &Case::sag_error, kElasticaError, 100.0);
    add(find(elastica.name, {}), load + "shortening", "%", &Case::shortening_error, kElasticaError,
        100.0);
  }
  return rows;
}

/// Error of the force against time a frame, a line a body.
Result<void> draw(const std::vector<Case>& cases, const std::filesystem::path& folder) {
  if (auto made = check_out_folder(folder); !made) return made;
  Plot plot;
  plot.title = "Lifts at finite strain";
  plot.subtitle = "90th percentile over the frames; a point each number of iterations a frame";
  plot.x = {"a frame (ms)", true};
  plot.y = {"error of the force (%)", true};
  for (const Case& one : cases) {
    if (!one.frame_ms || !one.force_error_p90) continue;
    if (plot.series.empty() || plot.series.back().name != one.name) {
      PlotSeries line;
      line.name = one.name;
      line.colour = static_cast<int>(plot.series.size() % 8);
      plot.series.push_back(line);
    }
    plot.series.back().points.emplace_back(*one.frame_ms, 100.0 * *one.force_error_p90);
  }
  if (plot.series.empty()) return {};
  return write_file(folder / "lift.svg", to_svg(plot));
}

Result<void> check_options(const LiftBenchOptions& options) {
  Error mistakes;
  const auto names = all_names();
  for (const std::string& name : options.cases)
    if (std::ranges::find(names, name) == names.end())
      mistakes.messages.push_back(
          fmt::format("--case: found \"{}\", expected {}", name, fmt::join(names, ", ")));
  for (const int n : options.iterations)
    if (n < 1 || n > 40)
      mistakes.messages.push_back(fmt::format("--iterations: found {}, expected 1 to 40", n));
  if (mistakes.messages.empty()) return {};
  return std::unexpected(mistakes);
}

}  // namespace

Result<void> bench_lift(const LiftBenchOptions& options, std::ostream& out) {
  if (auto sound = check_options(options); !sound) return sound;
  if (auto able = check_outputs({options.json}, options.plots); !able) return able;
  const auto asked = [&](const std::string& name) {
    return options.cases.empty() || std::ranges::find(options.cases, name) != options.cases.end();
  };
  Bench bench{out,
              options.iterations.empty() ? std::vector{1, 2, 4} : options.iterations,
              options.peers,
              {}};
  out << fmt::format("{:<18}{:<8}{:>6}{:>7}{:>4}{:>12}{:>12}{:>11}  {}\n", "case", "response",
                     "nodes", "nu", "n", "force p90", "shape", "a frame", "against");
  for (const Lift& lift : kLifts) {
    if (!asked(lift.name) || (options.quick && lift.large && options.cases.empty())) continue;
    if (auto done = measure_lift(bench, lift); !done) return done;
  }
  if (asked(kBlock))
    if (auto done = measure_block(bench); !done) return done;
  for (const Elastica& elastica : kElasticas)
    if (asked(elastica.name))
      if (auto done = measure_elastica(bench, elastica); !done) return done;
  const std::vector<BenchRow> rows = rows_of(bench.cases);
  print_rows_of_this_machine(rows, out);
  if (!options.plots.empty())
    if (auto drawn = draw(bench.cases, options.plots); !drawn) return drawn;
  nlohmann::json cases = nlohmann::json::array();
  for (const Case& one : bench.cases) cases.push_back(to_json(one));
  return write_cases(options.json, cases, rows);
}

}  // namespace viscera
