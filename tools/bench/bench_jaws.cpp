#include "tools/bench/bench_jaws.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/features/jaws/jaws.h"
#include "engine/io/interrupt.h"
#include "engine/scene/soft_ball.h"
#include "engine/simulation/frame.h"
#include "engine/simulation/prepare.h"
#include "engine/simulator/build.h"
#include "kernels/base/stopwatch.h"
#include "tools/common/bench_figures.h"
#include "tools/common/project_paths.h"

namespace viscera {
namespace {

constexpr double kPulls = 1.0, kEnds = 5.0;  // [s]
constexpr double kFarEnough = 4e-3;          // slid [m]
/// The strip bears to be pulled by what 4 N hold [Pa].
constexpr double kModulus = 200e3;

/// A strip held at its left end; jaws come from the right, close, and pull along it at 8 mm/s.
SceneDescription pulled_strip(Response response, double force) {
  SceneDescription scene = soft_ball_scene(3e-3, 3e-3);
  OrganDescription& strip = scene.organs[0];
  RecipeGeometry block;
  block.recipe = "block";
  block.size = Vec3(60e-3, 24e-3, 8e-3);
  block.edge = 2e-3;
  strip.geometry = block;
  Region left;
  left.a = Vec3(-20e-3, 0, 0);
  left.b = Vec3::UnitX();
  strip.fixed = {left};
  strip.response = response;
  scene.duration = kEnds;
  const Vec3 away(45e-3, 0, 0), at(26e-3, 0, 0);
  InstrumentDescription grasper;
  grasper.name = "grasper";
  grasper.kind = InstrumentKind::kGrasper;
  grasper.tip.radius = 2e-3;
  grasper.trocar = Vec3(0.25, 0, 0);
  grasper.grip_radius = 5e-3;
  grasper.path = {{0.0, away, 0.0, 1.0},
                  {0.3, at, 0.0, 1.0},
                  {0.4, at, 0.0, 0.0},
                  {kPulls, at, 0.0, 0.0},
                  {kEnds, at + Vec3(32e-3, 0, 0), 0.0, 0.0}};
  set_jaws(grasper, {.force = force});
  scene.instruments = {grasper};
  return scene;
}

Result<JawsSlip> pull(Response response, double force) {
  Tissue rubber;
  rubber.name = "rubber";
  rubber.elastic = {kModulus, 0.45};
  std::vector<std::string> warnings;
  auto model = build_model(pulled_strip(response, force), {{"rubber", rubber}},
                           {assets_folder(), false}, until_interrupted(), warnings);
  if (!model) return std::unexpected(model.error());
  auto world = start_world(*std::move(model));
  if (!world) return std::unexpected(world.error());
  JawsSlip slip{
      .name = fmt::format("jaws, {}: pull at which slip begins, N = {:.0f} (N)",
                          response == Response::kLinear ? "linear" : "finite strain", force),
      .reference = 2.0 * kTeethFriction * force};
  Trace trace(stage_names());
  std::vector<double> times;
  const Jaws& jaws = (*world)->all<Jaws>()[0];
  while ((*world)->time() < kEnds && jaws.way < kFarEnough) {
    if (interrupted()) return failure(kCancelled);
    const Stopwatch watch;
    step_frame(**world, trace);
    if ((*world)->time() > kPulls) times.push_back(watch.seconds());
    if (!jaws.sliding) continue;
    const Vec3 felt = (*world)->all<InstrumentContact>()[0].force;
    const double friction = (felt - felt.dot(jaws.normal) * jaws.normal).norm();
    if (slip.value == 0.0) slip.value = friction;
    slip.farthest = std::max(slip.farthest, std::abs(friction / slip.reference - 1.0));
    slip.rows = static_cast<int>(3 * (*world)->all<OrganContact>()[0].cells.size());
  }
  slip.frame_ms = times.empty() ? 0.0 : 1e3 * quantiles(times).median;
  return slip;
}

}  // namespace

Result<std::vector<JawsSlip>> bench_jaws() {
  std::vector<JawsSlip> all;
  for (const Response response : {Response::kLinear, Response::kFinite})
    for (const double force : {1.0, 2.0, 4.0}) {
      auto slip = pull(response, force);
      if (!slip) return std::unexpected(slip.error());
      all.push_back(*std::move(slip));
    }
  return all;
}

}  // namespace viscera
