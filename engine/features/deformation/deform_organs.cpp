#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/features/clips/clips.h"
#include "engine/features/contact/contact_cells.h"
#include "engine/features/contact/contact_flags.h"
#include "engine/features/contact/tissue_as_met.h"
#include "engine/features/deformation/deformation.h"
#include "engine/features/deformation/gpu_surfaces.h"
#include "engine/features/deformation/stages.h"
#include "engine/features/finite/finite.h"
#include "engine/features/jaws/jaw_forces.h"
#include "engine/features/shafts/shafts.h"
#include "engine/simulation/sentinel.h"
#include "kernels/base/finite.h"

namespace viscera {
namespace {

constexpr double kLeastSlip = 1e-6;  // [m]
/// An organ that only links pull at keeps its drawn shape until some place has moved by this much:
/// a tenth of what a pixel sees from where the lens comes nearest, a hundredth of how deep tips
/// press. Forces of links don't wait for it [m].
constexpr float kUnseen = 5e-6f;

Vec3 sum_of(const std::vector<Vec3>& forces, const CellRange& range) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t k = range.begin; k < range.end; ++k) sum += forces[k];
  return sum;
}

/// Lets jaws slide whose pull passes their grip limit. A held patch answers a rigid shift linearly,
/// so shortening its travel in the ratio of the forces brings it near the limit; repeated passes
/// account for other tools on the organ. Jaws that hold by their force slide and close by their own
/// law. True when some jaw moved on what it holds; `slipped`: one whose grip has a limit.
bool slip_jaws(World& world, Entity organ, OrganContact& contact, bool& slipped) {
  bool slid = false;
  const Pose& pose = pose_of(world, organ);
  for (CellRange& range : world.find<OrganTouch>(organ)->ranges) {
    if (!range.held) continue;
    Grasp& grasp = *world.find<InstrumentContact>(range.instrument)->grasp;
    if (Jaws* jaws = world.find<Jaws>(range.instrument)) {
      slid |= settle_jaws(*world.find<JawsBody>(range.instrument), pose, grasp, range,
                          contact.solution, world.find<OrganTouch>(organ)->solver->cell_response(),
                          world.model().time_step(), *jaws, contact.cells);
      continue;
    }
    const InstrumentBody& tool = *world.find<InstrumentBody>(range.instrument);
    if (tool.description.kind == InstrumentKind::kBag) continue;  // nothing slips out of a sack
    const double force = sum_of(contact.solution.forces, range).norm();
    const double limit = tool.description.grip_limit;
    if (force <= limit * 1.001) continue;
    const InstrumentState& state = *world.find<InstrumentState>(range.instrument);
    const Vec3 travel = jaw_travel(grasp, state, pose);
    const Vec3 back = (1.0 - limit / force) * travel;
    // Without travel of its own the pull comes from other tools; sliding can't lessen it.
    if (back.norm() < kLeastSlip) continue;
    grasp.slipped += back;
    const Vec3 local = pose.direction_to_local(back);
    for (std::size_t k = range.begin; k < range.end; ++k) contact.cells[k].displacement -= local;
    slid = slipped = true;
  }
  return slid;
}

Box world_bounds(const std::vector<Vec3f>& positions, const Pose& pose) {
  Box local;
  for (const Vec3f& p : positions) local.extend(p.cast<double>());
  Box world;
  for (int corner = 0; corner < 8; ++corner)
    world.extend(pose.to_world(local.corner(static_cast<Box::CornerType>(corner))));
  return world;
}

/// To be called when the drawn surface has another shape.
void note_new_shape(World& world, Entity organ) {
  OrganState& state = *world.find<OrganState>(organ);
  const OrganBody& body = *world.find<OrganBody>(organ);
  double greatest = 0.0;
  for (std::size_t v = 0; v < state.positions.size(); ++v)
    greatest = std::max(
        greatest,
        static_cast<double>((state.positions[v] - body.model->rest_positions[v]).squaredNorm()));
  state.greatest_displacement = std::sqrt(greatest);
  state.deformed = greatest > 0.0;
  ++state.version;
  OrganContact* contact = world.find<OrganContact>(organ);
  if (!contact) return;
  contact->surface->update(state.positions);
  world.find<OrganTouch>(organ)->bounds = world_bounds(state.positions, pose_of(world, organ));
}

/// The shape without forces: at rest, or as gravity has changed that. Nothing to do where it has
/// it.
void take_free_shape(World& world, Entity organ) {
  OrganState& state = *world.find<OrganState>(organ);
  const FreeShape* shape = world.find<FreeShape>(organ);
  if (state.frozen || !(state.pressed || (shape && shape->changed))) return;
  const OrganModel& model = *world.find<OrganBody>(organ)->model;
  state.pressed = false;
  state.on_gpu = false;
  if (shape && shape->moves) {
    state.displacements = shape->places;
    deformed_positions(model.drawn, state.displacements, {}, {}, {}, state.positions);
    state.normals_fit = false;
  } else {
    std::fill(state.displacements.begin(), state.displacements.end(), 0.0f);
    state.positions = model.rest_positions;
    state.normals = model.rest_normals;
    state.normals_fit = true;
  }
  note_new_shape(world, organ);
}

bool looks_the_same(const OrganState& state, const OrganDraft& draft) {
  if (draft.displacements.empty()) return false;  // it has no places to tell by
  for (std::size_t i = 0; i < state.displacements.size(); ++i)
    if (!(std::abs(draft.displacements[i] - state.displacements[i]) < kUnseen)) return false;
  return state.pressed;
}

/// Once an organ's forces are found: nothing that isn't finite goes on.
void accept_answer(World& world, Entity organ, OrganContact& contact, const FrameContext& context) {
  if (const auto stray = first_stray(contact.solution.forces)) {
    tell_stray(world, *context.report, {"deform organs", "forces", organ, *stray});
    contact.solution.converged = false;
    std::ranges::fill(contact.solution.forces, Vec3::Zero());
  }
  if (contact.solution.beyond_touchable > 0) context.report->raise(kOutOfReach);
  if (!contact.solution.converged) context.report->raise(kContactNotConverged);
}

/// What binds organs may ask for of one of them.
class OrganSolves {
 public:
  OrganSolves(World& world, const FrameContext& context) : world_(world), context_(context) {}

  /// Jaws slide, clips go where they are in balance. True: it must be solved again.
  bool settle_held(Entity organ) const {
    bool slipped = false;
    bool moved = slip_jaws(world_, organ, *world_.find<OrganContact>(organ), slipped);
    moved |= settle_clips(world_, organ);
    if (slipped) context_.report->raise(kGripSlipped);
    return moved;
  }
  void accept(Entity organ) const {
    accept_answer(world_, organ, *world_.find<OrganContact>(organ), context_);
  }
  void alone(Entity organ, const MatrixX& backing) const {
    OrganContact& contact = *world_.find<OrganContact>(organ);
    TissueContact& solver = *world_.find<OrganTouch>(organ)->solver;
    begin_clips(world_, organ);
    solver.solve(contact.cells, contact.solution, contact.response, backing);
    for (int pass = 0; pass < kSlipPasses && settle_held(organ); ++pass)
      solver.solve(contact.cells, contact.solution, contact.response, backing);
    accept(organ);
  }

 private:
  World& world_;
  const FrameContext& context_;
};

bool is_answered(const World& world, Entity organ) {
  const Binding* binding = world.one<Binding>();
  return binding && std::ranges::any_of(binding->binders, [&](const Binder& binder) {
           return binder.solves(world, organ);
         });
}

bool stays_as_it_is(const World& world, Entity organ) {
  const Binding* binding = world.one<Binding>();
  return binding && std::ranges::any_of(binding->binders, [&](const Binder& binder) {
           return binder.rests && binder.rests(world, organ);
         });
}

void hand_forces_to_tools(World& world, Entity organ, const OrganContact& contact,
                          FrameReport& report) {
  const Pose& pose = pose_of(world, organ);
  for (CellRange& range : world.find<OrganTouch>(organ)->ranges) {
    range.force = sum_of(contact.solution.forces, range);
    range.felt = range.force;
    InstrumentContact& tool = *world.find<InstrumentContact>(range.instrument);
    tool.force -= pose.direction_to_world(range.force);
    const double strength = range.force.norm();
    Jaws* jaws = range.held ? world.find<Jaws>(range.instrument) : nullptr;
    if (jaws) note_jaws(pose, range, contact.cells, contact.solution, report, *jaws);
    if (range.held || strength <= tool.strongest) continue;
    tool.touching = true;
    tool.strongest = strength;
    tool.organ = organ;
    tool.rest_point = range.rest_centre;
    tool.world_point = pose.to_world(range.centre);
    tool.world_normal = pose.direction_to_world(range.outward);
  }
}

/// Tools that let go, and those that rub nothing, leave nothing that clings.
void note_clinging_tissue(const OrganContact& contact, OrganTouch& touch) {
  std::vector<Cling> clings;
  for (const CellRange& range : touch.ranges) {
    if (range.held || contact.cells[range.begin].friction == 0.0) continue;
    const auto last =
        std::find_if(touch.clings.begin(), touch.clings.end(),
                     [&](const Cling& cling) { return cling.instrument == range.instrument; });
    Cling cling = clinging_tissue(range, contact.cells, contact.solution,
                                  last == touch.clings.end() ? nullptr : &*last);
    if (!cling.spots.empty()) clings.push_back(std::move(cling));
  }
  touch.clings = std::move(clings);
}

void take_forces_back(World& world, Entity organ) {
  const Pose& pose = pose_of(world, organ);
  for (CellRange& range : world.find<OrganTouch>(organ)->ranges) {
    InstrumentContact& tool = *world.find<InstrumentContact>(range.instrument);
    tool.force += pose.direction_to_world(range.force);
    tool.touching = false;
    range.force = range.felt = Vec3::Zero();
  }
}

/// Whether a shape that looks as before is made again.
enum class Repeat { kSkipped, kMade };

/// A broken value must not reach the state: the organ stays where it was, without force.
bool draft_is_sound(World& world, Entity organ, std::string_view stage,
                    const FrameContext& context) {
  const auto stray = first_stray(world.find<OrganDraft>(organ)->positions);
  if (!stray) return true;
  tell_stray(world, *context.report, {stage, "surface", organ, *stray});
  world.find<OrganState>(organ)->frozen = true;
  take_forces_back(world, organ);
  return false;
}

/// The drawn surface under this frame's forces, by the CPU.
void deform_here(World& world, Entity organ, Repeat repeat, std::string_view stage,
                 const FrameContext& context) {
  OrganContact& contact = *world.find<OrganContact>(organ);
  OrganState& state = *world.find<OrganState>(organ);
  OrganDraft& draft = *world.find<OrganDraft>(organ);
  TissueContact& tissue = *world.find<OrganTouch>(organ)->solver;
  tissue.place_displacements(contact.response, draft.displacements);
  if (const FreeShape* shape = world.find<FreeShape>(organ))
    for (std::size_t i = 0; i < shape->places.size(); ++i)
      draft.displacements[i] += shape->places[i];
  if (repeat == Repeat::kSkipped && own_cells(world, organ) == 0 && looks_the_same(state, draft))
    return;
  tissue.draw(draft.displacements, contact.cells, contact.solution, draft.positions);
  if (!draft_is_sound(world, organ, stage, context)) return;
  state.displacements.swap(draft.displacements);
  state.positions.swap(draft.positions);
  state.normals_fit = false;
  state.pressed = true;
  note_new_shape(world, organ);
}

/// Where an organ's last shape lies on the GPU, the CPU knows it without its normals: who asks for
/// them makes them.
void bring_normals_home(OrganState& state) {
  if (state.on_gpu) state.normals_fit = false;
  state.on_gpu = false;
  ++state.version;
}

}  // namespace

std::size_t own_cells(const World& world, Entity organ) {
  std::size_t own = std::max(end_of_shaft_cells(world, organ), end_of_clip_cells(world, organ));
  for (const CellRange& range : world.find<OrganTouch>(organ)->ranges)
    own = std::max(own, static_cast<std::size_t>(range.end));
  return own;
}

void deform_organs(World& world, const FrameContext& context) {
  Pool<OrganContact>& contacts = world.all<OrganContact>();
  for (std::size_t o = 0; o < contacts.size(); ++o)
    if (!stays_as_it_is(world, contacts.owner(o))) begin_finite_step(world, contacts.owner(o));
  const OrganSolves organs(world, context);
  if (const Binding* binding = world.one<Binding>()) {
    // A pointer each: an idle frame allocates nothing.
    const ContactSolves solves = {
        [&organs](Entity organ, const MatrixX& backing) { organs.alone(organ, backing); },
        [&organs](Entity organ) { return organs.settle_held(organ); },
        [&organs](Entity organ) { organs.accept(organ); }};
    for (const Binder& binder : binding->binders) binder.solve(world, solves);
  }
  const GpuOrgans* gpu = world.one<GpuOrgans>();
  for (std::size_t o = 0; o < contacts.size(); ++o) {
    const Entity organ = contacts.owner(o);
    OrganContact& contact = contacts[o];
    OrganTouch& touch = *world.find<OrganTouch>(organ);
    if (stays_as_it_is(world, organ)) continue;
    if (contact.cells.empty()) {
      contact.solution.forces.clear();
      touch.clings.clear();
      if (world.find<OrganState>(organ)->frozen || !touch.solver->moving()) {
        take_free_shape(world, organ);
        continue;
      }
    }
    if (!is_answered(world, organ)) organs.alone(organ, {});
    note_finite_step(world, organ, *context.report);
    if (!contact.solution.converged) continue;
    hand_forces_to_tools(world, organ, contact, *context.report);
    note_what_tools_meet(world, organ);
    note_clinging_tissue(contact, touch);
    if (contact.solution.touching == 0 && !touch.solver->moving()) {
      take_free_shape(world, organ);
      continue;
    }

    // What moves the free shape is known on the CPU alone.
    if (gpu && gpu->surfaces->holds(organ) && !world.find<FreeShape>(organ)) {
      gpu->surfaces->add(organ, world.find<OrganBody>(organ)->model->drawn, contact);
      continue;
    }
    deform_here(world, organ, Repeat::kSkipped, "deform organs", context);
  }
  if (gpu) gpu->surfaces->start();
  const Pool<FreeShape>& shapes = world.all<FreeShape>();
  for (std::size_t o = 0; o < shapes.size(); ++o)
    if (!world.find<OrganContact>(shapes.owner(o))) take_free_shape(world, shapes.owner(o));
}

void bind(World& world, const Binder& binder) {
  if (!world.one<Binding>()) world.all<Binding>().add(kWhole, {});
  world.one<Binding>()->binders.push_back(binder);
}

bool all_stay(const World& world) {
  return std::ranges::all_of(world.all<OrganTouch>().owners(),
                             [&](Entity organ) { return stays_as_it_is(world, organ); });
}

void fetch_surfaces(World& world, const FrameContext& context) {
  GpuSurfaces& gpu = *world.one<GpuOrgans>()->surfaces;
  gpu.finish([&](Entity organ, std::span<const Vec3f> positions) {
    OrganState& state = *world.find<OrganState>(organ);
    OrganDraft& draft = *world.find<OrganDraft>(organ);
    if (positions.empty()) {
      bring_normals_home(state);
      return deform_here(world, organ, Repeat::kMade, "fetch surfaces", context);
    }
    draft.positions.assign(positions.begin(), positions.end());
    if (!draft_is_sound(world, organ, "fetch surfaces", context)) return bring_normals_home(state);
    state.positions.swap(draft.positions);
    state.pressed = true;
    state.on_gpu = true;
    note_new_shape(world, organ);
  });
  if (!gpu.trouble().empty()) leave_gpu(world, std::string(gpu.trouble()));
}

void take_shape_of_body(World& world, Entity organ, const Continuation*) {
  const OrganModel& model = *world.find<OrganBody>(organ)->model;
  OrganState& state = *world.find<OrganState>(organ);
  world.find<OrganTouch>(organ)->solver->place_displacements({}, state.displacements);
  deformed_positions(model.drawn, state.displacements, {}, {}, {}, state.positions);
  state.normals = model.rest_normals;
  state.normals_fit = false;
  state.on_gpu = false;
  note_new_shape(world, organ);
}

void freeze_organ(World& world, Entity organ) {
  OrganState& state = *world.find<OrganState>(organ);
  const OrganModel& model = *world.find<OrganBody>(organ)->model;
  const auto mend = [](std::vector<Vec3f>& values, const std::vector<Vec3f>& rest) {
    for (std::size_t v = 0; v < values.size(); ++v)
      if (!values[v].allFinite()) values[v] = rest[v];
  };
  mend(state.positions, model.rest_positions);
  mend(state.normals, model.rest_normals);
  zero_strays(state);
  state.frozen = true;
  if (world.find<OrganTouch>(organ)) take_forces_back(world, organ);
  note_new_shape(world, organ);
}

void leave_gpu(World& world, const std::string& why) {
  GpuOrgans* gpu = world.one<GpuOrgans>();
  if (!gpu) return;
  gpu->surfaces->fail(why);
  forget_device_shapes(world);
}

void forget_device_shapes(World& world) {
  for (OrganState& state : world.all<OrganState>()) {
    if (!state.on_gpu) continue;
    bring_normals_home(state);
    // The CPU's are of an older shape: none that comes may be taken for this one.
    std::ranges::fill(state.displacements, std::numeric_limits<float>::max());
  }
}

}  // namespace viscera
