#include "engine/systems/haptic_tools.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "engine/systems/haptic_devices.h"
#include "engine/systems/local_organs.h"
#include "engine/systems/systems.h"
#include "engine/systems/tool_shape.h"

namespace viscera {
namespace {

/// The influence region of a hive whose scene doesn't say it: so many radii of the tool, and so
/// many spacings of the nodes where a coupled field must be smooth on them.
constexpr double kRadiiOfTool = 4.0, kSpacings = 3.0;
constexpr int kNodes = 120;
/// Of a tool's cells on tissue beyond linear: finite strains ask for a smoother pressure.
constexpr int kRingsBeyondLinear = 3;
/// Ticks that a recording may last beyond the run, while devices are let go.
constexpr std::size_t kSpareTicks = 2000;
/// An organ is felt where the path comes this near beyond the hive's radius [m].
constexpr double kFarther = 10e-3;

HivePeriphery periphery_of(const HiveDescription& hive, bool global) {
  if (!hive.periphery) return global ? HivePeriphery::kCoupled : HivePeriphery::kBoussinesq;
  switch (*hive.periphery) {
    case HiveDescription::Periphery::kCoupled:
      return HivePeriphery::kCoupled;
    case HiveDescription::Periphery::kBoussinesq:
      return HivePeriphery::kBoussinesq;
    case HiveDescription::Periphery::kFixed:
      return HivePeriphery::kFixed;
  }
  return HivePeriphery::kBoussinesq;
}

/// The reach of a path: an organ that no key comes near is not felt.
bool may_touch(const InstrumentDescription& instrument, const OrganBody& organ, double reach) {
  Box box;
  for (const InstrumentKey& key : instrument.path) box.extend(organ.pose.to_local(key.tip));
  return box.squaredExteriorDistance(Box(organ.model->rest_bounds)) < reach * reach;
}

}  // namespace

Result<HiveTissueSettings> hive_settings(const InstrumentDescription& instrument,
                                         const OrganBody& organ, ServoClock clock) {
  const TipDescription& tip = instrument.tip;
  if (tip.shape != TipDescription::Shape::kSphere && tip.shape != TipDescription::Shape::kPoint)
    return failure(
        "tip/shape: found a capsule or mesh where hives answer, expected sphere or point");
  const HiveDescription wanted = instrument.haptic ? instrument.haptic->hive : HiveDescription();
  const bool global = organ.model->touchable_anywhere();
  HiveTissueSettings settings;
  settings.tool_radius = tip.shape == TipDescription::Shape::kPoint ? kPointTipRadius : tip.radius;
  settings.building =
      clock == ServoClock::kLockstep ? HiveBuilding::kInLockstep : HiveBuilding::kOnAThread;
  HiveSettings& hive = settings.hive;
  hive.material = organ.tissue.elastic;
  hive.periphery = periphery_of(wanted, global);
  hive.formulation = wanted.paper ? HiveFormulation::kPaper : HiveFormulation::kSubtracted;
  const double nodes_apart = global ? organ.model->finest_spacing : 0.0;
  hive.radius = wanted.radius > 0.0
                    ? wanted.radius
                    : std::max(kRadiiOfTool * settings.tool_radius, kSpacings * nodes_apart);
  hive.nodes = wanted.nodes > 0 ? wanted.nodes : kNodes;
  settings.model = organ.tissue.model;
  settings.prony = organ.tissue.prony;
  if (settings.model != HyperelasticModel::kLinear) settings.rings = kRingsBeyondLinear;
  return settings;
}

TactileForce ToolTissue::respond(const ToolMotion& motion, double dt) noexcept {
  TactileForce all;
  all.energy = 0.0;
  bool unknown = false;  // how much some tissue stores
  for (Organ& organ : organs) {
    const TactileForce one = organ.tissue->respond(motion, dt);
    all.force += one.force;
    all.stiffness += one.stiffness;
    all.energy += std::max(0.0, one.energy);
    unknown = unknown || (one.touching && one.energy < 0.0);
    all.supplied += one.supplied;
    all.touching = all.touching || one.touching;
  }
  if (unknown) all.energy = -1.0;
  return all;
}

HiveTissueFigures ToolTissue::figures() const {
  HiveTissueFigures all;
  for (const Organ& organ : organs) {
    const HiveTissueFigures& one = organ.tissue->figures();
    all.hives += one.hives;
    all.refused += one.refused;
    all.searches += one.searches;
    all.uncovered += one.uncovered;
    all.newton_steps += one.newton_steps;
    all.tangent_answers += one.tangent_answers;
    all.deadline_misses += one.deadline_misses;
    all.linear_answers += one.linear_answers;
    if (one.last_refusal != HiveVerdict::kSound) all.last_refusal = one.last_refusal;
  }
  return all;
}

Result<std::shared_ptr<HapticTools>> HapticTools::create(const SceneDescription& scene,
                                                         const World& world, const ServoRun& run) {
  const ServoClock clock = run.clock;
  if (std::none_of(scene.instruments.begin(), scene.instruments.end(),
                   [](const InstrumentDescription& one) { return one.haptic.has_value(); }))
    return std::shared_ptr<HapticTools>();
  auto all = std::shared_ptr<HapticTools>(new HapticTools(clock));
  std::map<const OrganModel*, std::shared_ptr<const WalkableSurface>> surfaces;
  Error error;
  for (std::size_t i = 0; i < scene.instruments.size(); ++i) {
    const InstrumentDescription& instrument = scene.instruments[i];
    if (!instrument.haptic) continue;
    const auto wrong = [&](const std::string& key, const std::string& what) {
      error.messages.push_back(fmt::format("{}: instruments/{}/{}{}{}", scene.file.string(), i, key,
                                           key.empty() ? "" : ": ", what));
    };
    HapticTool tool;
    tool.name = instrument.name;
    tool.instrument = world.instrument_bodies.owner(i);
    tool.tissue = std::make_unique<ToolTissue>();
    for (std::size_t o = 0; o < world.organ_bodies.size(); ++o) {
      const OrganBody& organ = world.organ_bodies[o];
      const bool local = scene.organs[o].response == Response::kLocal;
      if (!scene.organs[o].deformable || !(organ.model->touchable_anywhere() || local)) continue;
      const auto settings = hive_settings(instrument, organ, clock);
      if (!settings) {
        wrong("", settings.error().text());
        break;
      }
      if (!may_touch(instrument, organ, settings->tool_radius + settings->hive.radius + kFarther))
        continue;
      auto& surface = surfaces[organ.model.get()];
      if (!surface) {
        auto walkable = WalkableSurface::make(organ.model->surface);
        if (!walkable) {
          wrong("haptic", fmt::format("organ \"{}\": {}", organ.name, walkable.error().text()));
          continue;
        }
        surface = std::make_shared<const WalkableSurface>(std::move(*walkable));
        all->surfaces_.push_back(surface);
      }
      const HiveBody body{surface.get(), &organ.model->compliance, &organ.model->touchable};
      auto tissue = HiveTissue::create(body, *settings);
      if (!tissue) {
        wrong("haptic/hive", fmt::format("organ \"{}\": {}", organ.name, tissue.error().text()));
        continue;
      }
      tool.tissue->organs.push_back({world.organ_bodies.owner(o), std::move(*tissue)});
    }
    const double seconds = std::max(scene.duration, run.seconds);
    auto device = open_device(instrument, world.instrument_bodies[i].tip, seconds);
    if (!device) {
      wrong("haptic", device.error().text());
      continue;
    }
    tool.device = std::move(device->device);
    ServoSettings servo;
    servo.placement = device->placement;
    if (instrument.haptic->coupling_stiffness > 0.0)
      servo.coupling.stiffness = instrument.haptic->coupling_stiffness;
    if (run.record)
      tool.recorder = std::make_unique<RecordingDevice>(
          *tool.device, servo.dt,
          static_cast<std::size_t>(std::ceil(seconds / servo.dt)) + kSpareTicks);
    HapticDevice& felt = tool.recorder ? *tool.recorder : *tool.device;
    tool.servo = std::make_unique<ServoTick>(felt, *tool.tissue, servo);
    if (clock == ServoClock::kLockstep)
      tool.lockstep = std::make_unique<LockstepServo>(*tool.servo);
    else
      tool.loop = std::make_unique<ServoLoop>(*tool.servo);
    tool.output.tool.position = instrument.path.front().tip;
    all->tools_.push_back(std::move(tool));
  }
  if (!error.messages.empty()) return std::unexpected(error);
  return all;
}

HapticTools::~HapticTools() {
  stop();
}

void HapticTools::stop() {
  for (HapticTool& tool : tools_)
    if (tool.loop) tool.loop->stop();
}

void HapticTools::publish(const World& world, std::uint64_t frame) {
  for (HapticTool& tool : tools_) {
    // On the wall clock a scene may be late: what it shows now is what is felt from now on.
    const std::uint64_t scene_tick = last_tick_of_frame(frame);
    const std::uint64_t tick = clock_ == ServoClock::kLockstep ? scene_tick : tool.output.tick;
    for (ToolTissue::Organ& organ : tool.tissue->organs) {
      const OrganBody& body = *world.organ_bodies.find(organ.entity);
      TissueSnapshot& snapshot = organ.tissue->snapshots().back();
      snapshot.frame = frame;
      snapshot.tick = tick;
      snapshot.pose = body.pose;
      snapshot.velocity = Vec3::Zero();
      if (const OrganMotion* motion = world.organ_motions.find(organ.entity))
        snapshot.velocity = motion->motion.velocity(1e-3 * static_cast<double>(scene_tick));
      const OrganSag* sag = world.organ_sags.find(organ.entity);
      if (sag && sag->moves())
        snapshot.free = sag->vertices;
      else
        snapshot.free.clear();
      const Vec3& tip = world.instrument_states.find(tool.instrument)->tip;
      const auto hit = nearest_tissue(world, organ.entity, tip, organ.tissue->reach());
      snapshot.nearest = hit ? hit->point : SurfacePoint();
      organ.tissue->snapshots().publish();
    }
  }
}

void HapticTools::advance_to(std::uint64_t end) {
  for (HapticTool& tool : tools_) {
    if (tool.lockstep) {
      tool.lockstep->advance_to(end);
      tool.output = tool.servo->output();
    } else {
      if (!started_) tool.loop->start();
      if (tool.loop->outputs().update()) tool.output = tool.loop->outputs().front();
    }
  }
  started_ = true;
}

void HapticTools::place_tools(World& world) {
  for (HapticTool& tool : tools_) {
    tool.met = tool.met || tool.output.authority > 0.0;
    if (!tool.met) continue;  // it waits where its path begins
    InstrumentState& state = *world.instrument_states.find(tool.instrument);
    const InstrumentBody& body = *world.instrument_bodies.find(tool.instrument);
    aim_tool(body, tool.output.tool.position, state);
  }
}

void HapticTools::collect_events() {
  constexpr std::size_t kMost = 1000;  // a device that fails again and again fills no memory
  for (HapticTool& tool : tools_) {
    const auto note = [&](const ServoEvent& event) {
      if (tool.events.size() == kMost) tool.events.push_back("further events aren't listed");
      if (tool.events.size() > kMost) return;
      tool.events.push_back(
          event.tick > 0
              ? fmt::format("{:.3f} s: {}", 1e-3 * static_cast<double>(event.tick), describe(event))
              : describe(event));
    };
    ServoEvent event;
    while (tool.servo->events().pop(event)) note(event);
    while (tool.device->next_event(event)) note(event);
  }
}

void run_servos(World& world, const FrameContext& context) {
  world.haptics->advance_to(last_tick_of_frame(context.frame));
  world.haptics->place_tools(world);
  world.haptics->collect_events();
}

void publish_to_servos(World& world, const FrameContext& context) {
  world.haptics->publish(world, context.frame);
}

}  // namespace viscera
