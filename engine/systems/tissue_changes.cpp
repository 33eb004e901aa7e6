#include "engine/systems/tissue_changes.h"

#include <cmath>
#include <limits>

namespace viscera {
namespace {

/// A quarter of a second between looks [frames].
constexpr std::uint64_t kLookEvery = 15;
/// An update is started where stiffness times volume has changed by this share of what it was, or
/// by so much: what nobody feels waits.
constexpr double kNoticed = 0.02;
constexpr double kLeastNoticed = 0.5e-9;  // [m3]
/// Multiplications that a thread beside the frames does in one of them, at the least.
constexpr double kPerFrame = 1e8;
/// And the frames that handing over takes at the least.
constexpr std::uint64_t kSoonest = 2;

/// How far the tissue is from what the last update was made from [m3].
bool worth_an_update(const OrganChange& change, const ElasticRegion& tissue,
                     const std::vector<double>& stiffness) {
  double difference = 0.0, before = 0.0;
  for (std::size_t q = 0; q < stiffness.size(); ++q) {
    const double was = change.stiffness.empty() ? 1.0 : change.stiffness[q];
    difference += tissue.weights[q] * std::abs(stiffness[q] - was);
    before += tissue.weights[q] * (was - 1.0);
  }
  return difference > std::max(kLeastNoticed, kNoticed * before);
}

bool anything_harmed(const HeatBricks& bricks) {
  for (std::size_t b = 0; b < bricks.count(); ++b)
    if (bricks.brick(b).harmed) return true;
  return false;
}

void look_at(World& world, Entity organ, const Bioheat& heat, std::uint64_t frame) {
  const OrganBody& body = *world.organ_bodies.find(organ);
  const ChangeableRegion& region = body.model->changeable;
  OrganChange* change = world.organ_changes.find(organ);
  if (!change) {
    if (!anything_harmed(heat.bricks())) return;
    change = &world.organ_changes.add(organ, OrganChange());
    change->gauge =
        std::make_unique<CoagulationGauge>(region.tissue.positions, region.tissue.weights);
  }
  if (change->next.valid() || change->seen == heat.version()) return;
  change->seen = heat.version();
  CoagulatedPoints points = change->gauge->read(heat.bricks(), heat.tissue().water_fraction);
  change->stiffened = points.stiffened;
  change->left_out = points.left_out;
  if (!worth_an_update(*change, region.tissue, points.stiffness)) return;
  change->stiffness = points.stiffness;
  TissueChange tissue{std::move(points.stiffness), std::move(points.shrinkage)};
  change->due =
      frame + kSoonest +
      static_cast<std::uint64_t>(update_cost(region, tissue, body.model->touchable) / kPerFrame);
  change->next = std::async(std::launch::async, [model = body.model, tissue = std::move(tissue)] {
    return update_stiffness(model->changeable, tissue, model->touchable);
  });
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

}  // namespace

OrganSag level_sag(const OrganModel& model) {
  OrganSag sag;
  sag.places.assign(model.displacement_rows(), 0.0f);
  sag.vertices.assign(model.rest_positions.size(), Vec3f::Zero());
  return sag;
}

void follow_changes(World& world, std::uint64_t frame) {
  if (frame % kLookEvery != 0) return;
  for (std::size_t b = 0; b < world.organ_burns.size(); ++b) {
    const Entity organ = world.organ_burns.owner(b);
    if (world.organ_bodies.find(organ)->model->changeable.empty()) continue;
    look_at(world, organ, world.organ_burns[b].heat, frame);
  }
}

std::vector<Entity> use_due_changes(World& world, std::uint64_t frame) {
  std::vector<Entity> organs;
  for (std::size_t c = 0; c < world.organ_changes.size(); ++c) {
    OrganChange& change = world.organ_changes[c];
    if (!change.next.valid() || frame < change.due) continue;
    const Entity organ = world.organ_changes.owner(c);
    change.update = std::make_shared<const StiffnessUpdate>(change.next.get());
    ++change.updates;
    world.organ_contacts.find(organ)->solver->stiffen(change.update);
    OrganSag* sag = world.organ_sags.find(organ);
    if (!sag) {
      sag = &world.organ_sags.add(organ, level_sag(*world.organ_bodies.find(organ)->model));
      leave_gpu(*world.organ_states.find(organ));
    }
    sag->shrunk = change.update->shift;
    organs.push_back(organ);
  }
  return organs;
}

}  // namespace viscera
