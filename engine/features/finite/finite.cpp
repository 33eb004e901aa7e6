#include "engine/features/finite/finite.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "engine/features/breathing/breathing.h"
#include "engine/features/deformation/deformation_flags.h"
#include "engine/features/gravity/gravity.h"
#include "engine/features/held_tools/held_tools_keys.h"
#include "engine/features/pulsation/pulsation.h"
#include "kernels/finite/finite_solver.h"

namespace viscera {
namespace {

/// What a further iteration may gain over the energy. Chosen by eye: lifted by 30 mm, forces are
/// within a percent of converged ones below it.
constexpr double kMostResidual = 1e-3;

bool is_finite(const OrganDescription& organ) {
  return organ.response == Response::kFinite && organ.deformable;
}

/// What of the scene isn't a term of the energy yet.
void check_organ(const OrganDescription& organ,
                 const std::function<void(const std::string&)>& wrong) {
  if (organ.formulation != "galerkin")
    wrong(fmt::format("formulation: found {} with response finite, expected galerkin",
                      organ.formulation));
  if (organ.displacement_storage == DisplacementStorage::kHalf)
    wrong(
        "displacement_storage: found half with response finite, expected single: no "
        "displacements are stored");
  if (organ.material.model != HyperelasticModel::kLinear &&
      organ.material.model != HyperelasticModel::kNeoHookean)
    wrong(
        "material/model: found stvk with response finite, expected neo_hookean: stvk gives way "
        "under compression");
}

Result<void> check(const SceneDescription& scene, const std::map<std::string, Tissue>&) {
  Error mistakes;
  for (std::size_t o = 0; o < scene.organs.size(); ++o)
    if (is_finite(scene.organs[o]))
      check_organ(scene.organs[o], [&](const std::string& what) {
        mistakes.messages.push_back(fmt::format("{}: organs/{}/{}", scene.file.string(), o, what));
      });
  if (!mistakes.messages.empty()) return std::unexpected(mistakes);
  return {};
}

/// Whether auto may put an organ at finite strain, and whether it does so wherever tools go.
void reach(const SceneDescription&, const OrganDescription& organ,
           const std::vector<InstrumentBody>& instruments, Reach& reach) {
  if (organ.response != Response::kAuto || !organ.deformable) return;
  reach.may_be_finite = true;
  check_organ(organ, [&](const std::string&) { reach.may_be_finite = false; });
  reach.strained_anywhere =
      reach.strained_anywhere || organ.material.model != HyperelasticModel::kLinear ||
      organ.material.relaxes || !organ.material.prony.empty() ||
      std::ranges::any_of(instruments, [](const InstrumentBody& body) {
        return body.description.kind == InstrumentKind::kGrasper && haptic_of(body.description);
      });
}

Result<void> prepare(SceneModel& model) {
  for (std::size_t o = 0; o < model.organs().size(); ++o) {
    const auto& finite = model.constants().all<OrganBody>().find(model.organs()[o])->model->finite;
    if (!finite || finite->options().time_step == model.time_step()) continue;
    return failure(fmt::format(
        "{}: organs/{}/response: found finite prepared for steps of {:g} s, expected {:g} s",
        model.scene().file.string(), o, finite->options().time_step, model.time_step()));
  }
  return {};
}

Result<void> start(World& world) {
  const Pool<OrganBody>& bodies = world.all<OrganBody>();
  for (std::size_t o = 0; o < bodies.size(); ++o)
    if (bodies[o].model->finite) world.all<FiniteFigures>().add(bodies.owner(o), {});
  return {};
}

std::vector<ReportSection> report(const World& world) {
  const Pool<FiniteFigures>& all = world.all<FiniteFigures>();
  if (all.size() == 0) return {};
  Json list = Json::array();
  for (std::size_t o = 0; o < all.size(); ++o) {
    const FiniteFigures& one = all[o];
    list.push_back({{"organ", world.find<OrganBody>(all.owner(o))->name},
                    {"steps", one.steps},
                    {"iterations", one.iterations},
                    {"lost", one.lost},
                    {"unsettled", one.unsettled},
                    {"greatest_residual", one.greatest_residual}});
  }
  return {report_section("finite_strain", list)};
}

}  // namespace

void begin_finite_step(World& world, Entity organ) {
  if (!world.find<FiniteFigures>(organ)) return;
  const OrganSag* weight = world.find<OrganSag>(organ);
  const Pulse* pulse = world.find<Pulse>(organ);
  const HoldWays* holds = world.find<HoldWays>(organ);
  world.find<OrganTouch>(organ)->solver->begin_step(
      {.acceleration = weight ? weight->change : Vec3(Vec3::Zero()),
       .swelling = pulse ? pulse->strain : 0.0,
       .holds = holds ? holds->ways : std::vector<Vec3>(),
       .holds_before = holds ? holds->before : std::vector<Vec3>()});
}

void note_finite_step(World& world, Entity organ, FrameReport& report) {
  FiniteFigures* figures = world.find<FiniteFigures>(organ);
  const FiniteStep* step = world.find<OrganTouch>(organ)->solver->last_step();
  if (!figures || !step) return;
  ++figures->steps;
  figures->iterations += static_cast<std::uint64_t>(step->iterations);
  figures->greatest_residual = std::max(figures->greatest_residual, step->residual);
  if (step->lost) {
    ++figures->lost;
    report.raise(kTissueLost);
  }
  if (step->residual > kMostResidual) {
    ++figures->unsettled;
    report.raise(kTissueUnsettled);
  }
}

Feature finite_feature() {
  return {.name = "finite",
          .check = check,
          .reach = reach,
          .prepare = prepare,
          .start = start,
          .states = {state_type<FiniteFigures>()},
          .report = report};
}

}  // namespace viscera
