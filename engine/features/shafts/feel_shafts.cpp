#include <algorithm>

#include "engine/features/contact/contact.h"
#include "engine/features/contact/contact_cells.h"
#include "engine/features/contact/pressed_stiffness.h"
#include "engine/features/shafts/press_tools.h"
#include "engine/features/shafts/shaft_cells.h"
#include "engine/features/shafts/shafts.h"

namespace viscera {
namespace {

/// Forces on one shaft in one organ, and what remains of them for the next step.
class Feel {
 public:
  Feel(World& world, const Shaft& shaft, const Vec3& tip, const Vec3& pivot, bool held)
      : world_(world), shaft_(shaft), tip_(tip), pivot_(pivot), held_(held) {}

  /// Adds to the state's load, stiffness and pressed length.
  void take(ShaftMeeting& meeting, ShaftState& state, double& length) {
    meeting.force = Vec3::Zero();
    const OrganContact& contact = *world_.find<OrganContact>(meeting.organ);
    const std::vector<Vec3>& forces = contact.solution.forces;
    if (world_.find<OrganState>(meeting.organ)->frozen || !contact.solution.converged ||
        forces.size() != contact.cells.size()) {
      meeting.cling = {};
      return;
    }
    const Pose& pose = pose_of(world_, meeting.organ);
    pressed_.clear();
    ways_.clear();
    for (ShaftStretch& stretch : meeting.stretches) {
      double push = 0.0, pressed = 0.0;
      for (std::size_t k = stretch.begin; k < stretch.end; ++k) {
        const ContactCell& cell = contact.cells[k];
        const double one = forces[k].dot(cell.direction);
        if (!(one > 0.0)) continue;
        push += one;
        pressed += stretch.pitch;
        const Vec3 on_shaft =
            meeting.axis.at(stretch.along[k - stretch.begin]) + shaft_.radius * cell.direction;
        const Vec3 at = pose.to_world(on_shaft), force = -pose.direction_to_world(forces[k]);
        meeting.force += force;
        state.load.add(force, at, pivot_);
        if (held_) note_way(k, at, pose.direction_to_world(cell.direction));
      }
      length += pressed;
      stretch.half_width = half_width_under(push, pressed, shaft_.radius,
                                            world_.find<OrganBody>(meeting.organ)->model->material,
                                            stretch.half_width);
    }
    if (held_) state.stiffness += pressed_stiffness(world_, meeting.organ, pressed_, ways_);
    note_clinging(meeting, contact);
  }

  /// Of another tool.
  void take(const ToolPress& press, ShaftState& state) const {
    state.load.add(press.force, press.at, pivot_);
    const Vec3 way = way_of(press.at, press.direction);
    if (held_) state.stiffness += press.stiffness * way * way.transpose();
  }

 private:
  /// What the tip's motion along it moves this place by along `direction`.
  Vec3 way_of(const Vec3& at, const Vec3& direction) const {
    const Vec3 arm = (tip_ - pivot_).normalized();
    const double along = direction.dot(arm);
    return lever_share(at, tip_, pivot_) * (direction - along * arm) + along * arm;
  }
  /// How the tip's motion presses a cell.
  void note_way(std::size_t cell, const Vec3& at, const Vec3& direction) {
    pressed_.push_back(cell);
    ways_.push_back(way_of(at, direction));
  }

  void note_clinging(ShaftMeeting& meeting, const OrganContact& contact) const {
    if (shaft_.friction == 0.0) return;
    // Its parts move differently: how far the tissue followed is told by their mean.
    CellRange range;
    Cling clinging;
    const Cling last = std::move(meeting.cling);
    for (const ShaftStretch& stretch : meeting.stretches) {
      range.begin = stretch.begin;
      range.end = stretch.end;
      range.points = stretch.points;
      range.pitch = stretch.pitch;
      const double middle = 0.5 * (stretch.from + stretch.to);
      range.tip = meeting.axis.at(middle);
      range.outward = stretch.outward_at(middle);
      if (!last.spots.empty()) range.moved = meeting.axis.begin - last.tip;
      Cling one = clinging_tissue(range, contact.cells, contact.solution,
                                  last.spots.empty() ? nullptr : &last);
      clinging.pitch = std::max(clinging.pitch, one.pitch);
      clinging.followed = std::min(clinging.followed, one.followed);
      clinging.spots.insert(clinging.spots.end(), one.spots.begin(), one.spots.end());
    }
    clinging.tip = meeting.axis.begin;
    meeting.cling = std::move(clinging);
  }

  World& world_;
  const Shaft& shaft_;
  Vec3 tip_, pivot_;
  bool held_;
  std::vector<std::size_t> pressed_;
  std::vector<Vec3> ways_;  // of these, world
};

void note_greatest(const World& world, ShaftState& state, double length) {
  ShaftFigures& most = state.greatest;
  most.force = std::max(most.force, state.load.force.norm());
  most.torque = std::max(most.torque, state.load.torque.norm());
  most.at_tip = std::max(most.at_tip, state.lever.at_tip.norm());
  most.reaction = std::max(most.reaction, state.lever.reaction.norm());
  most.length = std::max(most.length, length);
  const std::vector<Entity>& organs = world.model().organs();
  for (const ShaftMeeting& meeting : state.meetings) {
    const auto o =
        static_cast<std::size_t>(std::ranges::find(organs, meeting.organ) - organs.begin());
    most.organs[o] = std::max(most.organs[o], meeting.force.norm());
  }
}

void note_greatest(const World& world, const ToolPress& press, ShaftFigures& most) {
  const std::vector<Entity>& shafts = world.all<ShaftState>().owners();
  double& force =
      most.tools[static_cast<std::size_t>(std::ranges::find(shafts, press.other) - shafts.begin())];
  force = std::max(force, press.force.norm());
  most.crossed = std::max(most.crossed, press.overlap);
}

}  // namespace

void feel_shafts(World& world, const FrameContext& context) {
  Pool<ShaftState>& states = world.all<ShaftState>();
  std::vector<ToolPress> presses;
  if (shafts_of(world.model().scene()).tools) presses = press_tools(world, context);
  for (std::size_t i = 0; i < states.size(); ++i) {
    const Entity entity = states.owner(i);
    ShaftState& state = states[i];
    const InstrumentBody* body = world.find<InstrumentBody>(entity);
    const Vec3 tip = body ? Vec3(world.find<InstrumentState>(entity)->tip) : state.axis.begin;
    const Vec3 pivot = body ? body->description.trocar : state.axis.at(state.axis.length);
    state.load = {};
    state.lever = {};
    state.stiffness = Mat3::Zero();
    double length = 0.0;
    Feel feel(world, *world.find<Shaft>(entity), tip, pivot, world.find<HeldTip>(entity));
    for (ShaftMeeting& meeting : state.meetings) feel.take(meeting, state, length);
    for (const ToolPress& press : presses) {
      if (!(press.tool == entity)) continue;
      feel.take(press, state);
      note_greatest(world, press, state.greatest);
    }
    if (body) {
      state.lever = about_trocar(state.load, tip, pivot);
      world.find<InstrumentContact>(entity)->force += state.lever.at_tip;
    }
    note_greatest(world, state, length);
  }
}

}  // namespace viscera
