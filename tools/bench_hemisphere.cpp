#include "tools/bench_hemisphere.h"

#include <fmt/format.h>
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <ostream>

#include "engine/io/atomic_file.h"
#include "engine/io/interrupt.h"
#include "engine/io/report.h"
#include "engine/scene/load_scene.h"
#include "engine/verification/axisymmetric_hemisphere.h"
#include "engine/verification/hemisphere_body.h"
#include "kernels/base/random.h"
#include "tools/bench_plots.h"
#include "tools/peers/peer_cases.h"
#include "tools/project_paths.h"
#include "tools/scene_accuracy.h"

namespace viscera {
namespace fs = std::filesystem;
namespace {

/// Rings of cells that cover the contact patch: 5 are 91 cells, and 2 the 19 of the paper's size.
constexpr int kRings = 5;
constexpr int kSmallPatchRings = 2;
/// Errors are to be reached with this many nodes at most.
constexpr std::size_t kNodesToReach = 1100;

constexpr double kForceUnit =
    kHemisphereModulus * kHemisphereRadius * kHemisphereRadius * kHemisphereDepth;  // [N]

/// What a case is to reach; nothing where no target is set.
struct Targets {
  std::optional<double> force, profile, prepare_s;
};

Targets targets_of(const HemisphereCase& one) {
  Targets targets;
  const bool ours = one.formulation == "galerkin" || one.formulation == "galerkin_quadratic";
  if (!ours || one.nodes > kNodesToReach) return targets;
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

std::optional<double> any_force_error(const HemisphereCase& one) {
  return one.force_error ? one.force_error : one.own_force_error;
}
std::optional<double> any_profile_error(const HemisphereCase& one) {
  return one.profile_error ? one.profile_error : one.own_profile_error;
}

/// "force 3 %, preparation 1 s" of what misses its target, "met" where all do, "" without targets.
std::string verdict(const HemisphereCase& one) {
  const Targets targets = targets_of(one);
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

void print_heading(std::ostream& out) {
  out << fmt::format("{:<21}{:>5}{:>7}{:>6}  {:<13}{:>9}{:>11}{:>11}{:>9}{:>9}\n", "hemisphere",
                     "nu", "nodes", "a/R", "contact", "prepare s", "online us", "moving us",
                     "force", "profile");
}

void print_case(const HemisphereCase& one, std::ostream& out) {
  const std::string name =
      one.variant.empty() ? one.formulation : fmt::format("{} {}", one.formulation, one.variant);
  out << fmt::format("{:<21}{:>5.2f}{:>7}{:>6.2f}  {:<13}{:>9.3g}{:>11}{:>11}{:>9}{:>9}{} {}\n",
                     name, one.poisson, one.nodes, one.a_over_R, one.contact, one.prepare_s,
                     microseconds(one.online_us), microseconds(one.online_moving_us),
                     percent(any_force_error(one), true), percent(any_profile_error(one), false),
                     one.own_profile_error ? "*" : " ", verdict(one))
      << std::flush;
}

template <class T>
nlohmann::json or_null(const std::optional<T>& value) {
  return value ? nlohmann::json(*value) : nlohmann::json(nullptr);
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
                         {"assemble_s", or_null(one.assemble_s)},
                         {"factor_s", or_null(one.factor_s)},
                         {"compliance_s", or_null(one.compliance_s)},
                         {"online_us", or_null(one.online_us)},
                         {"online_moving_us", or_null(one.online_moving_us)},
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

/// Median times of contact and displacement on one core [us].
struct OnlineTimes {
  double still = 0.0;   ///< the same patch again and again
  double moving = 0.0;  ///< a patch that slides along the dome
};

OnlineTimes measure_online(HemisphereBody& body, HemisphereContact contact, double a_over_R,
                           int rings) {
  constexpr double kFor = 0.15;
  const oneapi::tbb::global_control one_core(oneapi::tbb::global_control::max_allowed_parallelism,
                                             1);
  std::vector<float> unknowns;
  OnlineTimes times;
  if (contact == HemisphereContact::press) {
    const HemispherePressure load = body.pressure(a_over_R);
    times.still =
        1e6 * median_call_s(
                  [&] { displacement_unknowns(body.compliance(), load.response, unknowns); }, kFor);
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
    body.contact().displacement_unknowns(unknowns);
    at = (at + stride) % patches.size();
  };
  times.still = 1e6 * median_call_s([&] { step(0); }, kFor);
  times.moving = 1e6 * median_call_s([&] { step(1); }, kFor);
  return times;
}

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
  one.basis = body.formulation().basis() == Basis::quadratic ? "quadratic" : "linear";
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
  const bool pressed = contact == HemisphereContact::press;
  const HemisphereAnswer answer = body.press(contact, a_over_R, kRings);
  if (!answer.converged) {
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

Progress until_interrupted() {
  return [](double, std::string_view) { return !interrupted(); };
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
  nlohmann::json skipped = nlohmann::json::array();

  void add(HemisphereCase one) {
    print_case(one, out);
    cases.push_back(std::move(one));
  }
};

template <class T>
std::vector<T> or_default(const std::vector<T>& named, std::vector<T> otherwise) {
  return named.empty() ? std::move(otherwise) : named;
}

Result<void> check_options(const HemisphereBenchOptions& options) {
  Error mistakes;
  for (const std::string& name : options.formulations)
    if (!find_formulation(name))
      mistakes.messages.push_back(fmt::format("--formulation: found \"{}\", expected one of {}",
                                              name, fmt::join(formulation_names(), ", ")));
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
  for (const std::size_t nodes : options.nodes)
    if (nodes < 50 || nodes > 200'000)
      mistakes.messages.push_back(
          fmt::format("--nodes: found {}, expected from 50 to 200000", nodes));
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
          bench.skipped.push_back({{"formulation", name},
                                   {"poisson", nu},
                                   {"nodes", nodes},
                                   {"reason", body.error().text()}});
          continue;
        }
        for (const HemisphereContact contact : *contacts) {
          for (const double a : radii) {
            bench.add(measure(**body, contact, a, bench.references));
            if (interrupted()) return failure(kCancelled);
          }
        }
      }
    }
  }
  return {};
}

/// The paper's size: 1,026 nodes, equally spaced, a patch of 19.
Result<void> add_online_rows(Bench& bench) {
  HemisphereOptions options;
  options.nodes = 1026;
  auto body = HemisphereBody::prepare(options, until_interrupted());
  if (!body) return std::unexpected(body.error());
  const OnlineTimes times = measure_online(**body, HemisphereContact::stick, 0.2, kSmallPatchRings);
  const std::string what =
      fmt::format("online, {} nodes, 19 cells, one core", (*body)->cloud().size());
  bench.rows.push_back({what + ", resting patch", "us", times.still, 40.0});
  bench.rows.push_back({what + ", moving patch", "us", times.moving, 40.0});
  return {};
}

/// Loads spread over a matrix that no cache holds, elsewhere each time.
void add_bandwidth_row(Bench& bench) {
  constexpr int kVisible = 14000, kTouchable = 1500, kTouched = 60;
  SurfaceCompliance compliance;
  for (int i = 0; i < kVisible; ++i) compliance.visible.push_back(i);
  for (int i = 0; i < kTouchable; ++i) compliance.touchable.push_back(i);
  compliance.columns.assign(compliance.rows() * 3 * kTouchable, 1e-3f);
  const Random random(1, 0);
  std::uint64_t draw = 0;
  ContactResponse response;
  response.touched.resize(kTouched);
  response.loads.assign(kTouched, Vec3(1.0, -0.5, 0.25));
  std::vector<float> unknowns;
  const double seconds = median_call_s(
      [&] {
        // One node out of each of kTouched equal parts: ascending, and fresh ones every time.
        for (int i = 0; i < kTouched; ++i)
          response.touched[static_cast<std::size_t>(i)] =
              (i * kTouchable + static_cast<int>(random.uniform(draw++) * kTouchable)) / kTouched;
        displacement_unknowns(compliance, response, unknowns);
      },
      1.0);
  const double bytes = 4.0 * static_cast<double>(compliance.rows()) * 3 * kTouched;
  const double machine = read_bandwidth();
  bench.rows.push_back(
      {fmt::format("read bandwidth of C_un f, of the machine's {:.1f} GB/s", 1e-9 * machine), "%",
       100.0 * bytes / seconds / machine, 60.0, true});
}

/// A preparation by a process of its own, whose peak memory is that of nothing else.
Result<void> add_large_rows(Bench& bench, const fs::path& scratch) {
  struct Large {
    std::string what;
    std::size_t nodes;
    double touchable_zone, seconds, gigabytes;
  };
  // A fifth of the whole surface, base included, is the cap within 0.714 R: 2 pi (1 - cos) = 3 pi
  // / 5.
  for (const Large& large : {Large{"full surface compliance", 11600, 1.0, 20.0, 1.0},
                             Large{"compliance of a touchable fifth", 30000, 0.714, 90.0, 4.0}}) {
    const fs::path json = scratch / "large.json";
    const CommandResult done = run_program(
        {"/proc/self/exe", "bench", "hemisphere", "--nodes", std::to_string(large.nodes),
         "--touchable-zone", fmt::format("{}", large.touchable_zone), "--a", "0.2", "--poisson",
         "0.45", "--formulation", "galerkin", "--contact", "press", "--quick", "--json",
         json.string()});
    if (interrupted()) return failure(kCancelled);
    if (done.code != 0) {
      bench.out << fmt::format("{} nodes, {}: failed with code {}\n", large.nodes, large.what,
                               done.code);
      continue;
    }
    std::ifstream file(json);
    const auto found = nlohmann::json::parse(file, nullptr, false);
    if (!found.is_object() || found["cases"].empty()) continue;
    const auto& one = found["cases"][0];
    const std::string what =
        fmt::format("{} nodes, {}", one["nodes"].get<std::size_t>(), large.what);
    bench.rows.push_back({what + ", no cache", "s", one["prepare_s"], large.seconds});
    bench.rows.push_back({what + ", peak memory", "GB",
                          1e-9 * static_cast<double>(done.peak_memory_bytes), large.gigabytes});
  }
  return {};
}

/// The main scene against itself on half the node spacing.
Result<void> add_scene_rows(Bench& bench) {
  const fs::path file = scenes_folder() / "laparoscopic_cautery.json";
  SceneLoadOptions load;
  load.assets = assets_folder();
  const auto scene = load_scene(file, load);
  const auto tissues = load_tissues(load.assets / "tissues.json");
  if (!scene || !tissues) {
    bench.out << (scene ? tissues.error() : scene.error()).text() << '\n';
    return {};
  }
  const auto accuracy = compare_with_half_spacing(*scene, *tissues);
  if (interrupted()) return failure(kCancelled);
  if (!accuracy) {
    bench.out << "main scene on half the spacing: " << accuracy.error().text() << '\n';
    return {};
  }
  bench.rows.push_back({"main scene: tool forces against half the node spacing", "%",
                        100.0 * accuracy->force_error, 5.0});
  bench.rows.push_back({"main scene: organs' shapes against half the node spacing", "%",
                        100.0 * accuracy->profile_error, 5.0});
  return {};
}

/// The worst of each error that has a target, over all cases with a reference.
void add_error_rows(Bench& bench) {
  for (const std::string& name : formulation_names()) {
    if (!name.starts_with("galerkin")) continue;
    const auto worst = [&](const std::string& what, auto applies, auto value, double target) {
      double most = -1.0;
      for (const HemisphereCase& one : bench.cases) {
        if (one.formulation != name || one.nodes > kNodesToReach ||
            10 * one.nodes < 9 * kNodesToReach)
          continue;
        const std::optional<double> error = value(one);
        if (applies(one) && error) most = std::max(most, std::abs(*error));
      }
      if (most >= 0.0)
        bench.rows.push_back({fmt::format("{}, at most 1,100 nodes: worst {}", name, what), "%",
                              100.0 * most, target});
    };
    const auto force = [](const HemisphereCase& one) { return any_force_error(one); };
    const auto profile = [](const HemisphereCase& one) { return any_profile_error(one); };
    const auto soft = [](const HemisphereCase& one) { return one.poisson < 0.451; };
    worst(
        "pressure profile, nu .30 and .45",
        [&](const auto& one) { return soft(one) && one.contact == "press"; }, profile, 2.0);
    worst("reaction, stick or frictionless, nu .30 and .45", soft, force, 3.0);
    worst(
        "stick profile, nu .30 and .45",
        [&](const auto& one) { return soft(one) && one.contact == "stick"; }, profile, 4.0);
    worst(
        "reaction, nu .49", [&](const auto& one) { return !soft(one); }, force, 10.0);
  }
}

}  // namespace

Result<void> bench_hemisphere(const HemisphereBenchOptions& options, std::ostream& out) {
  if (auto sound = check_options(options); !sound) return sound;
  auto references = read_hemisphere_references(assets_folder() / "reference/hemisphere");
  if (!references) return std::unexpected(references.error());
  Bench bench{options, out, {std::move(*references), {}}, {}, {}};
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
    add_error_rows(bench);
    if (auto done = add_online_rows(bench); !done) return done;
    add_bandwidth_row(bench);
    if (!options.quick) {
      auto scratch = ScratchFolder::create();
      if (!scratch) return std::unexpected(scratch.error());
      if (auto done = add_scene_rows(bench); !done) return done;
      if (auto done = add_large_rows(bench, (*scratch)->path()); !done) return done;
    }
    out << '\n';
    const MachineReport machine = this_machine();
    print_rows(bench.rows, fmt::format("{} cores of {}", machine.cores, machine.cpu), out);
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
                         {"skipped", bench.skipped},
                         {"rows", to_json(bench.rows)}};
  for (const HemisphereCase& one : bench.cases) json["cases"].push_back(to_json(one));
  return write_file(options.json, json.dump(2) + "\n");
}

}  // namespace viscera
