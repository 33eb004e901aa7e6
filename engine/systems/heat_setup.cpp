#include "engine/systems/heat_setup.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/gpu/gpu_heat.h"
#include "engine/io/report.h"
#include "engine/systems/tool_shape.h"

namespace viscera {
namespace {

/// Tissue that this comes near to a tip's path may be carried under it [m].
constexpr double kBurnReach = 15e-3;
constexpr double kSampleStep = 1.0 / 60.0;
/// What one burn warms, for the memory that a voxel asks for [m].
constexpr double kBurnSize = 20e-3;
/// More of the machine's memory than this is refused.
constexpr double kMostMemory = 0.5;

/// True where some hook comes near with current.
bool burns_near(const InstrumentBody& hook, const OrganDescription& organ, const Box& bounds,
                const SurfaceTree& surface) {
  const std::vector<InstrumentKey>& path = hook.description.path;
  // A hand that only its device knows may take it anywhere.
  const std::optional<HapticDescription>& held = hook.description.haptic;
  if (held && held->device != HapticDescription::Device::kSimulated)
    return carries_current(hook.description);
  const double reach = kBurnReach + hook.extent;
  for (std::size_t k = 0; k < path.size(); ++k) {
    if (path[k].power <= 0.0) continue;
    const double end = k + 1 < path.size() ? path[k + 1].time : path[k].time;
    for (double time = path[k].time; time <= end; time += kSampleStep) {
      const Vec3 tip = organ.pose_at(time).to_local(hook.tip.at(time));
      if (bounds.exteriorDistance(tip) > reach) continue;
      if (surface.signed_distance(tip) < reach) return true;
    }
  }
  return false;
}

/// The organs that a hook with current may burn: their places in the scene, and their surfaces.
struct Burnable {
  std::size_t organ = 0;
  std::shared_ptr<const SurfaceTree> surface;
};
std::vector<Burnable> burnable_organs(const SceneDescription& scene, const World& world) {
  std::vector<Burnable> organs;
  if (world.burn_traces.size() == 0) return organs;
  for (std::size_t o = 0; o < world.organ_bodies.size(); ++o) {
    const OrganModel& model = *world.organ_bodies[o].model;
    if (!model.touchable_anywhere()) continue;
    const auto surface = std::make_shared<const SurfaceTree>(model.surface);
    bool near = false;
    for (std::size_t i = 0; i < world.burn_traces.size() && !near; ++i)
      near = burns_near(*world.instrument_bodies.find(world.burn_traces.owner(i)), scene.organs[o],
                        model.rest_bounds, *surface);
    if (near) organs.push_back({o, surface});
  }
  return organs;
}

Error refused_electrodes(const SceneDescription& scene) {
  Error error;
  for (std::size_t i = 0; i < scene.instruments.size(); ++i) {
    const InstrumentDescription& tool = scene.instruments[i];
    if (!carries_current(tool)) continue;
    double most = 0.0;
    for (const InstrumentKey& key : tool.path)
      if (!(key.power <= most)) most = key.power;
    if (const auto sound = check(electrode_of(tool), most); !sound)
      for (const std::string& mistake : sound.error().messages)
        error.messages.push_back(fmt::format("{}: instruments/{} (\"{}\"): {}", scene.file.string(),
                                             i, tool.name, mistake));
  }
  return error;
}

}  // namespace

Electrode electrode_of(const InstrumentDescription& hook) {
  Electrode electrode;
  electrode.tip_radius = std::max(hook.tip.radius, kPointTipRadius);
  return electrode;
}

Result<void> add_heat(const SceneDescription& scene, World& world) {
  const std::vector<Burnable> organs = burnable_organs(scene, world);
  Error refused = refused_electrodes(scene);
  const std::size_t needed = HeatBricks::bytes_for(Vec3::Constant(kBurnSize), scene.heat.voxel);
  const double most = kMostMemory * static_cast<double>(this_machine().memory_bytes);
  if (!organs.empty() && static_cast<double>(needed) > most)
    refused.messages.push_back(fmt::format(
        "{}: heat/voxel_mm: found {:g}, with which a burn {:.0f} mm wide needs {:.1f} GB, expected "
        "one that needs at most {:.1f} GB of this machine's memory",
        scene.file.string(), 1e3 * scene.heat.voxel, 1e3 * kBurnSize,
        1e-9 * static_cast<double>(needed), 1e-9 * most));
  if (!refused.messages.empty()) return std::unexpected(refused);
  BioheatOptions options;
  options.voxel = scene.heat.voxel;
  for (const auto& [o, surface] : organs) {
    const OrganBody& body = world.organ_bodies[o];
    if (!body.tissue.thermal) continue;
    const double bricks = (body.model->rest_bounds.sizes() / (HeatBricks::kEdge * options.voxel))
                              .array()
                              .ceil()
                              .prod();
    // All of a small organ, or as much as the memory allows.
    options.most_bricks = static_cast<std::size_t>(std::min(
        bricks, std::max(static_cast<double>(BioheatOptions().most_bricks),
                         2.0 * std::pow(kBurnSize / (HeatBricks::kEdge * options.voxel), 3))));
    world.organ_burns.add(world.organ_bodies.owner(o),
                          OrganBurn{.surface = surface,
                                    .heat = Bioheat(*body.tissue.thermal, options,
                                                    [tree = surface](const Vec3& at) {
                                                      return tree->signed_distance(at);
                                                    }),
                                    .hook = {}});
  }
  return {};
}

Result<std::size_t> move_heat_to_gpu(World& world, std::shared_ptr<EglContext> context) {
  if (world.organ_burns.size() == 0) return 0;
  const auto first = GpuHeat::create(GpuLimits::of_device(), std::move(context));
  if (!first) return std::unexpected(first.error());
  // Fields come after every step: the report, the pictures and the hash look at them after each.
  for (OrganBurn& burn : world.organ_burns) burn.heat.compute_on((*first)->another());
  return world.organ_burns.size();
}

void warn_of_cold_organs(const SceneDescription& scene, const World& world,
                         const std::filesystem::path& file, std::vector<std::string>& warnings) {
  for (const auto& [o, surface] : burnable_organs(scene, world)) {
    const Tissue& tissue = world.organ_bodies[o].tissue;
    if (tissue.thermal) continue;
    std::string keys;
    for (const std::string& key : tissue.thermal_lacks) keys += (keys.empty() ? "" : ", ") + key;
    warnings.push_back(
        fmt::format("organ \"{}\": a hook may burn it, but tissue \"{}\" lacks {}: it stays cold "
                    "and sound; add "
                    "them in {}",
                    world.organ_bodies[o].name, tissue.name, keys, file.string()));
  }
}

}  // namespace viscera
