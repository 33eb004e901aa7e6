#include "engine/features/held_tools/held_tools.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "engine/features/breathing/breathing.h"
#include "engine/features/contact/contact_cells.h"
#include "engine/features/contact/pressed_stiffness.h"
#include "engine/features/deformation/deformation.h"
#include "engine/features/held_tools/haptic_devices.h"
#include "engine/features/local/hive_settings.h"
#include "engine/features/parting/parting.h"
#include "engine/features/shafts/shafts.h"
#include "engine/simulation/instruments.h"
#include "engine/simulation/tool_shape.h"

namespace viscera {
namespace {

/// Ticks that a recording may last beyond the run, while devices are let go.
constexpr std::size_t kSpareTicks = 2000;

/// Of everything that a tool's jaw holds on the tool; world [N].
Vec3 pull_on(const World& world, Entity instrument) {
  Vec3 sum = Vec3::Zero();
  const Pool<OrganTouch>& touches = world.all<OrganTouch>();
  for (std::size_t o = 0; o < touches.size(); ++o)
    for (const CellRange& range : touches[o].ranges)
      if (range.instrument == instrument && range.held)
        sum -= pose_of(world, touches.owner(o)).direction_to_world(range.force);
  return sum;
}

/// -> HapticTool::events
void note_event(HapticTool& tool, std::string event) {
  constexpr std::size_t kMost = 1000;  // a device that fails again and again fills no memory
  if (tool.events.size() == kMost) tool.events.push_back("further events aren't listed");
  if (tool.events.size() <= kMost) tool.events.push_back(std::move(event));
}

HiveBuilding building_of(ServoClock clock) {
  return clock == ServoClock::kLockstep ? HiveBuilding::kInLockstep : HiveBuilding::kOnAThread;
}

bool is_cut(const World& world, Entity organ) {
  const OrganLeft* left = world.find<OrganLeft>(organ);
  return left && !left->depths.empty();
}

/// What the frame found of a tool that presses an organ.
AsFrameFound press_as_found(const World& world, Entity organ, Entity instrument) {
  AsFrameFound found;
  found.tip = world.find<InstrumentState>(instrument)->tip;
  const OrganContact& contact = *world.find<OrganContact>(organ);
  const std::vector<Vec3>& forces = contact.solution.forces;
  if (!contact.solution.converged || forces.size() != contact.cells.size()) return found;
  const Pose& pose = pose_of(world, organ);
  std::vector<std::size_t> pressed;
  std::vector<Vec3> ways;
  for (const CellRange& range : world.find<OrganTouch>(organ)->ranges) {
    if (range.instrument != instrument || range.held) continue;
    for (std::size_t k = range.begin; k < range.end; ++k) {
      if (!(forces[k].dot(contact.cells[k].direction) > 0.0)) continue;
      found.force -= pose.direction_to_world(forces[k]);
      pressed.push_back(k);
      ways.push_back(pose.direction_to_world(contact.cells[k].direction));
    }
  }
  found.stiffness = pressed_stiffness(world, organ, pressed, ways);
  return found;
}

}  // namespace

TactileForce ToolTissue::respond(const ToolMotion& motion, double dt) noexcept {
  TactileForce all;
  all.energy = 0.0;
  bool unknown = false;  // how much some tissue stores
  const auto add = [&](const TactileForce& one) {
    all.force += one.force;
    all.stiffness += one.stiffness;
    all.energy += std::max(0.0, one.energy);
    unknown = unknown || (one.touching && one.energy < 0.0);
    all.supplied += one.supplied;
    all.touching = all.touching || one.touching;
  };
  for (FeltOrgan& organ : organs) add(organ.respond(motion, dt));
  add(shaft.respond(motion.pose.position, dt));
  add(blade.respond(motion.pose.position, dt));
  if (unknown) all.energy = -1.0;
  return all;
}

HiveTissueFigures ToolTissue::figures() const {
  HiveTissueFigures all;
  for (const FeltOrgan& organ : organs) all += organ.figures();
  return all;
}

Result<std::unique_ptr<HapticTools>> HapticTools::create(const SceneDescription& scene,
                                                         const World& world, const ServoRun& run) {
  const ServoClock clock = run.clock;
  if (!holds_tools(scene)) return std::unique_ptr<HapticTools>();
  auto all = std::unique_ptr<HapticTools>(new HapticTools(clock));
  std::map<const OrganModel*, std::shared_ptr<const WalkableSurface>> surfaces;
  Error error;
  for (std::size_t i = 0; i < scene.instruments.size(); ++i) {
    const InstrumentDescription& instrument = scene.instruments[i];
    const HapticDescription* haptic = haptic_of(instrument);
    if (!haptic) continue;
    const auto wrong = [&](const std::string& key, const std::string& what) {
      error.messages.push_back(fmt::format("{}: instruments/{}/{}{}{}", scene.file.string(), i, key,
                                           key.empty() ? "" : ": ", what));
    };
    HapticTool tool;
    tool.name = instrument.name;
    tool.instrument = world.all<InstrumentBody>().owner(i);
    tool.tissue = std::make_unique<ToolTissue>();
    if (auto round = check_round(instrument.tip); !round) {
      wrong("", round.error().text());
      continue;
    }
    for (std::size_t o = 0; o < world.all<OrganBody>().size(); ++o) {
      const OrganBody& organ = world.all<OrganBody>()[o];
      const bool local = scene.organs[o].response == Response::kLocal;
      if (!scene.organs[o].deformable || !(organ.model->touchable_anywhere() || local)) continue;
      const Entity entity = world.all<OrganBody>().owner(o);
      if (cuts(world, tool.instrument, entity)) continue;
      auto body = felt_body(instrument, organ, is_cut(world, entity), building_of(clock),
                            surfaces[organ.model.get()]);
      if (!body)
        wrong("", body.error().text());
      else
        tool.tissue->organs.emplace_back(entity, *std::move(body));
    }
    const double seconds = std::max(scene.duration, run.seconds);
    auto device = open_device(instrument, world.all<InstrumentBody>()[i].tip, seconds);
    if (!device) {
      wrong("haptic", device.error().text());
      continue;
    }
    tool.device = std::move(device->device);
    ServoSettings servo;
    servo.placement = device->placement;
    if (haptic->coupling_stiffness > 0.0) servo.coupling.stiffness = haptic->coupling_stiffness;
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

void HapticTools::replace_body(const World& world, Entity organ) {
  std::shared_ptr<const WalkableSurface> surface;
  for (HapticTool& tool : tools_)
    for (FeltOrgan& felt : tool.tissue->organs) {
      if (!(felt.organ() == organ)) continue;
      auto body = felt_body(world.find<InstrumentBody>(tool.instrument)->description,
                            *world.find<OrganBody>(organ), is_cut(world, organ),
                            building_of(clock_), surface);
      if (!body)
        note_event(tool, fmt::format("{:.3f} s: no hives stand on what the last cut has left, and "
                                     "the hand feels the frame's force: {}",
                                     world.time(), body.error().text()));
      felt.become(body ? *std::move(body) : nullptr);
    }
}

void HapticTools::ask_tissue(World& world, Aside& aside) {
  struct Question {
    std::function<TissueUnder()> ask;
    std::optional<TissueUnder>* answer;
  };
  std::map<std::uint32_t, std::vector<Question>> of_organs;  // one at a time of each
  for (HapticTool& tool : tools_)
    for (FeltOrgan& organ : tool.tissue->organs) {
      organ.under.reset();
      if (auto ask = ask_tissue_under(world, organ.organ(), tool.instrument))
        of_organs[organ.organ().index].push_back({std::move(ask), &organ.under});
    }
  for (auto& [organ, questions] : of_organs)
    aside.begin([questions = std::move(questions)] {
      for (const Question& question : questions) *question.answer = question.ask();
    });
  // Surfaces that come from the GPU are made here after all where it fails.
  if (world.has<GpuOrgans>()) aside.wait();
}

void HapticTools::publish(World& world, std::uint64_t frame) {
  for (HapticTool& tool : tools_) {
    // On the wall clock a scene may be late: what it shows now is what is felt from now on.
    const std::uint64_t scene_tick = world.model().steps().last_tick(frame);
    const std::uint64_t tick = clock_ == ServoClock::kLockstep ? scene_tick : tool.output.tick;
    for (FeltOrgan& organ : tool.tissue->organs) {
      organ.frames().back() =
          organ.under ? press_as_found(world, organ.organ(), tool.instrument) : AsFrameFound();
      organ.frames().publish();
      if (!organ.stands()) continue;
      HiveTissue& tissue = organ.tissue();
      TissueSnapshot& snapshot = tissue.snapshots().back();
      snapshot.frame = frame;
      snapshot.tick = tick;
      const auto meet = [&](const std::optional<TissueUnder>& under) {
        return meet_tissue(world, organ.organ(), tool.instrument, tissue.reach(), under, snapshot);
      };
      // A body that waits to be handed over is met as it is drawn, where contact has no answer.
      if (!meet(organ.under) && !(organ.waits() && meet({}))) continue;
      snapshot.velocity = Vec3::Zero();
      if (const OrganMotion* motion = world.find<OrganMotion>(organ.organ()))
        snapshot.velocity = motion->motion.velocity(1e-3 * static_cast<double>(scene_tick));
      const SurfacePoint nearest = snapshot.nearest;
      tissue.snapshots().publish();
      organ.hand_over(nearest);
      if (clock_ == ServoClock::kLockstep) organ.take_over();
    }
    if (const ShaftState* shaft = world.find<ShaftState>(tool.instrument)) {
      tool.tissue->shaft.frames().back() = {shaft->lever.at_tip, shaft->stiffness,
                                            world.find<InstrumentState>(tool.instrument)->tip};
      tool.tissue->shaft.frames().publish();
    }
    if (blade_of(world.find<InstrumentBody>(tool.instrument)->description)) {
      tool.tissue->blade.frames().back() = blade_as_felt(world, tool.instrument);
      tool.tissue->blade.frames().publish();
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
    InstrumentState& state = *world.find<InstrumentState>(tool.instrument);
    const InstrumentBody& body = *world.find<InstrumentBody>(tool.instrument);
    aim_tool(body, tool.output.tool.position, state);
  }
}

void HapticTools::take_felt_forces(World& world, double dt) {
  for (HapticTool& tool : tools_) {
    if (!tool.met) continue;
    InstrumentContact& contact = *world.find<InstrumentContact>(tool.instrument);
    // What a jaw holds pulls at it through the frame: the hand's tissue is only what it presses.
    const Vec3 pull = pull_on(world, tool.instrument);
    const Vec3 felt = tool.output.tissue, more = felt - (contact.force - pull);
    const InstrumentDescription& held = world.find<InstrumentBody>(tool.instrument)->description;
    if (blade_of(held)) {
      // Of a blade it isn't known what its edge feels and what its tip. Scissors' edges hold their
      // handles, which no device knows.
      if (held.kind == InstrumentKind::kScalpel) contact.force = felt;
      continue;
    }
    const Vec3 way = tool.output.tool.position - tool.agreement.tip;
    tool.agreement.tip = tool.output.tool.position;
    if (contact.touching && tool.output.touching && way.norm() < kStandsStill * dt) {
      ++tool.agreement.frames;
      tool.agreement.felt += felt.squaredNorm();
      tool.agreement.difference += (felt - (contact.force - pull)).squaredNorm();
    }
    contact.force = felt + pull;
    // Of several organs the one that it presses most takes what the sum lacks.
    OrganTouch* touch = contact.touching ? world.find<OrganTouch>(contact.organ) : nullptr;
    if (!touch) continue;
    for (CellRange& range : touch->ranges) {
      if (range.instrument != tool.instrument || range.held) continue;
      range.felt = range.force - pose_of(world, contact.organ).direction_to_local(more);
      contact.strongest = range.felt.norm();
    }
  }
}

void HapticTools::collect_events() {
  for (HapticTool& tool : tools_) {
    const auto tell = [&](const ServoEvent& event) {
      note_event(tool, event.tick > 0
                           ? fmt::format("{:.3f} s: {}", 1e-3 * static_cast<double>(event.tick),
                                         describe(event))
                           : describe(event));
    };
    ServoEvent event;
    while (tool.servo->events().pop(event)) tell(event);
    while (tool.loop && tool.loop->watchdog_events().pop(event)) tell(event);
    while (tool.device->next_event(event)) tell(event);
  }
}

HapticTools::State HapticTools::state() const {
  if (clock_ == ServoClock::kRealTime) return {};
  State state;
  for (const HapticTool& tool : tools_) {
    State::Tool one;
    one.servo = tool.servo->state();
    if (tool.lockstep) one.lockstep = tool.lockstep->state();
    one.output = tool.output;
    for (const FeltOrgan& organ : tool.tissue->organs) one.tissue.push_back(organ.state());
    one.shaft = tool.tissue->shaft.state();
    one.blade = tool.tissue->blade.state();
    one.device = tool.felt().state_bytes();
    one.events = tool.events;
    one.met = tool.met;
    one.agreement = tool.agreement;
    state.tools.push_back(std::move(one));
  }
  return state;
}

bool HapticTools::fits(const State& state) const {
  if (!why_not_saved().empty() || state.tools.size() != tools_.size()) return false;
  for (std::size_t t = 0; t < tools_.size(); ++t) {
    const State::Tool& one = state.tools[t];
    const std::deque<FeltOrgan>& organs = tools_[t].tissue->organs;
    if (!ServoTick::fits(one.servo) || one.tissue.size() != organs.size() ||
        !FrameFeel::fits(one.shaft) || !BladeFeel::fits(one.blade) ||
        !tools_[t].felt().fits_bytes(one.device))
      return false;
    for (std::size_t o = 0; o < organs.size(); ++o)
      if (!organs[o].fits(one.tissue[o])) return false;
  }
  return true;
}

void HapticTools::restore(State state) {
  for (std::size_t t = 0; t < tools_.size(); ++t) {
    HapticTool& tool = tools_[t];
    State::Tool& one = state.tools[t];
    tool.servo->restore(one.servo);
    tool.lockstep->restore(one.lockstep);
    tool.output = one.output;
    for (std::size_t o = 0; o < tool.tissue->organs.size(); ++o)
      tool.tissue->organs[o].restore(std::move(one.tissue[o]));
    tool.tissue->shaft.restore(one.shaft);
    tool.tissue->blade.restore(one.blade);
    tool.felt().restore_bytes(one.device);
    tool.events = std::move(one.events);
    tool.met = one.met;
    tool.agreement = one.agreement;
  }
}

std::string HapticTools::why_not_saved() const {
  if (clock_ == ServoClock::kRealTime)
    return "held tools on the wall clock: a hand can't be put back where it was";
  for (const HapticTool& tool : tools_)
    if (std::string why = tool.felt().why_not_saved(); !why.empty()) return why;
  return {};
}

Result<void> hold_tools(World& world, const ServoRun& run) {
  auto tools = HapticTools::create(world.model().scene(), world, run);
  if (!tools) return std::unexpected(tools.error());
  if (!*tools) return {};
  for (const HapticTool& tool : (*tools)->tools()) world.all<HeldTip>().add(tool.instrument, {});
  Aside aside;
  (*tools)->ask_tissue(world, aside);
  aside.wait();
  (*tools)->publish(world, 0);
  world.all<Servos>().add(kWhole, {*std::move(tools)});
  return {};
}

HapticTools* servos_of(World& world) {
  Servos* servos = world.one<Servos>();
  return servos ? servos->tools.get() : nullptr;
}
const HapticTools* servos_of(const World& world) {
  const Servos* servos = world.one<Servos>();
  return servos ? servos->tools.get() : nullptr;
}

namespace {

/// Ticks of held tools until this frame's end -> InstrumentState.
void run_servos(World& world, const FrameContext& context) {
  HapticTools& servos = *servos_of(world);
  servos.advance_to(world.model().steps().last_tick(context.frame));
  servos.place_tools(world);
  servos.collect_events();
}

/// One tissue: curves, review and measures hold what the hand felt.
void take_felt_forces(World& world, const FrameContext& context) {
  servos_of(world)->take_felt_forces(world, context.dt);
}

/// What takes long of the servos' snapshots.
void ask_for_servos(World& world, const FrameContext& context) {
  servos_of(world)->ask_tissue(world, *context.aside);
}

/// Where tissue is now -> the servos' snapshots.
void publish_to_servos(World& world, const FrameContext& context) {
  context.aside->wait();
  servos_of(world)->publish(world, context.frame);
}

/// Only the hand knows where it takes a tool that it holds.
void reach(const SceneDescription& scene, const OrganDescription&,
           const std::vector<InstrumentBody>&, Reach& reach) {
  if (holds_tools(scene)) reach.anywhere = true;
}

bool held(const World& world) {
  return world.has<Servos>();
}

void feel_other_body(World& world, Entity organ, const Continuation*) {
  if (HapticTools* servos = servos_of(world)) servos->replace_body(world, organ);
}

}  // namespace

Feature held_tools_feature() {
  return {
      .name = "held tools",
      .keys = held_tools_keys(),
      .reach = reach,
      .states = {state_type<Servos>({Strays::Become::kUnwatched})},
      .stages = {{.name = "run servos",
                  .reads = {"tool poses"},
                  .reads_before = {"tissue snapshots"},
                  .writes = {"tool poses"},
                  .changes = {"servos", "tool poses"},
                  .needed = held,
                  .run = run_servos},
                 {.name = "take felt forces",
                  .reads = {"tool poses", "organ poses", "forces"},
                  .writes = {"forces"},
                  .changes = {"servos", "organ contacts", "tool forces"},
                  .needed = held,
                  .run = take_felt_forces},
                 {.name = "ask tissue",
                  .reads = {"contact problem", "forces"},
                  .writes = {"tissue under tools"},
                  .needed = held,
                  .run = ask_for_servos},
                 {.name = "publish",
                  .reads = {"tissue under tools", "surfaces", "organ poses", "tool poses", "cuts"},
                  .writes = {"tissue snapshots"},
                  .changes = {"servos", "organ contacts"},
                  .needed = held,
                  .run = publish_to_servos}},
      .replaced = feel_other_body,
      .unsavable =
          [](const World& world) {
            const HapticTools* servos = servos_of(world);
            return servos ? servos->why_not_saved() : std::string();
          },
      .report = held_tools_report,
      .skipped = held_tools_skipped};
}

}  // namespace viscera
