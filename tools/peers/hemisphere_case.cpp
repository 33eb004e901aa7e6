#include "tools/peers/hemisphere_case.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <ostream>

namespace viscera {
namespace {

/// What a case is to reach; nothing where no target is set.
struct Targets {
  std::optional<double> force, profile, prepare_s;
};

Targets targets_of(const HemisphereCase& one) {
  Targets targets;
  const bool ours = one.formulation == "galerkin" || one.formulation == "galerkin_quadratic";
  if (!ours || !one.variant.empty() || one.nodes > kNodesToReach) return targets;
  const bool nearly_incompressible = one.poisson > 0.451;
  if (one.contact == "press") {
    if (!nearly_incompressible) targets.profile = 0.02;
  } else {
    targets.force = nearly_incompressible ? 0.10 : 0.03;
    if (one.contact == "stick" && !nearly_incompressible) targets.profile = 0.04;
  }
  if (one.basis == "linear") targets.prepare_s = 1.0;
  return targets;
}

/// "force 3 %, preparation 1 s" of what misses its target, "met" where all do, "" without targets.
std::string verdict(const HemisphereCase& one) {
  const Targets targets = targets_of(one);
  if (!one.converged && (targets.force || targets.profile)) return "NOT MET: " + one.note;
  std::vector<std::string> missed;
  bool any = false;
  const auto check = [&](const std::optional<double>& value, const std::optional<double>& target,
                         std::string_view what, double scale, std::string_view unit) {
    if (!value || !target) return;
    any = true;
    if (!(std::abs(*value) <= *target))
      missed.push_back(fmt::format("{} {:g} {}", what, scale * *target, unit));
  };
  check(any_force_error(one), targets.force, "force", 100.0, "%");
  check(any_profile_error(one), targets.profile, "profile", 100.0, "%");
  check(one.prepare_s, targets.prepare_s, "preparation", 1.0, "s");
  if (!missed.empty()) return fmt::format("NOT MET: {}", fmt::join(missed, ", "));
  return any ? "met" : "";
}

std::string percent(const std::optional<double>& value, bool sign) {
  if (!value) return "-";
  return sign ? fmt::format("{:+.1f} %", 100.0 * *value) : fmt::format("{:.1f} %", 100.0 * *value);
}

std::string microseconds(const std::optional<double>& value) {
  return value ? fmt::format("{:.1f}", *value) : "-";
}

template <class T>
nlohmann::json or_null(const std::optional<T>& value) {
  return value ? nlohmann::json(*value) : nlohmann::json(nullptr);
}

}  // namespace

std::optional<double> any_force_error(const HemisphereCase& one) {
  return one.force_error ? one.force_error : one.own_force_error;
}

std::optional<double> any_profile_error(const HemisphereCase& one) {
  return one.profile_error ? one.profile_error : one.own_profile_error;
}

double first_answer_s(const HemisphereCase& one) {
  return one.prepare_s + one.more_s + 1e-6 * one.online_us.value_or(0.0);
}

void print_heading(std::ostream& out) {
  out << fmt::format("{:<29}{:>5}{:>7}{:>6}  {:<13}{:>9} {:<10}{:>11}{:>11}{:>11}{:>9}{:>9}\n",
                     "hemisphere", "nu", "nodes", "a/R", "contact", "prepare s", "for",
                     "one load us", "moving us", "own us", "force", "profile");
}

void print_case(const HemisphereCase& one, std::ostream& out) {
  const std::string name =
      one.variant.empty() ? one.formulation : fmt::format("{} {}", one.formulation, one.variant);
  out << fmt::format(
             "{:<29}{:>5.2f}{:>7}{:>6.2f}  {:<13}{:>9.3g} {:<10}{:>11}{:>11}{:>11}{:>9}{:>9}{} "
             "{}\n",
             name, one.poisson, one.nodes, one.a_over_R, one.contact, one.prepare_s, one.prepares,
             microseconds(one.online_us), microseconds(one.online_moving_us),
             microseconds(one.own_us), percent(any_force_error(one), true),
             percent(any_profile_error(one), false), one.own_profile_error ? "*" : " ",
             verdict(one))
      << std::flush;
}

nlohmann::json to_json(const HemisphereCase& one) {
  nlohmann::json json = {{"formulation", one.formulation},
                         {"basis", one.basis},
                         {"nodes", one.nodes},
                         {"surface_nodes", one.surface_nodes},
                         {"poisson", one.poisson},
                         {"a_over_R", one.a_over_R},
                         {"contact", one.contact},
                         {"cells", one.cells},
                         {"prepare_s", one.prepare_s},
                         {"prepares", one.prepares},
                         {"first_answer_s", first_answer_s(one)},
                         {"assemble_s", or_null(one.assemble_s)},
                         {"factor_s", or_null(one.factor_s)},
                         {"compliance_s", or_null(one.compliance_s)},
                         {"online_us", or_null(one.online_us)},
                         {"online_moving_us", or_null(one.online_moving_us)},
                         {"own_us", or_null(one.own_us)},
                         {"force_over_ERdelta", or_null(one.force_over_ERdelta)},
                         {"force_error", or_null(one.force_error)},
                         {"profile_error", or_null(one.profile_error)},
                         {"own_reference",
                          {{"force_error", or_null(one.own_force_error)},
                           {"profile_error", or_null(one.own_profile_error)}}},
                         {"compliance_eigenvalue", one.compliance_eigenvalue},
                         {"smallest_eigenvalue", or_null(one.smallest_eigenvalue)},
                         {"memory_bytes", one.memory_bytes},
                         {"factor_bytes", or_null(one.factor_bytes)}};
  if (!one.variant.empty()) json["variant"] = one.variant;
  if (!one.note.empty()) json["note"] = one.note;
  const Targets targets = targets_of(one);
  json["targets"] = {{"force_error", or_null(targets.force)},
                     {"profile_error", or_null(targets.profile)},
                     {"prepare_s", or_null(targets.prepare_s)}};
  return json;
}

}  // namespace viscera
