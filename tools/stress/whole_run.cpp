#include "tools/stress/whole_run.h"

#include <fmt/format.h>
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <set>

#include "engine/features/cautery/cautery.h"
#include "engine/features/contact/contact.h"
#include "engine/features/contact/contact_flags.h"
#include "engine/features/deformation/deformation_flags.h"
#include "engine/features/free_bodies/free_bodies.h"
#include "engine/features/parting/parting.h"
#include "engine/features/smoke/smoke.h"
#include "engine/simulation/sentinel.h"
#include "engine/simulation/state_type.h"
#include "engine/simulator/simulation.h"
#include "kernels/base/caught.h"
#include "kernels/base/finite.h"
#include "kernels/parting/carve.h"
#include "kernels/parting/void_surface.h"
#include "tools/common/project_paths.h"
#include "tools/stress/cut_scene.h"
#include "tools/stress/whole_bodies.h"
#include "tools/stress/whole_scene.h"

namespace viscera {
namespace {

/// Masses of particles are single precision, and added up particle by particle.
constexpr double kSmokeResidual = 1e-4;
/// The bound of the feature's own test (engine/features/cautery/cautery_report_test.cpp).
constexpr double kHeatResidual = 0.01;
/// Points of a cut body have the volume of what its surface encloses, and that with what is gone
/// has the whole one's; over the latter.
constexpr double kMassResidual = 1e-6;
/// Steps whose contact may find no forces, and where jaws leap by centimetres or tissue was turned
/// inside out; chosen by eye. A jaw and a stiff link that part by 50 mm ask for kilonewtons.
constexpr double kNotConverged = 0.05, kNotConvergedAbused = 0.25;

/// One simulation to the scene's end.
struct Course {
  std::string hash;
  FlagSet flags;
  std::uint64_t not_converged = 0;           ///< steps
  std::optional<std::uint64_t> tissue_lost;  ///< the first frame after which it was
  std::vector<std::string> failures;
};

void look_at(const Simulation& simulation, const StepReport& report, Course& course) {
  course.flags.raise(report.flags);
  course.not_converged += report.has(kContactNotConverged);
  if (!course.tissue_lost && report.has(kTissueLost)) course.tissue_lost = simulation.frame();
  for (const std::string& stray : report.strays)
    course.failures.push_back(fmt::format("frame {}: {}", simulation.frame(), stray));
  const World& world = simulation.world();
  for (const StateType& type : world.state_types())
    if (type.strays.become != Strays::Become::kUnwatched)
      for (const auto& [owner, stray] : type.first_strays(world.states_of(type)))
        course.failures.push_back(fmt::format("frame {}: {}: found {} = {}", simulation.frame(),
                                              type.name, stray.field, stray.value));
}

/// Some nodes of each organ at finite strain are put where its tissue is inside out.
void turn_inside_out(World& world) {
  Pool<OrganTouch>& touches = world.all<OrganTouch>();
  for (std::size_t t = 0; t < touches.size(); ++t) {
    const Entity organ = touches.owner(t);
    const OrganModel& model = *world.find<OrganBody>(organ)->model;
    if (!model.finite) continue;
    TissueContact& tissue = *touches[t].solver;
    auto state = tissue.state();
    // Two spacings to and fro: farther than the nodes about it.
    constexpr double kSpacings = 2.0;
    for (std::size_t node = 0; node < model.cloud.size(); node += 17)
      for (std::size_t c = 0; c < 3; ++c)
        state.motion.displacements[3 * node + c] +=
            kSpacings * model.cloud.spacings[node] * ((node / 17 + c) % 2 == 0 ? 1.0 : -1.0);
    tissue.restore(std::move(state));
  }
}

/// Surfaces are looked at every so many frames.
constexpr std::uint64_t kLookEvery = 4;

/// How much of a body lies in what is gone, by what of that lies outside of the body [m3].
Result<double> taken_from(const TriangleSurface& body, const TriangleSurface& gone) {
  const auto outside = carve(gone, body);
  if (!outside) return std::unexpected(outside.error());
  return volume(gone) - volume(outside->surface);
}

/// What is asked of bodies that touch, along one course.
class BodyChecks {
 public:
  BodyChecks(const World& world, const WholeScene& scene) : scene_(scene), insides_(world) {}

  void look(const Simulation& simulation) {
    const std::uint64_t frame = simulation.frame();
    const World& world = simulation.world();
    // Tissue that was turned inside out has no inside.
    const bool sound = !scene_.inverted_at || frame <= *scene_.inverted_at;
    if (sound && frame % kLookEvery == 0)
      if (const auto now = insides_.deepest(world); now.depth > deepest_.depth) {
        deepest_ = now;
        deepest_at_ = frame;
      }
    look_at_cuts(world);
    if (scene_.still_from && frame > *scene_.still_from && !parts_still(world))
      energy_.add(frame, energy_of(world));
  }
  void tell(WholeOutcome& outcome) const {
    outcome.deepest_inside = deepest_.depth;
    if (deepest_.depth > kMostInside)
      outcome.failures.push_back(
          fmt::format("frame {}: {} lies {:.1f} mm inside, expected at most {:.1f} mm more than at "
                      "rest",
                      deepest_at_, deepest_.what, 1e3 * deepest_.depth, 1e3 * kMostInside));
    if (energy_.failure()) outcome.failures.push_back(*energy_.failure());
    outcome.bodies = bodies_;
    outcome.mass_residual = mass_residual_;
    outcome.cuts_refused = refusals_;
    if (!(mass_residual_ < kMassResidual))
      outcome.failures.push_back(
          fmt::format("a cut body's points, its surface, and what is gone differ by {:.1e} of the "
                      "whole body, expected at most {:.0e}",
                      mass_residual_, kMassResidual));
    for (const std::string& why : untold_)
      outcome.failures.push_back("what a cut took can't be told: " + why);
  }

 private:
  /// Whether an organ is still to become what is left of it.
  static bool parts_still(const World& world) {
    const Pool<OrganCut>& cuts = world.all<OrganCut>();
    for (std::size_t c = 0; c < cuts.size(); ++c)
      if (cuts[c].pending || cuts[c].changed) return true;
    return false;
  }

  void look_at_cuts(const World& world) {
    const Pool<OrganCut>& cuts = world.all<OrganCut>();
    std::uint64_t bodies = 0;
    for (std::size_t c = 0; c < cuts.size(); ++c) {
      bodies += cuts[c].bodies;
      const Entity organ = cuts.owner(c);
      if (const std::string& why = world.find<OrganLeft>(organ)->refusal; !why.empty())
        refusals_.insert(why);
    }
    if (bodies == bodies_) return;
    bodies_ = bodies;
    for (std::size_t c = 0; c < cuts.size(); ++c) {
      const Entity organ = cuts.owner(c);
      const OrganModel& model = *world.find<OrganBody>(organ)->model;
      const CuttableOrgan& before = *world.find<Cuttable>(organ)->organ;
      const double whole = volume(before.whole->surface), left = volume(model.surface);
      mass_residual_ =
          std::max(mass_residual_, std::abs(model.finite->body().volume() - left) / whole);
      if (cuts[c].used.untouched()) continue;
      const TriangleSurface gone = plain_void_surface(cuts[c].used, before.organ.resolution.finest);
      const auto taken = taken_from(before.whole->surface, gone);
      if (!taken) {
        untold_.insert(taken.error().text());
        continue;
      }
      const OrganLeft& made = *world.find<OrganLeft>(organ);
      const double apart = made.crumbs + made.removed;
      mass_residual_ = std::max(mass_residual_, std::abs(left + apart + *taken - whole) / whole);
    }
  }

  const WholeScene& scene_;
  Insides insides_;
  Insides::Deepest deepest_;
  std::uint64_t deepest_at_ = 0;
  EnergyWatch energy_;
  std::uint64_t bodies_ = 0;
  double mass_residual_ = 0.0;
  std::set<std::string> refusals_, untold_;
};

/// Controls with a number that isn't finite are refused and change nothing.
void try_impossible_controls(Simulation& simulation, Course& course) {
  Controls controls = simulation.path_controls();
  if (controls.tools.empty()) return;
  const std::string before = simulation.hash();
  controls.tools[0].tip.y() = std::numeric_limits<double>::quiet_NaN();
  if (simulation.step(controls)) course.failures.push_back("controls with NaN were stepped");
  if (simulation.hash() != before) course.failures.push_back("refused controls changed the state");
}

/// `fault`: the last frame leaves a number that isn't finite.
void step_to_end(Simulation& simulation, const WholeScene& scene, Course& course,
                 bool fault = false, BodyChecks* checks = nullptr) {
  while (simulation.frame() < scene.frames) {
    if (scene.inverted_at == simulation.frame()) turn_inside_out(simulation.world());
    const StepReport report = simulation.step();
    if (fault && simulation.frame() == scene.frames)
      simulation.world().all<OrganState>()[0].positions[0].x() =
          std::numeric_limits<float>::quiet_NaN();
    look_at(simulation, report, course);
    if (checks) checks->look(simulation);
  }
  course.hash = simulation.hash();
}

/// An organ that nothing holds takes a step back that begins inside out, and says so.
bool loses_tissue_by_design(const Course& course, const World& world, const WholeScene& scene) {
  return scene.inverted_at && course.tissue_lost > *scene.inverted_at && world.has<FreeBody>();
}

/// Whether the scene has what may raise a flag.
bool is_explained(const FrameFlag& flag, const Course& course, const World& world,
                  const WholeScene& scene) {
  if (flag.name == kNotFinite.name || flag.name == kOrganFrozen.name) return false;
  if (flag.name == kTissueLost.name) return loses_tissue_by_design(course, world, scene);
  if (flag.name.starts_with("smoke")) return world.has<SmokeBody>();
  if (flag.name.starts_with("grip"))
    return std::ranges::any_of(world.model().scene().instruments, [](const auto& tool) {
      return tool.kind == InstrumentKind::kGrasper;
    });
  if (flag.name == kHeatFull.name || flag.name == kNotHeated.name) return world.has<BurnTrace>();
  return true;
}

void check_books(const World& world, WholeOutcome& outcome) {
  const SmokeFigures smoke = smoke_figures(world);
  if (smoke.emitted > 0.0) {
    const double told =
        smoke.airborne + smoke.background + smoke.evacuated + smoke.leaked + smoke.deposited;
    outcome.smoke_residual = std::abs(smoke.emitted - told) / smoke.emitted;
    if (!(outcome.smoke_residual < kSmokeResidual))
      outcome.failures.push_back(
          fmt::format("smoke's book is off by {:.1e} of what was emitted", outcome.smoke_residual));
  }
  if (const auto heat = cautery_figures(world)) {
    outcome.heat_residual = std::abs(heat->residual);
    if (!(outcome.heat_residual < kHeatResidual))
      outcome.failures.push_back(
          fmt::format("heat's book is off by {:.1e} of what was delivered", outcome.heat_residual));
  }
}

Result<void> step_case(const WholeScene& scene, const Model& model, bool fault,
                       WholeOutcome& outcome) {
  Course one, two, resumed;
  std::optional<Snapshot> snapshot;
  std::optional<Simulation> whole;
  const auto compare = [&](const Simulation& other, Course& course, const std::string& who) {
    if (course.hash != one.hash)
      course.failures.push_back(who + " to another hash; the first difference: " +
                                whole->world().state_difference(other.world()));
  };
  {
    const oneapi::tbb::global_control by_one(oneapi::tbb::global_control::max_allowed_parallelism,
                                             1);
    auto simulation = Simulation::create(model);
    if (!simulation) return std::unexpected(simulation.error());
    BodyChecks checks(simulation->world(), scene);
    while (simulation->frame() < scene.snapshot_at) {
      look_at(*simulation, simulation->step(), one);
      checks.look(*simulation);
    }
    auto taken = simulation->snapshot();
    if (!taken) return std::unexpected(taken.error());
    snapshot = std::move(*taken);
    try_impossible_controls(*simulation, one);
    step_to_end(*simulation, scene, one, false, &checks);
    checks.tell(outcome);
    check_books(simulation->world(), outcome);
    for (const FrameFlag& flag : one.flags)
      if (!is_explained(flag, one, simulation->world(), scene))
        one.failures.push_back(fmt::format("nothing explains the flag {}", flag.name));
    whole.emplace(*std::move(simulation));
  }
  const oneapi::tbb::global_control by_two(oneapi::tbb::global_control::max_allowed_parallelism, 2);
  {
    auto simulation = Simulation::create(model);
    if (!simulation) return std::unexpected(simulation.error());
    step_to_end(*simulation, scene, two, fault);
    compare(*simulation, two, "two threads come");
  }
  {
    auto simulation = Simulation::create(model);
    if (!simulation) return std::unexpected(simulation.error());
    if (auto restored = simulation->restore(*snapshot); !restored) return restored;
    step_to_end(*simulation, scene, resumed);
    compare(*simulation, resumed,
            fmt::format("from the snapshot at frame {} it comes", scene.snapshot_at));
  }
  for (const std::string_view name : one.flags.names()) outcome.flags.emplace_back(name);
  for (const Course* course : {&one, &two, &resumed})
    outcome.failures.insert(outcome.failures.end(), course->failures.begin(),
                            course->failures.end());
  if (static_cast<double>(one.not_converged) >
      (scene.abused ? kNotConvergedAbused : kNotConverged) * static_cast<double>(scene.frames) + 1)
    outcome.failures.push_back(
        fmt::format("contact found no forces in {} of {} steps", one.not_converged, scene.frames));
  return {};
}

}  // namespace

WholeOutcome run_whole_case(const WholeCase& whole, const std::filesystem::path& folder) {
  WholeOutcome outcome{.number = whole.number};
  const auto done = caught([&]() -> Result<void> {
    const auto write = whole.cuts ? write_cut_scene : write_whole_scene;
    const auto scene = write(whole.seed, whole.number, folder);
    if (!scene) return std::unexpected(scene.error());
    outcome.description = scene->description;
    const auto model = Model::load(scene->file, {.assets = assets_folder(), .use_cache = false});
    if (!model) {
      outcome.refused = model.error().text();
      return {};
    }
    return step_case(*scene, *model, whole.fault, outcome);
  });
  if (!done) outcome.failures.push_back(done.error().text());
  return outcome;
}

}  // namespace viscera
