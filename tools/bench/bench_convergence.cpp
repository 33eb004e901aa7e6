#include "tools/bench/bench_convergence.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <ostream>

#include "engine/io/atomic_file.h"
#include "engine/io/interrupt.h"
#include "engine/io/report.h"
#include "engine/verification/bodies.h"
#include "engine/verification/smooth_solution.h"
#include "kernels/base/stopwatch.h"
#include "kernels/formulations/formulations.h"
#include "tools/bench/bench_plots.h"
#include "tools/common/bench_figures.h"

namespace viscera {
namespace {

constexpr double kJitter = 0.2;

/// What 4,913 nodes are to reach: with the linear basis; with the quadratic one the best known
/// figures of ten-node finite elements on as many nodes.
std::optional<double> target(const std::string& formulation, double poisson, std::size_t nodes) {
  if (nodes != 4913) return std::nullopt;
  struct Row {
    double poisson, linear, quadratic;
  };
  for (const Row& row :
       {Row{0.30, 6e-4, 2.4e-4}, Row{0.45, 8e-4, 4.5e-4}, Row{0.49, 1.6e-3, 9.8e-4}}) {
    if (std::abs(poisson - row.poisson) > 1e-9) continue;
    if (formulation == "galerkin") return row.linear;
    if (formulation == "galerkin_quadratic") return row.quadratic;
  }
  return std::nullopt;
}

std::optional<double> target(const ConvergenceCase& one) {
  return target(one.formulation, one.poisson, one.nodes);
}

BenchRow row_of(const std::string& formulation, double poisson, std::size_t nodes, double wanted) {
  return {fmt::format("{}, nu {:.2f}, {} nodes: error of u", formulation, poisson, nodes), "",
          std::nullopt, wanted};
}

std::string line(const ConvergenceCase& one) {
  std::string text = fmt::format("{:<20}{:>6.2f}{:>8}{:>12.3g}{:>8}{:>9.2f} s", one.formulation,
                                 one.poisson, one.nodes, one.error,
                                 one.order ? fmt::format("{:.2f}", *one.order) : "-", one.solve_s);
  if (const auto wanted = target(one)) {
    text += fmt::format("   to reach {:g}: {}", *wanted, one.error <= *wanted ? "met" : "NOT MET");
  }
  return text + "\n";
}

nlohmann::json to_json(const ConvergenceCase& one) {
  nlohmann::json json = {{"formulation", one.formulation},
                         {"basis", one.basis},
                         {"poisson", one.poisson},
                         {"jitter", kJitter},
                         {"nodes", one.nodes},
                         {"error", one.error},
                         {"solve_s", one.solve_s}};
  json["order"] = one.order ? nlohmann::json(*one.order) : nlohmann::json(nullptr);
  if (const auto wanted = target(one)) {
    json["target"] = *wanted;
    json["met"] = one.error <= *wanted;
  }
  return json;
}

Result<ConvergenceCase> measure(const Formulation& formulation, double poisson_ratio, int cells) {
  const IsotropicMaterial material{1.0, poisson_ratio};
  const SmoothSolution exact(material);
  const NodedBody body = jittered_cube(cells, kJitter);
  const Stopwatch watch;
  const auto unknowns =
      solve_static(formulation, body.problem(material, SmoothSolution::is_fixed), exact.loads());
  if (!unknowns) return std::unexpected(unknowns.error());
  ConvergenceCase one;
  one.solve_s = watch.seconds();
  one.formulation = formulation.name();
  one.basis = formulation.basis() == Basis::kQuadratic ? "quadratic" : "linear";
  one.poisson = poisson_ratio;
  one.nodes = body.cloud.size();
  one.error = smooth_solution_error(exact, formulation, body.cloud, *unknowns);
  return one;
}

}  // namespace

Result<void> bench_convergence(const ConvergenceBenchOptions& options, std::ostream& out) {
  const std::vector<std::string> names =
      options.formulations.empty() ? formulation_names() : options.formulations;
  const std::vector<int> sizes = options.quick ? std::vector{7, 10} : std::vector{7, 10, 16};
  nlohmann::json json = {{"machine", this_machine().cpu},
                         {"cases", nlohmann::json::array()},
                         {"skipped", nlohmann::json::array()}};
  std::vector<ConvergenceCase> cases;
  std::vector<BenchRow> rows;
  out << fmt::format("{:<20}{:>6}{:>8}{:>12}{:>8}{:>11}\n", "cube, smooth solution", "nu", "nodes",
                     "error of u", "order", "time");
  for (const std::string& name : names) {
    const Formulation* formulation = find_formulation(name);
    if (!formulation) return failure("--formulation: " + unknown_formulation(name));
    if (!formulation->warning().empty()) out << name << ": " << formulation->warning() << '\n';
    for (const double poisson_ratio : {0.30, 0.45, 0.49}) {
      std::optional<ConvergenceCase> coarser;
      int coarser_cells = 0;
      for (const int cells : sizes) {
        if (interrupted()) return failure(kCancelled);
        auto one = measure(*formulation, poisson_ratio, cells);
        if (!one) {
          out << fmt::format("{:<20}{:>6.2f}{:>8}  refused: {}\n", name, poisson_ratio,
                             (cells + 1) * (cells + 1) * (cells + 1), one.error().text());
          json["skipped"].push_back({{"formulation", name},
                                     {"poisson", poisson_ratio},
                                     {"nodes", (cells + 1) * (cells + 1) * (cells + 1)},
                                     {"reason", one.error().text()}});
          coarser.reset();
          const auto nodes = static_cast<std::size_t>((cells + 1) * (cells + 1) * (cells + 1));
          if (const auto wanted = target(name, poisson_ratio, nodes)) {
            rows.push_back(row_of(name, poisson_ratio, nodes, *wanted));
            rows.back().dropped = {one.error().text()};
          }
          continue;
        }
        if (coarser) {
          one->order = std::log(coarser->error / one->error) /
                       std::log(static_cast<double>(cells) / coarser_cells);
        }
        out << line(*one) << std::flush;
        json["cases"].push_back(to_json(*one));
        cases.push_back(*one);
        if (const auto wanted = target(*one)) {
          rows.push_back(row_of(name, poisson_ratio, one->nodes, *wanted));
          rows.back().value = one->error;
        }
        coarser = *one;
        coarser_cells = cells;
      }
    }
  }
  if (!rows.empty()) {
    out << '\n';
    print_rows(rows, "convergence", out);
  }
  json["rows"] = to_json(rows);
  if (!options.plots.empty()) {
    if (auto drawn = draw_convergence_plots(cases, options.plots); !drawn) return drawn;
  }
  if (options.json.empty()) return {};
  return write_file(options.json, json.dump(2) + "\n");
}

}  // namespace viscera
