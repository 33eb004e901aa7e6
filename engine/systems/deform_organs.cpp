#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/systems/contact_cells.h"
#include "engine/systems/gpu_surfaces.h"
#include "engine/systems/links.h"
#include "engine/systems/local_organs.h"
#include "engine/systems/systems.h"

namespace viscera {
namespace {

/// A jaw that slips is solved again with the tissue let back; this many times a frame at most.
constexpr int kSlipPasses = 4;
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
/// account for other tools on the organ. True when some jaw slid.
bool slip_jaws(World& world, const OrganBody& body, OrganContact& contact) {
  bool slid = false;
  for (CellRange& range : contact.ranges) {
    if (!range.held) continue;
    Grasp& grasp = *world.instrument_contacts.find(range.instrument)->grasp;
    const InstrumentBody& tool = *world.instrument_bodies.find(range.instrument);
    const double force = sum_of(contact.solution.forces, range).norm();
    const double limit = tool.description.grip_limit;
    if (force <= limit * 1.001) continue;
    const InstrumentState& state = *world.instrument_states.find(range.instrument);
    const Vec3 travel = jaw_travel(grasp, state, body.pose);
    const Vec3 back = (1.0 - limit / force) * travel;
    // Without travel of its own the pull comes from other tools; sliding can't lessen it.
    if (back.norm() < kLeastSlip) continue;
    grasp.slipped += back;
    const Vec3 local = body.pose.direction_to_local(back);
    for (std::size_t k = range.begin; k < range.end; ++k) contact.cells[k].displacement -= local;
    slid = true;
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
void moved(World& world, Entity organ) {
  OrganState& state = *world.organ_states.find(organ);
  const OrganBody& body = *world.organ_bodies.find(organ);
  double greatest = 0.0;
  for (std::size_t v = 0; v < state.positions.size(); ++v)
    greatest = std::max(
        greatest,
        static_cast<double>((state.positions[v] - body.model->rest_positions[v]).squaredNorm()));
  state.greatest_displacement = std::sqrt(greatest);
  state.deformed = greatest > 0.0;
  ++state.version;
  OrganContact* contact = world.organ_contacts.find(organ);
  if (!contact) return;
  contact->surface->update(state.positions);
  contact->bounds = world_bounds(state.positions, body.pose);
}

/// The shape without forces: at rest, or as gravity has changed that. Nothing to do where it has
/// it.
void take_free_shape(World& world, Entity organ) {
  OrganState& state = *world.organ_states.find(organ);
  const OrganSag* sag = world.organ_sags.find(organ);
  if (state.frozen || !(state.pressed || (sag && sag->changed))) return;
  const OrganModel& model = *world.organ_bodies.find(organ)->model;
  state.pressed = false;
  state.on_gpu = false;
  if (sag && sag->moves()) {
    state.displacements = sag->places;
    deformed_positions(model.drawn, state.displacements, {}, {}, {}, state.positions);
    state.normals_fit = false;
  } else {
    std::fill(state.displacements.begin(), state.displacements.end(), 0.0f);
    state.positions = model.rest_positions;
    state.normals = model.rest_normals;
    state.normals_fit = true;
  }
  moved(world, organ);
}

bool looks_the_same(const OrganState& state) {
  for (std::size_t i = 0; i < state.displacements.size(); ++i)
    if (!(std::abs(state.next_displacements[i] - state.displacements[i]) < kUnseen)) return false;
  return state.pressed;
}

bool all_finite(const std::vector<Vec3f>& values) {
  return std::all_of(values.begin(), values.end(), [](const Vec3f& v) { return v.allFinite(); });
}

void solve_contact(World& world, const OrganBody& body, OrganContact& contact,
                   const MatrixX& backing, const FrameContext& context) {
  contact.solver->solve(contact.cells, contact.solution, contact.response, backing);
  for (int pass = 0; pass < kSlipPasses && slip_jaws(world, body, contact); ++pass) {
    context.report->raise(FrameFlag::kGripSlipped);
    contact.solver->solve(contact.cells, contact.solution, contact.response, backing);
  }
  if (contact.solution.beyond_touchable > 0) context.report->raise(FrameFlag::kOutOfReach);
  if (!contact.solution.converged) context.report->raise(FrameFlag::kContactNotConverged);
}

void hand_forces_to_tools(World& world, Entity organ, const OrganBody& body,
                          OrganContact& contact) {
  for (CellRange& range : contact.ranges) {
    range.force = sum_of(contact.solution.forces, range);
    InstrumentContact& tool = *world.instrument_contacts.find(range.instrument);
    tool.force -= body.pose.direction_to_world(range.force);
    const double strength = range.force.norm();
    if (range.held || strength <= tool.strongest) continue;
    tool.touching = true;
    tool.strongest = strength;
    tool.organ = organ;
    tool.rest_point = range.rest_centre;
    tool.world_point = body.pose.to_world(range.centre);
    tool.world_normal = body.pose.direction_to_world(range.outward);
  }
}

/// Tools that let go, and those that rub nothing, leave nothing that clings.
void note_clinging_tissue(OrganContact& contact) {
  std::vector<Cling> clings;
  for (const CellRange& range : contact.ranges) {
    if (range.held || contact.cells[range.begin].friction == 0.0) continue;
    const auto last =
        std::find_if(contact.clings.begin(), contact.clings.end(),
                     [&](const Cling& cling) { return cling.instrument == range.instrument; });
    Cling cling = clinging_tissue(range, contact.cells, contact.solution,
                                  last == contact.clings.end() ? nullptr : &*last);
    if (!cling.spots.empty()) clings.push_back(std::move(cling));
  }
  contact.clings = std::move(clings);
}

void take_forces_back(World& world, const OrganBody& body, OrganContact& contact) {
  for (CellRange& range : contact.ranges) {
    InstrumentContact& tool = *world.instrument_contacts.find(range.instrument);
    tool.force += body.pose.direction_to_world(range.force);
    tool.touching = false;
    range.force = Vec3::Zero();
  }
}

/// Whether a shape that looks as before is made again.
enum class Repeat { kSkipped, kMade };

/// The drawn surface under this frame's forces, by the CPU.
void deform_here(World& world, Entity organ, Repeat repeat) {
  const OrganBody& body = *world.organ_bodies.find(organ);
  OrganContact& contact = *world.organ_contacts.find(organ);
  OrganState& state = *world.organ_states.find(organ);
  if (body.model->in_half_precision()) {
    place_displacements(body.model->half_columns, contact.response, state.next_displacements);
    if (const StiffnessUpdate* update = contact.solver->update())
      subtract_update(*update, contact.response.touched, contact.response.loads,
                      state.next_displacements);
  } else
    contact.solver->place_displacements(state.next_displacements);
  if (const OrganSag* sag = world.organ_sags.find(organ))
    for (std::size_t i = 0; i < sag->places.size(); ++i)
      state.next_displacements[i] += sag->places[i];
  if (repeat == Repeat::kSkipped && contact.ranges.empty() && looks_the_same(state)) return;
  deformed_positions(body.model->drawn, state.next_displacements, contact.solution.near_fields,
                     contact.cells, contact.solution.forces, state.next_positions);
  // A broken value must not reach the state: the organ stays where it was, without force.
  if (!all_finite(state.next_positions)) {
    state.frozen = true;
    take_forces_back(world, body, contact);
    return;
  }
  state.displacements.swap(state.next_displacements);
  state.positions.swap(state.next_positions);
  state.normals_fit = false;
  state.pressed = true;
  moved(world, organ);
}

/// Where an organ's last shape lies on the GPU, the CPU knows it without its normals: who asks for
/// them makes them.
void bring_normals_home(OrganState& state) {
  if (state.on_gpu) state.normals_fit = false;
  state.on_gpu = false;
  ++state.version;
}

}  // namespace

void deform_organs(World& world, const FrameContext& context) {
  solve_linked(world, [&](Entity organ, const MatrixX& backing) {
    solve_contact(world, *world.organ_bodies.find(organ), *world.organ_contacts.find(organ),
                  backing, context);
  });
  for (std::size_t o = 0; o < world.organ_contacts.size(); ++o) {
    OrganContact& contact = world.organ_contacts[o];
    if (contact.cells.empty()) {
      contact.solution.forces.clear();
      contact.clings.clear();
      take_free_shape(world, world.organ_contacts.owner(o));
      continue;
    }
    const Entity organ = world.organ_contacts.owner(o);
    const OrganBody& body = *world.organ_bodies.find(organ);

    if (!is_link_loaded(world, organ)) solve_contact(world, body, contact, {}, context);
    if (!contact.solution.converged) continue;
    hand_forces_to_tools(world, organ, body, contact);
    note_clinging_tissue(contact);
    if (contact.solution.touching == 0) {
      take_free_shape(world, organ);
      continue;
    }

    // What gravity and shrinkage add is known on the CPU alone.
    if (world.gpu && world.gpu->holds(organ) && !world.organ_sags.find(organ)) {
      world.gpu->add(organ, body.model->drawn, contact);
      continue;
    }
    deform_here(world, organ, Repeat::kSkipped);
  }
  if (world.gpu) world.gpu->start();
  deform_local_organs(world, context);
  for (std::size_t o = 0; o < world.organ_sags.size(); ++o)
    if (!world.organ_contacts.find(world.organ_sags.owner(o)))
      take_free_shape(world, world.organ_sags.owner(o));
}

void fetch_surfaces(World& world, const FrameContext&) {
  world.gpu->finish([&](Entity organ, std::span<const Vec3f> positions) {
    const OrganBody& body = *world.organ_bodies.find(organ);
    OrganContact& contact = *world.organ_contacts.find(organ);
    OrganState& state = *world.organ_states.find(organ);
    if (positions.empty()) {
      bring_normals_home(state);
      return deform_here(world, organ, Repeat::kMade);
    }
    state.next_positions.assign(positions.begin(), positions.end());
    if (!all_finite(state.next_positions)) {
      bring_normals_home(state);
      state.frozen = true;
      take_forces_back(world, body, contact);
      return;
    }
    state.positions.swap(state.next_positions);
    state.pressed = true;
    state.on_gpu = true;
    moved(world, organ);
  });
  if (!world.gpu->trouble().empty()) leave_gpu(world, world.gpu->trouble());
}

void leave_gpu(World& world, const std::string& why) {
  if (!world.gpu) return;
  world.gpu->fail(why);
  for (std::size_t o = 0; o < world.organ_states.size(); ++o) {
    OrganState& state = world.organ_states[o];
    if (!state.on_gpu) continue;
    bring_normals_home(state);
    // The CPU's are of an older shape: none that comes may be taken for this one.
    std::ranges::fill(state.displacements, std::numeric_limits<float>::infinity());
  }
}

}  // namespace viscera
