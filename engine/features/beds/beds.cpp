#include "engine/features/beds/beds.h"

#include <algorithm>

#include "engine/features/beds/blades_on_beds.h"
#include "engine/features/beds/cut_beds.h"
#include "engine/features/beds/heat_beds.h"
#include "engine/features/contact/contact.h"
#include "engine/features/links/links.h"
#include "engine/features/touching/drawn_organ.h"
#include "engine/features/touching/resting.h"
#include "engine/features/touching/touching.h"

namespace viscera {
namespace {

void reach(const SceneDescription& scene, const OrganDescription& organ,
           const std::vector<InstrumentBody>&, Reach& reach) {
  for (const BedDescription& bed : beds_of(scene))
    if (bed.between[0] == organ.name || bed.between[1] == organ.name)
      reach.attach(bed.region, organ);
}

std::size_t index_of(const SceneDescription& scene, const std::string& organ) {
  return static_cast<std::size_t>(std::ranges::find(scene.organs, organ, &OrganDescription::name) -
                                  scene.organs.begin());
}

Result<void> prepare(SceneModel& model) {
  const SceneDescription& scene = model.scene();
  Store& constants = model.constants();
  Error error;
  for (std::size_t b = 0; b < beds_of(scene).size(); ++b) {
    const BedDescription& description = beds_of(scene)[b];
    Bed bed;
    bed.name = description.name;
    bed.parts_at = description.parts_at;
    std::array<const OrganModel*, 2> organs{};
    std::array<Pose, 2> poses;
    std::array<bool, 2> soft{};
    for (std::size_t side = 0; side < 2; ++side) {
      const std::size_t index = index_of(scene, description.between[side]);
      bed.organs[side] = model.organs()[index];
      organs[side] = constants.all<OrganBody>().find(bed.organs[side])->model.get();
      poses[side] = scene.organs[index].pose_at(0.0);
      soft[side] = constants.all<OrganPatches>().find(bed.organs[side]) != nullptr;
    }
    if (!soft[0] && !soft[1]) continue;
    const bool first =
        soft[0] && (!soft[1] || organs[0]->finest_spacing <= organs[1]->finest_spacing);
    auto places = place_bed(scene, b, organs, poses, first ? 0 : 1);
    if (!places) {
      error.messages.insert(error.messages.end(), places.error().messages.begin(),
                            places.error().messages.end());
      continue;
    }
    bed.places = *std::move(places);
    constants.all<Bed>().add(model.add_entity(), std::move(bed));
  }
  if (!error.messages.empty()) return std::unexpected(error);
  return {};
}

Result<void> start(World& world) {
  const Pool<Bed>& beds = world.all<Bed>();
  for (std::size_t b = 0; b < beds.size(); ++b) {
    const CohesiveLayer& layer = beds[b].places.layer;
    world.all<BedState>().add(
        beds.owner(b),
        {.bonds = whole_bonds(layer), .forces = std::vector<Vec3>(layer.cells, Vec3::Zero())});
    world.all<BedInStep>().add(beds.owner(b), {});
  }
  return {};
}

/// By which the first organ's places must have moved beyond the second's for the bed to be as it
/// was at rest [m].
Vec3 shift_of(const World& world, const Bed& bed) {
  return -apart(world, bed.organs);
}

/// Something moves the organ in this frame.
bool is_loaded(const World& world, Entity organ) {
  if (!yields(world, organ)) return world.find<OrganState>(organ)->deformed;
  const FreeShape* shape = world.find<FreeShape>(organ);
  return !world.find<OrganContact>(organ)->cells.empty() || (shape && shape->moves) ||
         world.find<OrganTouch>(organ)->solver->moving();
}

/// Of beds that something loads; what loads one organ loads those that it hangs together with.
std::vector<char> loaded_beds(const World& world) {
  const Pool<Bed>& beds = world.all<Bed>();
  std::vector<char> loaded(beds.size(), 0);
  std::vector<Entity> organs;
  const auto add = [&](Entity organ) {
    if (std::ranges::find(organs, organ) == organs.end()) organs.push_back(organ);
  };
  for (std::size_t b = 0; b < beds.size(); ++b)
    for (const Entity organ : beds[b].organs) {
      if (is_loaded(world, organ) || !shift_of(world, beds[b]).isZero(0.0)) add(organ);
      for (const Entity other : linked_to(world, organ))
        if (is_loaded(world, other)) add(organ);
    }
  for (bool more = true; more;) {
    more = false;
    for (std::size_t b = 0; b < beds.size(); ++b) {
      const bool any = std::ranges::any_of(beds[b].organs, [&](Entity organ) {
        return std::ranges::find(organs, organ) != organs.end();
      });
      if (loaded[b] || !any) continue;
      loaded[b] = more = true;
      for (const Entity organ : beds[b].organs) add(organ);
    }
  }
  return loaded;
}

ContactCell bed_cell(const SurfacePatch& patch) {
  ContactCell cell;
  cell.held = true;
  cell.position = patch.position;
  cell.normal = patch.normal;
  cell.area = patch.area;
  return cell;
}

void lay_beds(World& world, const FrameContext&) {
  const Pool<Bed>& beds = world.all<Bed>();
  const std::vector<char> loaded = loaded_beds(world);
  for (std::size_t b = 0; b < beds.size(); ++b) {
    const Bed& bed = beds[b];
    BedState& state = *world.find<BedState>(beds.owner(b));
    BedInStep& step = *world.find<BedInStep>(beds.owner(b));
    step.layer.reset();
    if (both_rest(world, bed.organs)) continue;
    const BedPlaces& places = places_now(world, beds.owner(b));
    if (loaded[b]) step.layer = std::make_unique<LayerInStep>(places.layer, state.bonds);
    if (!step.layer || step.layer->joined().empty()) {
      step.layer.reset();
      std::ranges::fill(state.forces, Vec3::Zero());
      continue;
    }
    for (std::size_t side = 0; side < 2; ++side) {
      const Entity organ = bed.organs[side];
      if (!yields(world, organ)) continue;
      OrganContact& contact = *world.find<OrganContact>(organ);
      step.first_cells[side] = contact.cells.size();
      for (const std::size_t cell : step.layer->joined()) {
        const SurfacePatch& patch = places.cells[side][cell];
        contact.cells.push_back(bed_cell(patch));
        contact.held_points.push_back(patch.point);
      }
      contact.solution.forces.assign(contact.cells.size(), Vec3::Zero());
    }
  }
}

/// Calls each(bed, places, state, step, bodies of both organs) for beds of these organs that are
/// loaded.
template <class Each>
void for_each_bed(World& world, std::span<const Entity> organs, std::span<const int> bodies,
                  const Each& each) {
  const auto body = [&](Entity organ) {
    const auto at = std::ranges::find(organs, organ);
    return at == organs.end() ? -1 : bodies[static_cast<std::size_t>(at - organs.begin())];
  };
  const Pool<Bed>& beds = world.all<Bed>();
  for (std::size_t b = 0; b < beds.size(); ++b) {
    const std::array<int, 2> of_both{body(beds[b].organs[0]), body(beds[b].organs[1])};
    BedInStep& step = *world.find<BedInStep>(beds.owner(b));
    if (step.layer && (of_both[0] >= 0 || of_both[1] >= 0))
      each(beds[b], places_now(world, beds.owner(b)), *world.find<BedState>(beds.owner(b)), step,
           of_both);
  }
}

/// A state that another program made may say anything.
void restored(World& world) {
  const Pool<Bed>& beds = world.all<Bed>();
  for (std::size_t b = 0; b < beds.size(); ++b) {
    const CohesiveLayer& layer = places_now(world, beds.owner(b)).layer;
    BedState& state = *world.find<BedState>(beds.owner(b));
    if (state.bonds.opened.size() != layer.areas.size() ||
        state.bonds.parted_by.size() != layer.areas.size())
      state.bonds = whole_bonds(layer);
    state.forces.resize(layer.cells, Vec3::Zero());
    for (double& opened : state.bonds.opened) opened = std::max(0.0, opened);
    for (std::uint8_t& cause : state.bonds.parted_by) cause = std::min(cause, kPartedByCut);
  }
}

}  // namespace

std::vector<Entity> bedded_with(const World& world, Entity organ) {
  std::vector<Entity> others;
  const Pool<Bed>& beds = world.all<Bed>();
  for (std::size_t b = 0; b < beds.size(); ++b)
    for (std::size_t side = 0; side < 2; ++side)
      if (beds[b].organs[side] == organ && world.find<BedInStep>(beds.owner(b))->layer)
        others.push_back(beds[b].organs[1 - side]);
  return others;
}

void add_beds(World& world, std::span<const Entity> organs, std::span<const int> bodies,
              std::vector<Joint>& joints, std::vector<Vec3>& forces,
              std::vector<JointsThatYield>& yielding) {
  for_each_bed(
      world, organs, bodies,
      [&](const Bed& bed, const BedPlaces& places, const BedState& state, BedInStep& step,
          const std::array<int, 2>& of_both) {
        yielding.push_back({joints.size(), step.layer.get()});
        const std::array<DrawnOrgan, 2> drawn{DrawnOrgan(world, bed.organs[0]),
                                              DrawnOrgan(world, bed.organs[1])};
        const std::vector<std::size_t>& joined = step.layer->joined();
        for (std::size_t j = 0; j < joined.size(); ++j) {
          Joint joint;
          joint.held = true;
          joint.displacement = shift_of(world, bed);
          for (std::size_t side = 0; side < 2; ++side) {
            joint.ends[side] = {of_both[side], static_cast<int>(step.first_cells[side] + j)};
            if (of_both[side] < 0)
              joint.displacement += (side == 0 ? -1.0 : 1.0) *
                                    drawn[side].displacement(places.cells[side][joined[j]]);
          }
          joints.push_back(joint);
          forces.push_back(state.forces[joined[j]]);
        }
      });
}

void take_beds(World& world, std::span<const Entity> organs, std::span<const int> bodies,
               std::span<const Vec3> forces, bool known) {
  std::size_t next = 0;
  for_each_bed(world, organs, bodies,
               [&](const Bed&, const BedPlaces&, BedState& state, BedInStep& step,
                   const std::array<int, 2>&) {
                 std::ranges::fill(state.forces, Vec3::Zero());
                 Vec3 sum = Vec3::Zero();
                 for (const std::size_t cell : step.layer->joined()) {
                   state.forces[cell] = forces[next++];
                   sum += state.forces[cell];
                 }
                 state.greatest_force = std::max(state.greatest_force, sum.norm());
                 if (known) state.bonds = step.layer->after();
               });
}

Feature beds_feature() {
  return {.name = "beds",
          .keys = beds_keys(),
          .reach = reach,
          .prepare = prepare,
          .start = start,
          .states = {state_type<BedState>()},
          .stages = {{.name = "lay beds",
                      .reads = {"contact cells", "organ poses", "free shapes"},
                      .reads_before = {"bonds"},
                      .writes = {"contact cells"},
                      .changes = {"beds"},
                      .needed = [](const World& world) { return world.has<Bed>(); },
                      .run = lay_beds},
                     {.name = "warm beds",
                      .reads = {"forces", "organ poses"},
                      .reads_before = {"bonds", "heat"},
                      .writes = {"heat through beds"},
                      .changes = {"burns"},
                      .needed = beds_are_warm,
                      .run = warm_beds},
                     {.name = "cut beds",
                      .reads = {"shapes", "organ poses", "tool poses"},
                      .writes = {"bonds"},
                      .changes = {"beds"},
                      .needed = blades_may_cut_beds,
                      .run = cut_beds},
                     {.name = "burn beds",
                      .reads = {"heat", "shapes", "organ poses", "tool poses"},
                      .writes = {"bonds"},
                      .changes = {"beds"},
                      .needed = beds_may_burn,
                      .run = burn_beds}},
          .replaced = bed_what_is_left,
          .restored = restored,
          .report = beds_report};
}

}  // namespace viscera
