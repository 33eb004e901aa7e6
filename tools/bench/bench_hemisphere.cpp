#include "tools/bench/bench_hemisphere.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <ostream>

#include "engine/io/atomic_file.h"
#include "engine/io/interrupt.h"
#include "engine/io/report.h"
#include "engine/verification/axisymmetric_hemisphere.h"
#include "kernels/formulations/formulations.h"
#include "tools/bench/bench_choices.h"
#include "tools/bench/bench_hemisphere_rows.h"
#include "tools/bench/bench_plots.h"
#include "tools/common/project_paths.h"
#include "tools/peers/peer_cases.h"

namespace viscera {
namespace {

/// Rings of cells that cover the contact patch: 6 are 127 cells.
constexpr int kRings = 6;

constexpr double kForceUnit =
    kHemisphereModulus * kHemisphereRadius * kHemisphereRadius * kHemisphereDepth;  // [N]

/// The data's references, and our own solutions where they hold none.
struct References {
  std::vector<HemisphereReference> data, own;

  /// Solves where need be: seconds.
  const HemisphereReference* own_of(double poisson_ratio, double a_over_R) {
    if (const auto* known = find_reference(own, poisson_ratio, a_over_R)) return known;
    auto solved = solve_axisymmetric_hemisphere(poisson_ratio, a_over_R);
    if (!solved) return nullptr;
    own.push_back(std::move(*solved));
    return &own.back();
  }
};

HemisphereCase measure(HemisphereBody& body, HemisphereContact contact, double a_over_R,
                       References& references) {
  HemisphereCase one;
  const PreparationFigures& figures = body.figures();
  one.formulation = body.formulation().name();
  one.basis = body.formulation().basis() == Basis::kQuadratic ? "quadratic" : "linear";
  one.nodes = body.cloud().size();
  one.surface_nodes = body.cloud().surface_count;
  one.poisson = body.material().poisson_ratio;
  one.a_over_R = a_over_R;
  one.contact = name_of(contact);
  one.prepare_s = body.prepare_s();
  one.assemble_s = figures.assemble_s;
  one.factor_s = figures.factor_s;
  one.compliance_s = figures.compliance_s;
  one.factor_bytes = figures.factor_bytes;
  one.compliance_eigenvalue = figures.smallest_compliance_eigenvalue;
  one.memory_bytes = body.memory_bytes();
  const bool pressed = contact == HemisphereContact::kPress;
  const HemisphereAnswer answer = body.press(contact, a_over_R, kRings);
  if (!answer.converged) {
    one.converged = false;
    one.note = "contact without a solution";
    return one;
  }
  if (!pressed) {
    one.cells = static_cast<std::size_t>(1 + 3 * kRings * (kRings + 1));
    one.force_over_ERdelta = answer.force / kForceUnit;
    one.smallest_eigenvalue = answer.smallest_eigenvalue;
  }
  const auto errors = [&](const HemisphereReference& reference, std::optional<double>& force,
                          std::optional<double>& profile) {
    if (!pressed) force = *one.force_over_ERdelta / reference.force(contact) - 1.0;
    profile = body.profile_error(answer.displacements, reference.profile(contact));
  };
  if (const auto* reference = find_reference(references.data, one.poisson, a_over_R))
    errors(*reference, one.force_error, one.profile_error);
  else if (const auto* own = references.own_of(one.poisson, a_over_R))
    errors(*own, one.own_force_error, one.own_profile_error);
  const OnlineTimes times = measure_online(body, contact, a_over_R, kRings);
  one.online_us = times.still;
  one.online_moving_us = times.moving;
  for (std::size_t v = 0; v < answer.displacements.size(); ++v) {
    if (body.surface().vertices[v].z() <= 0.0) continue;
    one.profile.push_back(body.surface().vertices[v] / kHemisphereRadius);
    one.displacement.push_back(answer.displacements[v] / kHemisphereRadius);
  }
  return one;
}

/// Stuck contact by pinned nodes, as peers have it on meshes that know nothing of the contact.
HemisphereCase measure_pinned(HemisphereBody& body, double a_over_R, const HemisphereCase& stuck,
                              References& references) {
  HemisphereCase one = stuck;
  one.variant = "pinned";
  one.profile.clear();
  one.displacement.clear();
  one.online_us = one.online_moving_us = one.smallest_eigenvalue = std::nullopt;
  one.force_error = one.profile_error = one.own_force_error = one.own_profile_error = std::nullopt;
  one.cells = 0;
  const HemisphereAnswer answer = body.press_pinned(a_over_R);
  one.note = "surface nodes within a are moved; nothing is finer than nodes";
  one.converged = answer.converged;
  if (!answer.converged) {
    one.note = "no node within a, or no forces that move those";
    one.force_over_ERdelta = std::nullopt;
    return one;
  }
  one.force_over_ERdelta = answer.force / kForceUnit;
  const auto errors = [&](const HemisphereReference& reference, std::optional<double>& force,
                          std::optional<double>& profile) {
    force = *one.force_over_ERdelta / reference.stick - 1.0;
    profile =
        body.profile_error(answer.displacements, reference.profile(HemisphereContact::kStick));
  };
  if (const auto* reference = find_reference(references.data, one.poisson, a_over_R))
    errors(*reference, one.force_error, one.profile_error);
  else if (const auto* own = references.own_of(one.poisson, a_over_R))
    errors(*own, one.own_force_error, one.own_profile_error);
  return one;
}

/// Prepares `runs` times; the one whose time is the median.
Result<std::unique_ptr<HemisphereBody>> prepare_median(const HemisphereOptions& options, int runs) {
  std::vector<std::unique_ptr<HemisphereBody>> bodies;
  for (int i = 0; i < runs; ++i) {
    auto body = HemisphereBody::prepare(options, until_interrupted());
    if (!body) return std::unexpected(body.error());
    bodies.push_back(std::move(*body));
  }
  std::sort(bodies.begin(), bodies.end(),
            [](const auto& a, const auto& b) { return a->prepare_s() < b->prepare_s(); });
  return std::move(bodies[bodies.size() / 2]);
}

Result<std::vector<HemisphereContact>> contacts_of(const std::vector<std::string>& names) {
  if (names.empty())
    return std::vector<HemisphereContact>{kHemisphereContacts.begin(), kHemisphereContacts.end()};
  std::vector<HemisphereContact> contacts;
  for (const std::string& name : names) {
    const auto* found = std::find_if(kHemisphereContacts.begin(), kHemisphereContacts.end(),
                                     [&](HemisphereContact c) { return name_of(c) == name; });
    if (found == kHemisphereContacts.end())
      return failure(
          fmt::format("--contact: found \"{}\", expected stick, frictionless or press", name));
    contacts.push_back(*found);
  }
  return contacts;
}

/// What all cases of the run have in common.
struct Bench {
  const HemisphereBenchOptions& options;
  std::ostream& out;
  References references;
  std::vector<HemisphereCase> cases;
  std::vector<BenchRow> rows;
  std::vector<RefusedHemisphere> refused;

  void add(HemisphereCase one) {
    print_case(one, out);
    cases.push_back(std::move(one));
  }
};

Result<void> check_options(const HemisphereBenchOptions& options) {
  Error mistakes;
  if (auto contacts = contacts_of(options.contacts); !contacts)
    mistakes.messages.push_back(contacts.error().text());
  for (const double nu : options.poisson_ratios)
    if (!(nu >= 0.0 && nu < 0.5))
      mistakes.messages.push_back(
          fmt::format("--poisson: found {:g}, expected from 0 to below 0.5", nu));
  // Beyond, cells would leave the touchable zone.
  const double widest = std::min(options.touchable_zone, 1.0) - 0.35;
  for (const double a : options.radii)
    if (!(a > 0.0 && a <= widest))
      mistakes.messages.push_back(fmt::format(
          "--a: found {:g}, expected a contact radius over R above 0 and at most {:g}", a, widest));
  check_bodies_named(options.formulations, options.nodes, mistakes);
  if (mistakes.messages.empty()) return {};
  return std::unexpected(mistakes);
}

Result<void> run_cases(Bench& bench) {
  const HemisphereBenchOptions& options = bench.options;
  const auto contacts = contacts_of(options.contacts);
  if (!contacts) return std::unexpected(contacts.error());
  const bool named = options.names_cases(), quick = options.quick;
  const auto formulations = or_default(options.formulations, formulation_names());
  const auto all_nodes = or_default<std::size_t>(
      options.nodes, named || quick ? std::vector<std::size_t>{kNodesToReach}
                                    : std::vector<std::size_t>{500, kNodesToReach, 2200, 4400});
  const auto ratios = or_default<double>(options.poisson_ratios, {0.30, 0.45, 0.49});
  const auto radii = or_default<double>(
      options.radii, quick ? std::vector{0.1, 0.2} : std::vector{0.1, 0.15, 0.2, 0.25, 0.3});
  print_heading(bench.out);
  for (const std::string& name : formulations) {
    if (const auto warning = find_formulation(name)->warning(); !warning.empty())
      bench.out << name << ": " << warning << '\n';
    for (const double nu : ratios) {
      for (const std::size_t nodes : all_nodes) {
        HemisphereOptions wanted;
        wanted.formulation = name;
        wanted.poisson_ratio = nu;
        wanted.nodes = nodes;
        wanted.fine_zone = options.graded ? 0.3 : 0.0;
        wanted.touchable_zone = options.touchable_zone;
        auto body = prepare_median(wanted, !quick && nodes < 1500 ? 3 : 1);
        if (interrupted()) return failure(kCancelled);
        if (!body) {
          if (named && formulations.size() == 1) return std::unexpected(body.error());
          bench.out << fmt::format("{:<21}{:>5.2f}{:>7}  refused: {}\n", name, nu, nodes,
                                   body.error().text());
          bench.refused.push_back({name, nu, nodes, body.error().text()});
          continue;
        }
        for (const HemisphereContact contact : *contacts) {
          for (const double a : radii) {
            const HemisphereCase one = measure(**body, contact, a, bench.references);
            bench.add(one);
            if (options.peers && contact == HemisphereContact::kStick)
              bench.add(measure_pinned(**body, a, one, bench.references));
            if (interrupted()) return failure(kCancelled);
          }
        }
      }
    }
  }
  return {};
}

}  // namespace

Result<void> bench_hemisphere(const HemisphereBenchOptions& options, std::ostream& out) {
  if (auto sound = check_options(options); !sound) return sound;
  auto references = read_hemisphere_references(assets_folder() / "reference/hemisphere");
  if (!references) return std::unexpected(references.error());
  Bench bench{options, out, {std::move(*references), {}}, {}, {}, {}};
  if (auto done = run_cases(bench); !done) return done;
  if (options.peers) {
    const auto peers = measure_peers(
        or_default<double>(options.poisson_ratios,
                           options.quick ? std::vector{0.45} : std::vector{0.30, 0.45, 0.49}),
        or_default<double>(options.radii, {0.2}), options.quick, bench.references.data,
        [&](HemisphereCase one) { bench.add(std::move(one)); }, out);
    if (!peers) return peers;
  }
  if (!bench.references.own.empty())
    out << "* against our own axisymmetric solution: the data holds no reference\n";
  if (!options.names_cases()) {
    auto rows = hemisphere_rows(bench.cases, bench.refused, options.quick);
    if (!rows) return std::unexpected(rows.error());
    bench.rows = std::move(*rows);
    out << '\n';
    const MachineReport machine = this_machine();
    print_rows(bench.rows, fmt::format("{} cores of {}", machine.cores, machine.cpu), out);
    if (options.quick)
      out << "left out by --quick: the main scene on half its node spacing, preparations of 11,600 "
             "and 30,000 nodes, radii .15, .25 and .3 R\n";
  }
  if (!options.plots.empty()) {
    if (auto drawn = draw_hemisphere_plots(bench.cases, bench.references.data, options.plots);
        !drawn)
      return drawn;
  }
  if (options.json.empty()) return {};
  nlohmann::json json = {{"machine", this_machine().cpu},
                         {"cores", this_machine().cores},
                         {"cases", nlohmann::json::array()},
                         {"skipped", nlohmann::json::array()},
                         {"rows", to_json(bench.rows)}};
  for (const RefusedHemisphere& one : bench.refused)
    json["skipped"].push_back({{"formulation", one.formulation},
                               {"poisson", one.poisson},
                               {"nodes", one.nodes},
                               {"reason", one.reason}});
  for (const HemisphereCase& one : bench.cases) json["cases"].push_back(to_json(one));
  return write_file(options.json, json.dump(2) + "\n");
}

}  // namespace viscera
