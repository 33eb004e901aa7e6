#include "engine/features/coagulation/coagulation.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/features/cautery/cautery.h"
#include "kernels/finite/continuation.h"

namespace viscera {
namespace {

/// Between looks [s].
constexpr double kLookEvery = 0.25;
/// An update is started where stiffness or lost length, times volume, has changed by this share of
/// what it was, or by so much: what nobody feels waits.
constexpr double kNoticed = 0.02;
constexpr double kLeastStiffened = 0.5e-9, kLeastShrunk = 0.05e-9;  // [m3]
/// Multiplications that a thread beside the frames does in a second, at the least.
constexpr double kPerSecond = 6e9;
/// And the frames that handing over takes at the least.
constexpr std::uint64_t kSoonest = 2;

/// Whether values are far enough from what they were; those of sound tissue where they are empty.
bool have_changed(const std::vector<double>& now, const std::vector<double>& before, double sound,
                  double least, const ElasticRegion& tissue) {
  double difference = 0.0, size = 0.0;
  for (std::size_t q = 0; q < now.size(); ++q) {
    const double was = before.empty() ? sound : before[q];
    difference += tissue.volume(q) * std::abs(now[q] - was);
    size += tissue.volume(q) * (was - sound);
  }
  return difference > std::max(least, kNoticed * size);
}

/// Whether the tissue is far enough from what the last update was made from. Collagen goes on
/// shrinking where all has coagulated.
bool worth_an_update(const OrganChange& change, const ElasticRegion& tissue,
                     const CoagulatedPoints& now) {
  return have_changed(now.stiffness, change.asked.stiffness, 1.0, kLeastStiffened, tissue) ||
         have_changed(now.shrinkage, change.asked.shrinkage, 0.0, kLeastShrunk, tissue);
}

bool anything_harmed(const HeatBricks& bricks) {
  for (std::size_t b = 0; b < bricks.count(); ++b)
    if (bricks.brick(b).harmed) return true;
  return false;
}

/// What a change makes of an organ: tissue at finite strain follows it by its energy.
StiffnessUpdate update_of_change(const OrganModel& model, const TissueChange& change) {
  if (model.finite) return energy_update(model.changeable.tissue, change, model.touchable);
  return update_stiffness(model.changeable, change, model.touchable);
}

/// Computes what the asked change makes of an organ, beside the frames.
void begin_update(OrganUpdate& update, const OrganBody& body, const TissueChange& asked) {
  update.next = std::async(std::launch::async, [model = body.model, tissue = asked] {
                  return update_of_change(*model, tissue);
                }).share();
}

OrganUpdate& update_of(World& world, Entity organ) {
  OrganUpdate* there = world.find<OrganUpdate>(organ);
  if (there && there->gauge) return *there;
  const ElasticRegion& tissue = world.find<OrganBody>(organ)->model->changeable.tissue;
  OrganUpdate& made = there ? *there : world.all<OrganUpdate>().add(organ, {});
  std::vector<double> volumes(tissue.size());
  for (std::size_t q = 0; q < volumes.size(); ++q) volumes[q] = tissue.volume(q);
  made.gauge = std::make_unique<CoagulationGauge>(tissue.positions, volumes);
  return made;
}

void look_at(World& world, Entity organ, const Bioheat& heat, std::uint64_t frame) {
  const OrganBody& body = *world.find<OrganBody>(organ);
  const ChangeableRegion& region = body.model->changeable;
  OrganChange* change = world.find<OrganChange>(organ);
  if (!change) {
    if (!anything_harmed(heat.bricks())) return;
    change = &world.all<OrganChange>().add(organ, OrganChange());
  }
  if (change->pending || change->seen == heat.version()) return;
  OrganUpdate& update = update_of(world, organ);
  change->seen = heat.version();
  CoagulatedPoints points = update.gauge->read(heat.bricks(), heat.tissue().water_fraction);
  change->stiffened = points.stiffened;
  change->left_out = points.left_out;
  if (!worth_an_update(*change, region.tissue, points)) return;
  change->asked = {std::move(points.stiffness), std::move(points.shrinkage)};
  change->due = frame + kSoonest;
  if (!body.model->finite) {
    const double takes =
        update_cost(region, change->asked, body.model->touchable) / kPerSecond;  // [s]
    change->due +=
        static_cast<std::uint64_t>(takes * static_cast<double>(world.model().steps().per_second));
  }
  change->pending = true;
  begin_update(update, body, change->asked);
}

/// The GPU knows neither of updates nor of shapes that shrinkage leaves.
void leave_gpu(OrganState& state) {
  if (!state.on_gpu) return;
  state.on_gpu = false;
  state.normals_fit = false;
  ++state.version;
  std::fill(state.displacements.begin(), state.displacements.end(),
            std::numeric_limits<float>::infinity());
}

/// Looks at the heat of burnt organs now and then, and where enough has changed starts an update.
void follow_changes(World& world, const FrameContext& context) {
  if (context.frame % world.model().steps().steps_in(kLookEvery) != 0) return;
  const Pool<OrganBurn>& burns = world.all<OrganBurn>();
  for (std::size_t b = 0; b < burns.size(); ++b) {
    const Entity organ = burns.owner(b);
    if (world.find<OrganBody>(organ)->model->changeable.empty()) continue;
    look_at(world, organ, burns[b].heat, context.frame);
  }
}

/// Hands updates that are due to the organs' contacts and shapes. Waits for them.
void stiffen_organs(World& world, const FrameContext& context) {
  Pool<OrganChange>& changes = world.all<OrganChange>();
  for (std::size_t c = 0; c < changes.size(); ++c) {
    OrganChange& change = changes[c];
    if (!change.pending || context.frame < change.due) continue;
    const Entity organ = changes.owner(c);
    OrganUpdate& update = update_of(world, organ);
    update.update = std::make_shared<const StiffnessUpdate>(update.next.get());
    update.next = {};
    change.pending = false;
    change.used = change.asked;
    update.made_of = change.used;
    ++change.updates;
    world.find<OrganTouch>(organ)->solver->stiffen(update.update);
    if (world.find<OrganBody>(organ)->model->finite) continue;
    FreeShape* shape = world.find<FreeShape>(organ);
    if (!shape) {
      shape = &world.all<FreeShape>().add(organ, level_shape(*world.find<OrganBody>(organ)->model));
      leave_gpu(*world.find<OrganState>(organ));
    }
    shape->stale = true;
  }
}

bool shape(const World& world, Entity organ, std::vector<float>& places) {
  const OrganUpdate* update = world.find<OrganUpdate>(organ);
  if (!update || !update->update || update->update->shift.empty()) return false;
  const std::vector<float>& shrunk = update->update->shift;
  for (std::size_t i = 0; i < shrunk.size(); ++i) places[i] += shrunk[i];
  return true;
}

/// Hands an update to an organ's contact, whose memory of its last solve stays.
void use_update(World& world, Entity organ, const std::shared_ptr<const StiffnessUpdate>& update) {
  TissueContact& solver = *world.find<OrganTouch>(organ)->solver;
  if (solver.update() == update.get()) return;
  auto memory = solver.state();
  solver.stiffen(update);
  solver.restore(std::move(memory));
}

void carry_on(const Continuation& continuation, std::vector<double>& values) {
  if (values.empty()) return;
  std::vector<double> next;
  next.reserve(continuation.points.size());
  for (const int point : continuation.points)
    next.push_back(values[static_cast<std::size_t>(point)]);
  values = std::move(next);
}

/// What has coagulated stays so in the body that cuts have left.
void stiffen_what_is_left(World& world, Entity organ, const Continuation* continuation) {
  OrganUpdate* update = world.find<OrganUpdate>(organ);
  if (!update) return;
  *update = {};
  OrganChange* change = world.find<OrganChange>(organ);
  if (!change || !continuation) return;  // a state that is loaded brings its own
  for (TissueChange* one : {&change->asked, &change->used}) {
    carry_on(*continuation, one->stiffness);
    carry_on(*continuation, one->shrinkage);
  }
  change->seen = 0;
  const OrganBody& body = *world.find<OrganBody>(organ);
  update_of(world, organ);
  if (!change->used.stiffness.empty()) {
    update->update =
        std::make_shared<const StiffnessUpdate>(update_of_change(*body.model, change->used));
    update->made_of = change->used;
    use_update(world, organ, update->update);
  }
  if (change->pending) begin_update(*update, body, change->asked);
}

/// A restored world's updates: those in use are made again where they are others, and those that
/// were under way are begun anew.
void restored(World& world) {
  const Pool<OrganChange>& changes = world.all<OrganChange>();
  Pool<OrganUpdate>& updates = world.all<OrganUpdate>();
  for (std::size_t c = 0; c < changes.size(); ++c) update_of(world, changes.owner(c));
  for (std::size_t u = 0; u < updates.size(); ++u) {
    const Entity organ = updates.owner(u);
    const OrganBody& body = *world.find<OrganBody>(organ);
    const OrganChange* change = changes.find(organ);
    OrganUpdate& update = updates[u];
    update.next = {};
    if (!change || change->used.stiffness.empty()) {
      update.update = nullptr;
    } else if (!update.update || !first_difference(update.made_of, change->used).empty()) {
      update.update =
          std::make_shared<const StiffnessUpdate>(update_of_change(*body.model, change->used));
      update.made_of = change->used;
    }
    use_update(world, organ, update.update);
    if (change && change->pending) begin_update(update, body, change->asked);
  }
}

void reach(const SceneDescription&, const OrganDescription& organ,
           const std::vector<InstrumentBody>&, Reach& reach) {
  reach.stiffens = stiffens(organ);
}

}  // namespace

Feature coagulation_feature() {
  return {.name = "coagulation",
          .keys = coagulation_keys(),
          .reach = reach,
          .states = {state_type<OrganChange>()},
          .stages = {{.name = "stiffen organs",
                      .reads_before = {"stiffness updates"},
                      .writes = {"parts of free shapes", "stiffness"},
                      .changes = {"coagulated organs", "free shapes", "organ contacts"},
                      .needed = [](const World& world) { return world.has<OrganChange>(); },
                      .run = stiffen_organs},
                     {.name = "follow coagulation",
                      .reads = {"heat"},
                      .writes = {"stiffness updates"},
                      .changes = {"coagulated organs"},
                      .needed = [](const World& world) { return world.has<OrganBurn>(); },
                      .run = follow_changes}},
          .shape = shape,
          .replaced = stiffen_what_is_left,
          .restored = restored,
          .report = coagulation_report};
}

}  // namespace viscera
