#include "engine/features/beds/beds.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/features/cautery/cautery.h"
#include "engine/features/contact/contact.h"
#include "engine/features/links/links.h"
#include "engine/features/touching/drawn_organ.h"
#include "engine/features/touching/resting.h"
#include "engine/features/touching/touching.h"
#include "engine/simulation/tool_shape.h"

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
    if (loaded[b]) step.layer = std::make_unique<LayerInStep>(bed.places.layer, state.bonds);
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
        const SurfacePatch& patch = bed.places.cells[side][cell];
        contact.cells.push_back(bed_cell(patch));
        contact.held_points.push_back(patch.point);
      }
      contact.solution.forces.assign(contact.cells.size(), Vec3::Zero());
    }
  }
}

/// Tissue at one of a bond's ends is as hot as parts it.
bool is_burnt(const World& world, const Bed& bed, std::size_t bond) {
  for (std::size_t side = 0; side < 2; ++side) {
    const OrganBurn* burn = world.find<OrganBurn>(bed.organs[side]);
    if (!burn) continue;
    const HeatBricks& bricks = burn->heat.bricks();
    if (burn->heat.options().body +
            bricks.excess_at(bricks.voxel_of(bed.places.ends[side][bond])) >=
        bed.parts_at)
      return true;
  }
  return false;
}

/// Tips of hooks that carry current; world.
std::vector<ToolShape> live_tips(const World& world) {
  std::vector<ToolShape> tips;
  const Pool<BurnTrace>& traces = world.all<BurnTrace>();
  for (std::size_t t = 0; t < traces.size(); ++t) {
    const InstrumentState& state = *world.find<InstrumentState>(traces.owner(t));
    if (state.power > 0.0 && !bipolar_of(world.find<InstrumentBody>(traces.owner(t))->description))
      tips.push_back(tool_shape(*world.find<InstrumentBody>(traces.owner(t)), state, Pose{}));
  }
  return tips;
}

/// Whether the strand of a bond, between its ends as they are drawn, lies on such metal.
class StrandsOnMetal {
 public:
  StrandsOnMetal(const World& world, const Bed& bed, std::span<const ToolShape> tips)
      : bed_(bed), one_(world, bed.organs[0]), other_(world, bed.organs[1]) {
    for (const ToolShape& tip : tips)
      for (const Vec3& probe : tip.probes()) metal_.push_back({probe, tip.probe_radius()});
  }

  bool touched(std::size_t bond) const {
    if (metal_.empty()) return false;
    const Vec3 begin = one_.place(bed_.places.points[0][bond]);
    const Vec3 along = other_.place(bed_.places.points[1][bond]) - begin;
    const double thick = std::sqrt(bed_.places.layer.areas[bond] / std::numbers::pi);
    return std::ranges::any_of(metal_, [&](const Ball& ball) {
      const double length = along.squaredNorm();
      const double share =
          length > 0.0 ? std::clamp((ball.middle - begin).dot(along) / length, 0.0, 1.0) : 0.0;
      return (begin + share * along - ball.middle).norm() < ball.radius + thick;
    });
  }

 private:
  struct Ball {
    Vec3 middle = Vec3::Zero();  // world [m]
    double radius = 0.0;         // [m]
  };
  const Bed& bed_;
  DrawnOrgan one_, other_;
  std::vector<Ball> metal_;
};

void burn_beds(World& world, const FrameContext&) {
  const Pool<Bed>& beds = world.all<Bed>();
  const std::vector<ToolShape> tips = live_tips(world);
  for (std::size_t b = 0; b < beds.size(); ++b) {
    const bool warm = std::ranges::any_of(beds[b].organs, [&](Entity organ) {
      const OrganBurn* burn = world.find<OrganBurn>(organ);
      return burn && burn->heat.warm_bricks() > 0;
    });
    if (!warm && tips.empty()) continue;
    const StrandsOnMetal strands(world, beds[b], tips);
    BondStates& bonds = world.find<BedState>(beds.owner(b))->bonds;
    for (std::size_t i = 0; i < bonds.burnt.size(); ++i)
      if (holds(beds[b].places.layer, bonds, i) &&
          (strands.touched(i) || is_burnt(world, beds[b], i)))
        bonds.burnt[i] = 1;
  }
}

/// Calls each(bed, state, step, bodies of both organs) for beds of these organs that are loaded.
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
      each(beds[b], *world.find<BedState>(beds.owner(b)), step, of_both);
  }
}

/// A state that another program made may say anything.
void restored(World& world) {
  const Pool<Bed>& beds = world.all<Bed>();
  for (std::size_t b = 0; b < beds.size(); ++b) {
    const CohesiveLayer& layer = beds[b].places.layer;
    BedState& state = *world.find<BedState>(beds.owner(b));
    if (state.bonds.opened.size() != layer.areas.size() ||
        state.bonds.burnt.size() != layer.areas.size())
      state.bonds = whole_bonds(layer);
    state.forces.resize(layer.cells, Vec3::Zero());
    for (double& opened : state.bonds.opened) opened = std::max(0.0, opened);
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
      [&](const Bed& bed, const BedState& state, BedInStep& step,
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
                                    drawn[side].displacement(bed.places.cells[side][joined[j]]);
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
               [&](const Bed&, BedState& state, BedInStep& step, const std::array<int, 2>&) {
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
  return {
      .name = "beds",
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
                 {.name = "burn beds",
                  .reads = {"heat", "shapes", "organ poses", "tool poses"},
                  .writes = {"bonds"},
                  .changes = {"beds"},
                  .needed =
                      [](const World& world) { return world.has<Bed>() && world.has<BurnTrace>(); },
                  .run = burn_beds}},
      .restored = restored,
      .report = beds_report};
}

}  // namespace viscera
