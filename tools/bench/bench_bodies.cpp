#include "tools/bench/bench_bodies.h"

#include <fmt/format.h>
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <ostream>

#include "engine/io/atomic_file.h"
#include "engine/io/interrupt.h"
#include "engine/io/svg_plot.h"
#include "engine/verification/body_references.h"
#include "engine/verification/thick_sphere.h"
#include "kernels/base/stopwatch.h"
#include "kernels/formulations/formulations.h"
#include "tools/bench/bench_choices.h"
#include "tools/common/bench_figures.h"
#include "tools/common/project_paths.h"

namespace viscera {
namespace {

/// Errors are to be reached with this many nodes at most, as on the hemisphere.
constexpr std::size_t kNodes = 1100;
constexpr double kForce = 0.03, kForceNearIncompressible = 0.10, kProfile = 0.04, kSphere = 0.05;
constexpr std::array kHollow = {0.4, 0.6, 0.8};  // inner radii of spheres over the outer

struct Case {
  std::string body, formulation, load;
  double poisson = 0.0;
  std::size_t nodes = 0;
  double prepare_s = 0.0;
  bool all_loads = true;  ///< else for this load alone
  std::optional<double> online_us, over_half_space, force_error, profile_error;
  std::string note;  ///< why there is no error

  bool near_incompressible() const { return poisson > 0.451; }
  std::optional<double> force_target() const {
    if (!is_counted() || load == "press" || load == "pressure") return std::nullopt;
    return near_incompressible() ? kForceNearIncompressible : kForce;
  }
  std::optional<double> profile_target() const {
    if (!is_counted()) return std::nullopt;
    if (load == "pressure") return kSphere;
    return near_incompressible() ? std::nullopt : std::optional(kProfile);
  }
  bool is_counted() const { return formulation == "galerkin" && nodes <= kNodes; }
};

std::string sphere_name(double inner) {
  return fmt::format("sphere_{:g}", inner);
}

std::vector<std::string> all_names() {
  std::vector<std::string> names;
  for (const BodyCase& body : body_cases()) names.push_back(body.name);
  for (const double inner : kHollow) names.push_back(sphere_name(inner));
  return names;
}

std::string percent(const std::optional<double>& value, bool sign) {
  if (!value) return "-";
  return sign ? fmt::format("{:+.1f} %", 100.0 * *value) : fmt::format("{:.1f} %", 100.0 * *value);
}

std::string verdict(const Case& one) {
  const auto force = one.force_target(), profile = one.profile_target();
  if (!force && !profile) return "";
  if (!one.note.empty()) return "NOT MET: " + one.note;
  std::vector<std::string> missed;
  if (force && !(std::abs(*one.force_error) <= *force))
    missed.push_back(fmt::format("force {:g} %", 100.0 * *force));
  if (profile && !(*one.profile_error <= *profile))
    missed.push_back(fmt::format("profile {:g} %", 100.0 * *profile));
  return missed.empty() ? "met" : fmt::format("NOT MET: {}", fmt::join(missed, ", "));
}

void print_case(const Case& one, std::ostream& out) {
  out << fmt::format("{:<12}{:<20}{:>5.2f}{:>7}  {:<10}{:>9.3g} {:<10}{:>10}{:>9}{:>9}{:>9}  {}\n",
                     one.body, one.formulation, one.poisson, one.nodes, one.load, one.prepare_s,
                     one.all_loads ? "all loads" : "this load",
                     one.online_us ? fmt::format("{:.1f}", *one.online_us) : "-",
                     one.over_half_space ? fmt::format("{:.3g}", *one.over_half_space) : "-",
                     percent(one.force_error, true), percent(one.profile_error, false),
                     one.note.empty() ? verdict(one) : one.note)
      << std::flush;
}

template <class T>
nlohmann::json or_null(const std::optional<T>& value) {
  return value ? nlohmann::json(*value) : nlohmann::json(nullptr);
}

nlohmann::json to_json(const Case& one) {
  nlohmann::json json = {{"body", one.body},
                         {"formulation", one.formulation},
                         {"poisson", one.poisson},
                         {"nodes", one.nodes},
                         {"load", one.load},
                         {"prepare_s", one.prepare_s},
                         {"prepares", one.all_loads ? "all loads" : "this load"},
                         {"online_us", or_null(one.online_us)},
                         {"force_over_half_space", or_null(one.over_half_space)},
                         {"force_error", or_null(one.force_error)},
                         {"profile_error", or_null(one.profile_error)},
                         {"targets",
                          {{"force_error", or_null(one.force_target())},
                           {"profile_error", or_null(one.profile_target())}}}};
  if (!one.note.empty()) json["note"] = one.note;
  return json;
}

double online_us(PressedBody& body, const std::vector<ContactCell>& cells) {
  const oneapi::tbb::global_control one_core(oneapi::tbb::global_control::max_allowed_parallelism,
                                             1);
  ContactSolution solution;
  ContactResponse response;
  std::vector<float> displacements;
  return 1e6 * median_call_s(
                   [&] {
                     body.contact().solve(cells, solution, response);
                     body.contact().place_displacements(displacements);
                   },
                   0.1);
}

/// What all cases of the run have in common.
struct Bench {
  const BodiesBenchOptions& options;
  std::ostream& out;
  std::vector<KnownBodyReference> references;
  std::vector<Case> cases;

  void add(Case one) {
    print_case(one, out);
    cases.push_back(std::move(one));
  }
};

struct Asked {
  std::string formulation;
  double poisson;
  std::size_t nodes;
};

/// A refusal is a case for every load.
void add_refused(Bench& bench, const std::string& body, const std::vector<std::string>& loads,
                 const Asked& asked, const Error& error) {
  for (const std::string& load : loads) {
    Case one;
    one.body = body;
    one.formulation = asked.formulation;
    one.load = load;
    one.poisson = asked.poisson;
    one.nodes = asked.nodes;
    one.note = "refused: " + error.text();
    bench.add(std::move(one));
  }
}

void measure_body(Bench& bench, const BodyCase& body, const Asked& asked) {
  const auto prepared =
      prepare_body(body, asked.poisson, asked.nodes, asked.formulation, until_interrupted());
  if (interrupted()) return;
  if (!prepared) {
    std::vector<std::string> loads;
    for (const BodyLoad load : body.loads) loads.emplace_back(name_of(load));
    return add_refused(bench, body.name, loads, asked, prepared.error());
  }
  for (const BodyLoad load : body.loads) {
    Case one;
    one.body = body.name;
    one.formulation = asked.formulation;
    one.load = name_of(load);
    one.poisson = asked.poisson;
    one.nodes = (*prepared)->cloud().size();
    one.prepare_s = (*prepared)->prepare_s();
    const BodyReference* reference =
        find_reference(bench.references, body.name, load, asked.poisson);
    const PressedAnswer answer = press_body(**prepared, body, load);
    if (!reference) {
      one.note = "no reference";
    } else if (!answer.converged) {
      one.note = "contact without a solution";
    } else {
      const BodyErrors errors = errors_of(**prepared, body, answer, *reference);
      one.profile_error = errors.profile;
      if (load != BodyLoad::kPress) {
        one.force_error = errors.force;
        one.over_half_space = reference->force / half_space_force(body, load, asked.poisson);
        one.online_us = online_us(**prepared, cells_of(body, load, asked.poisson));
      }
    }
    bench.add(std::move(one));
    if (interrupted()) return;
  }
}

/// A hollow sphere under pressure, held below with Lame's displacement.
void measure_sphere(Bench& bench, double inner, const Asked& asked) {
  const Formulation& formulation = *find_formulation(asked.formulation);
  const IsotropicMaterial material{kBodyModulus, asked.poisson};
  const auto measure = [&]() -> Result<Case> {
    NodedBody body{hollow_sphere(inner, 1.0, 0.1), {}};
    const auto spacing = even_spacing_for(body.surface, asked.nodes, until_interrupted());
    if (!spacing) return std::unexpected(spacing.error());
    const Stopwatch watch;
    auto cloud = place_nodes(
        body.surface, SurfaceTree(body.surface), [&](const Vec3&) { return *spacing; }, {},
        no_progress());
    if (!cloud) return std::unexpected(cloud.error());
    body.cloud = std::move(*cloud);
    const PressurisedSphere exact(material, inner, 1.0);
    const auto unknowns = solve_static(
        formulation, body.problem(material, [](const Vec3& x) { return x.z() < -0.5; }),
        exact.loads());
    if (!unknowns) return std::unexpected(unknowns.error());
    Case one;
    one.prepare_s = watch.seconds();
    one.nodes = body.cloud.size();
    one.profile_error = nodal_error(exact, formulation, body.cloud, *unknowns);
    return one;
  };
  auto measured = measure();
  if (interrupted()) return;
  if (!measured)
    return add_refused(bench, sphere_name(inner), {"pressure"}, asked, measured.error());
  measured->body = sphere_name(inner);
  measured->formulation = asked.formulation;
  measured->load = "pressure";
  measured->poisson = asked.poisson;
  measured->all_loads = false;
  bench.add(*std::move(measured));
}

Result<void> check_options(const BodiesBenchOptions& options) {
  Error mistakes;
  const auto names = all_names();
  for (const std::string& name : options.bodies)
    if (std::ranges::find(names, name) == names.end())
      mistakes.messages.push_back(
          fmt::format("--body: found \"{}\", expected {}", name, fmt::join(names, ", ")));
  for (const double nu : options.poisson_ratios)
    if (std::ranges::none_of(kBodyPoissonRatios,
                             [&](double known) { return std::abs(known - nu) < 1e-6; }))
      mistakes.messages.push_back(
          fmt::format("--poisson: found {:g}, expected {:g}, which have references", nu,
                      fmt::join(kBodyPoissonRatios, ", ")));
  check_bodies_named(options.formulations, options.nodes, mistakes);
  if (mistakes.messages.empty()) return {};
  return std::unexpected(mistakes);
}

/// "slab" of slab_3.5.
std::string family_of(const std::string& body) {
  return body.substr(0, body.find('_'));
}

std::vector<BenchRow> rows_of(const std::vector<Case>& cases) {
  struct Row {
    WorstCase worst;
    double target;
  };
  std::vector<std::pair<std::string, Row>> rows;
  const auto add = [&](const Case& one, const std::string& what, const std::optional<double>& value,
                       const std::optional<double>& target) {
    if (!target) return;
    const std::string name = fmt::format("{}: worst {}{}", family_of(one.body), what,
                                         one.near_incompressible() ? ", nu .49" : "");
    auto found = std::ranges::find(rows, name, [](const auto& row) { return row.first; });
    if (found == rows.end()) found = rows.insert(rows.end(), {name, {{}, *target}});
    found->second.worst.add(one.note.empty() ? value : std::nullopt,
                            fmt::format("{}, nu {:.2f}, {}: {}", one.body, one.poisson, one.load,
                                        one.note.empty() ? "no error is known" : one.note));
  };
  for (const Case& one : cases) {
    // Fewer nodes than the figure is for tell nothing of it.
    if (10 * one.nodes < 9 * kNodes) continue;
    add(one, "reaction", one.force_error, one.force_target());
    add(one, "profile", one.profile_error, one.profile_target());
  }
  std::vector<BenchRow> all;
  for (const auto& [name, row] : rows)
    all.push_back(row.worst.row(name, "%", 100.0 * row.target, 100.0));
  return all;
}

/// Errors at Poisson's ratio .45 against preparation time, a line a body and load.
Result<void> draw(const std::vector<Case>& cases, const std::filesystem::path& folder) {
  if (auto made = check_out_folder(folder); !made) return made;
  for (const bool force : {true, false}) {
    Plot plot;
    plot.title = force ? "Reaction where the body decides" : "Shape where the body decides";
    plot.subtitle = "Poisson's ratio 0.45, galerkin; against finite elements and Lame";
    plot.x = {"preparation, no cache (s)", true};
    plot.y = {force ? "error of the reaction (%)" : "error of the surface (%)", true};
    std::map<std::string, PlotSeries> series;
    for (const Case& one : cases) {
      const auto& error = force ? one.force_error : one.profile_error;
      if (!error || one.formulation != "galerkin" || std::abs(one.poisson - 0.45) > 1e-6) continue;
      PlotSeries& line = series[one.body + ", " + one.load];
      line.points.emplace_back(one.prepare_s, std::max(100.0 * std::abs(*error), 1e-2));
    }
    for (auto& [name, line] : series) {
      line.name = name;
      line.colour = static_cast<int>(plot.series.size() % 8);
      line.hollow = plot.series.size() >= 8;
      std::sort(line.points.begin(), line.points.end(),
                [](const Vec2& a, const Vec2& b) { return a.x() < b.x(); });
      plot.series.push_back(line);
    }
    if (plot.series.empty()) continue;
    const char* name = force ? "bodies_reaction.svg" : "bodies_profile.svg";
    if (auto written = write_file(folder / name, to_svg(plot)); !written) return written;
  }
  return {};
}

Result<void> write_references(const BodiesBenchOptions& options, std::ostream& out) {
  if (auto made = check_out_folder(options.references); !made) return made;
  std::vector<KnownBodyReference> all;
  for (const BodyCase& body : body_cases()) {
    if (!options.bodies.empty() &&
        std::ranges::find(options.bodies, body.name) == options.bodies.end())
      continue;
    for (const BodyLoad load : body.loads)
      for (const double nu : kBodyPoissonRatios) {
        if (interrupted()) return failure(kCancelled);
        const Stopwatch watch;
        auto reference = body.reference(load, nu, body.refinement);
        if (!reference) return std::unexpected(reference.error());
        out << fmt::format("{:<10}{:<7}nu {:.2f}  force {:.6g}  {:.1f} s\n", body.name,
                           name_of(load), nu, reference->force, watch.seconds())
            << std::flush;
        all.push_back({body.name, load, nu, *std::move(reference)});
      }
  }
  for (const auto& [name, text] : body_reference_files(all))
    if (auto written = write_file(options.references / name, text); !written) return written;
  return {};
}

}  // namespace

Result<void> bench_bodies(const BodiesBenchOptions& options, std::ostream& out) {
  if (auto sound = check_options(options); !sound) return sound;
  if (auto able = check_outputs({options.json}, options.plots); !able) return able;
  if (!options.references.empty()) return write_references(options, out);
  auto references = read_body_references(assets_folder() / "reference/bodies");
  if (!references) return std::unexpected(references.error());
  Bench bench{options, out, *std::move(references), {}};
  const bool named = options.names_cases();
  const auto nodes = or_default<std::size_t>(
      options.nodes, named || options.quick ? std::vector{kNodes}
                                            : std::vector<std::size_t>{500, kNodes, 2200, 4400});
  const auto ratios = or_default<double>(options.poisson_ratios,
                                         {kBodyPoissonRatios.begin(), kBodyPoissonRatios.end()});
  out << fmt::format("{:<12}{:<20}{:>5}{:>7}  {:<10}{:>9} {:<10}{:>10}{:>9}{:>9}{:>9}\n", "body",
                     "formulation", "nu", "nodes", "load", "prepare s", "for", "online us",
                     "F/F half", "force", "profile");
  for (const std::string& name : or_default(options.bodies, all_names()))
    for (const std::string& formulation :
         or_default<std::string>(options.formulations, {"galerkin"}))
      for (const double nu : ratios)
        for (const std::size_t count : nodes) {
          const Asked asked{formulation, nu, count};
          const auto body = std::ranges::find(body_cases(), name, &BodyCase::name);
          if (body != body_cases().end())
            measure_body(bench, *body, asked);
          else
            for (const double inner : kHollow)
              if (sphere_name(inner) == name) measure_sphere(bench, inner, asked);
          if (interrupted()) return failure(kCancelled);
        }
  out << "F/F half: the reference's force over that of a half-space: how much the body decides\n";
  const std::vector<BenchRow> rows = rows_of(bench.cases);
  print_rows_of_this_machine(rows, out);
  if (!options.plots.empty())
    if (auto drawn = draw(bench.cases, options.plots); !drawn) return drawn;
  nlohmann::json cases = nlohmann::json::array();
  for (const Case& one : bench.cases) cases.push_back(to_json(one));
  return write_cases(options.json, cases, rows);
}

}  // namespace viscera
