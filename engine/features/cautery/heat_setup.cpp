#include "engine/features/cautery/heat_setup.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "engine/features/cautery/bipolar.h"
#include "engine/features/held_tools/held_tools_keys.h"
#include "engine/features/local/local.h"
#include "engine/features/parting/parting_keys.h"
#include "engine/gpu/gpu_heat.h"
#include "engine/simulation/tool_shape.h"
#include "kernels/heat/jaw_current.h"

namespace viscera {
namespace {

/// Tissue that this comes near to a tip's path may be carried under it [m].
constexpr double kBurnReach = 15e-3;
constexpr double kSampleStep = 1.0 / 60.0;
/// What one burn warms, for the memory that a voxel asks for [m].
constexpr double kBurnSize = 20e-3;
/// Tissue this far below a surface that a hook burns may coagulate: half of a wide lesion and what
/// the tip has carried along.
constexpr double kBurnMargin = 6e-3;
/// Paths are thinned to this distance [m].
constexpr double kPathPitch = 1e-3;

/// Whether what is under the tip from this key on may be heated. Jaws heat what they have closed
/// on, wherever they carry it.
bool heats(const InstrumentDescription& tool, const InstrumentKey& key) {
  return bipolar_of(tool) ? key.jaw < kJawLetsGo : key.power > 0.0;
}

/// Scissors' blades, which conduct as far as they are in tissue; null: it has none.
const BladeDescription* live_blades(const InstrumentDescription& tool) {
  return tool.kind == InstrumentKind::kScissors ? blade_of(tool) : nullptr;
}

/// How far about its tip [m].
double reach_of_metal(const InstrumentBody& tool) {
  const BladeDescription* blades = live_blades(tool.description);
  return tool.extent + (bipolar_of(tool.description) ? tool.description.grip_radius : 0.0) +
         (blades ? blades->length : 0.0);
}

/// Two blades, each so wide and thick behind its edge, of steel. Chosen.
void add_metal_of_blades(const BladeDescription& blades, Electrode& electrode) {
  constexpr double kBladeWidth = 2e-3, kBladeThickness = 0.8e-3;  // [m]
  constexpr double kSteelHeat = 3.9e6;         // [J/(m3 K)]; that of the wire is the same
  constexpr double kSteelConductivity = 16.0;  // [W/(m K)]
  const double section = 2.0 * kBladeWidth * kBladeThickness;
  electrode.heat_capacity = kSteelHeat * section * blades.length;
  electrode.shaft_conductance = kSteelConductivity * section / blades.length;
  electrode.surface = 4.0 * kBladeWidth * blades.length;
}

/// True where some hook comes near with current.
bool burns_near(const InstrumentBody& hook, const OrganDescription& organ, const Box& bounds,
                const SurfaceTree& surface) {
  const std::vector<InstrumentKey>& path = hook.description.path;
  // A hand that only its device knows may take it anywhere.
  const HapticDescription* held = haptic_of(hook.description);
  if (held && held->device != HapticDescription::Device::kSimulated)
    return carries_current(hook.description);
  const double reach = kBurnReach + reach_of_metal(hook);
  for (std::size_t k = 0; k < path.size(); ++k) {
    if (!heats(hook.description, path[k])) continue;
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
std::vector<Burnable> burnable_organs(const SceneModel& whole) {
  const SceneDescription& scene = whole.scene();
  std::vector<Burnable> organs;
  std::vector<const InstrumentBody*> hooks;
  for (const InstrumentBody& tool : whole.constants().all<InstrumentBody>())
    if (carries_current(tool.description)) hooks.push_back(&tool);
  if (hooks.empty()) return organs;
  const Pool<OrganBody>& bodies = whole.constants().all<OrganBody>();
  for (std::size_t o = 0; o < bodies.size(); ++o) {
    const OrganModel& model = *bodies[o].model;
    const bool local = whole.constants().all<LocalBody>().find(bodies.owner(o)) != nullptr;
    if (!model.touchable_anywhere() && !local) continue;
    const auto surface = std::make_shared<const SurfaceTree>(model.surface);
    bool near = false;
    for (std::size_t i = 0; i < hooks.size() && !near; ++i)
      near = burns_near(*hooks[i], scene.organs[o], model.rest_bounds, *surface);
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
  if (bipolar_of(hook)) return electrode_of_jaws();
  Electrode electrode;
  electrode.tip_radius = std::max(hook.tip.radius, kPointTipRadius);
  if (const BladeDescription* blades = live_blades(hook)) add_metal_of_blades(*blades, electrode);
  return electrode;
}

void burn_reach(const SceneDescription&, const OrganDescription& organ,
                const std::vector<InstrumentBody>& instruments, Reach& reach) {
  for (const InstrumentBody& hook : instruments) {
    if (!carries_current(hook.description)) continue;
    reach.burn_radius = std::max(reach.burn_radius, kBurnMargin + reach_of_metal(hook));
    Vec3 last = Vec3::Constant(std::numeric_limits<double>::infinity());
    const std::vector<InstrumentKey>& path = hook.description.path;
    for (double time = 0.0; time <= path.back().time + kSampleStep; time += kSampleStep) {
      if (!heats(hook.description, path[hook.tip.key_at(time)])) continue;
      const Vec3 local = organ.pose_at(time).to_local(hook.tip.at(time));
      if ((local - last).norm() < kPathPitch) continue;
      reach.burns.push_back(local);
      last = local;
    }
  }
}

Result<void> prepare_heat(SceneModel& model) {
  const SceneDescription& scene = model.scene();
  const std::vector<Burnable> organs = burnable_organs(model);
  Error refused = refused_electrodes(scene);
  const double voxel = heat_of(scene).voxel;
  const std::size_t needed = HeatBricks::bytes_for(Vec3::Constant(kBurnSize), voxel);
  if (!organs.empty()) {
    const auto fits =
        model.memory().check(needed,
                             fmt::format("{:g}, with which a burn {:.0f} mm wide has voxels",
                                         1e3 * voxel, 1e3 * kBurnSize),
                             "a greater voxel_mm");
    if (fits)
      model.memory().keep(needed);
    else
      refused.messages.push_back(
          fmt::format("{}: heat/voxel_mm: {}", scene.file.string(), fits.error().text()));
  }
  if (!refused.messages.empty()) return std::unexpected(refused);
  BioheatOptions options;
  options.voxel = voxel;
  for (const auto& [o, surface] : organs) {
    const OrganBody& body = *model.constants().all<OrganBody>().find(model.organs()[o]);
    if (!body.tissue.thermal) continue;
    // One more each way: no brick begins where the organ does.
    const double bricks =
        ((body.model->rest_bounds.sizes() / (HeatBricks::kEdge * options.voxel)).array().ceil() +
         1.0)
            .prod();
    // All of a small organ, or as much as the memory allows.
    options.most_bricks = static_cast<std::size_t>(std::min(
        bricks, std::max(static_cast<double>(BioheatOptions().most_bricks),
                         2.0 * std::pow(kBurnSize / (HeatBricks::kEdge * options.voxel), 3))));
    model.constants().all<BurnableOrgan>().add(model.organs()[o], {surface, options});
  }
  return {};
}

Result<void> start_heat(World& world) {
  const Pool<BurnableOrgan>& organs = world.all<BurnableOrgan>();
  for (std::size_t b = 0; b < organs.size(); ++b)
    world.all<OrganBurn>().add(
        organs.owner(b),
        OrganBurn{
            .heat = Bioheat(
                *world.find<OrganBody>(organs.owner(b))->tissue.thermal, organs[b].options,
                [tree = organs[b].surface](const Vec3& at) { return tree->signed_distance(at); }),
            .hook = {}});
  for (const Entity instrument : world.model().instruments()) {
    const InstrumentDescription& tool = world.find<InstrumentBody>(instrument)->description;
    if (!carries_current(tool)) continue;
    world.all<BurnTrace>().add(
        instrument,
        BurnTrace{
            .tip = ElectrodeTip(electrode_of(tool)), .organ = {}, .contact = {}, .current = {}});
    if (bipolar_of(tool)) world.all<Sealer>().add(instrument, {});
  }
  return {};
}

Result<std::size_t> move_heat_to_gpu(World& world, std::shared_ptr<EglContext> context) {
  if (world.all<OrganBurn>().size() == 0) return 0;
  const auto first = GpuHeat::create(GpuLimits::of_device(), std::move(context));
  if (!first) return std::unexpected(first.error());
  // Fields come after every step: the report, the pictures and the hash look at them after each.
  for (OrganBurn& burn : world.all<OrganBurn>()) burn.heat.compute_on((*first)->another());
  return world.all<OrganBurn>().size();
}

Result<void> warn_of_cold_organs(SceneModel& model, const std::filesystem::path& assets,
                                 std::vector<std::string>& warnings) {
  for (const auto& [o, surface] : burnable_organs(model)) {
    const OrganBody& body = model.constants().all<OrganBody>()[o];
    const Tissue& tissue = body.tissue;
    if (tissue.thermal) continue;
    std::string keys;
    for (const std::string& key : tissue.thermal_lacks) keys += (keys.empty() ? "" : ", ") + key;
    warnings.push_back(
        fmt::format("organ \"{}\": a hook may burn it, but tissue \"{}\" lacks {}: it stays cold "
                    "and sound; add "
                    "them in {}",
                    body.name, tissue.name, keys, (assets / "tissues.json").string()));
  }
  return {};
}

}  // namespace viscera
