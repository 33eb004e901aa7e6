#include <algorithm>

#include "engine/features/contact/contact.h"
#include "engine/features/shafts/shaft_cells.h"
#include "engine/features/shafts/shafts.h"

namespace viscera {
namespace {

/// How deep the drawn surface lies in the shaft where it was pressed in the last step [m].
double overlap_of(const ShaftMeeting& last, double radius, const TissueSheet& drawn) {
  double deepest = 0.0;
  for (const ShaftStretch& stretch : last.stretches)
    for (const SurfacePoint& point : stretch.points) {
      const Vec3 off = drawn.position(point) - last.axis.begin;
      const double distance = off.cross(last.axis.direction).norm();
      deepest = std::max(deepest, radius - distance);
    }
  return deepest;
}

bool is_spared(const Shaft& shaft, Entity organ) {
  return std::ranges::any_of(shaft.spared,
                             [&](const Shaft::Spared& one) { return one.organ == organ; });
}

class Meet {
 public:
  Meet(World& world, Entity shaft, const FrameContext& context)
      : world_(world),
        context_(context),
        shaft_(*world.find<Shaft>(shaft)),
        state_(*world.find<ShaftState>(shaft)),
        before_(state_.axis) {
    state_.axis = axis_of_shaft(world, shaft, context.time);
  }

  void run() {
    std::vector<ShaftMeeting> meetings;
    const Pool<OrganContact>& contacts = world_.all<OrganContact>();
    for (std::size_t o = 0; o < contacts.size(); ++o)
      if (auto meeting = meet(contacts.owner(o))) meetings.push_back(*std::move(meeting));
    state_.meetings = std::move(meetings);
  }

 private:
  /// Nothing: the organ is out of reach.
  std::optional<ShaftMeeting> meet(Entity organ) {
    const OrganTouch& touch = *world_.find<OrganTouch>(organ);
    const OrganState& tissue = *world_.find<OrganState>(organ);
    if (tissue.frozen || is_spared(shaft_, organ)) return std::nullopt;
    // As far as it went besides: where it was swept through, it has touched.
    const double went =
        std::max((state_.axis.begin - before_.begin).norm(),
                 (state_.axis.at(state_.axis.length) - before_.at(state_.axis.length)).norm());
    const auto part = part_in_box(state_.axis, touch.bounds, shaft_.radius + kContactMargin + went);
    if (!part) return std::nullopt;
    const ShaftMeeting* last = nullptr;
    for (const ShaftMeeting& one : state_.meetings)
      if (one.organ == organ) last = &one;
    const Pose& pose = pose_of(world_, organ);
    OrganContact& contact = *world_.find<OrganContact>(organ);
    const OrganModel& model = *world_.find<OrganBody>(organ)->model;
    const TissueSheet drawn(model, tissue, *contact.surface);
    ShaftMeeting meeting;
    meeting.organ = organ;
    meeting.axis = in_frame(state_.axis, pose);
    const ShaftAbout about{meeting.axis, last ? last->axis : in_frame(before_, pose), shaft_.radius,
                           part->first, part->second};
    if (last)
      state_.greatest.overlap =
          std::max(state_.greatest.overlap, overlap_of(*last, shaft_.radius, drawn));
    Stretches found = find_stretches(about, drawn, model.finest_spacing,
                                     last ? std::span(last->stretches) : std::span<ShaftStretch>());
    if (found.surprised) context_.report->raise(kShaftInside);
    ShaftRub rub{shaft_.friction, nullptr, Vec3::Zero()};
    if (last && !last->cling.spots.empty()) {
      rub.cling = &last->cling;
      rub.undrawn = undrawn_drag(last->cling, tissue, model);
      meeting.cling = last->cling;
    }
    bool unreached = false;
    const std::size_t first = contact.cells.size();
    for (ShaftStretch& stretch : found.all) {
      if (!lay_shaft_cells(about, rub, model, *touch.solver, drawn, stretch, contact.cells,
                           unreached))
        continue;
      contact.held_points.insert(contact.held_points.end(), stretch.points.begin(),
                                 stretch.points.end());
      meeting.stretches.push_back(std::move(stretch));
    }
    if (unreached) context_.report->raise(kOutOfReach);
    state_.greatest.cells =
        std::max<std::uint64_t>(state_.greatest.cells, contact.cells.size() - first);
    return meeting;
  }

  World& world_;
  const FrameContext& context_;
  const Shaft& shaft_;
  ShaftState& state_;
  ShaftAxis before_;  // world
};

}  // namespace

void meet_shafts(World& world, const FrameContext& context) {
  const Pool<Shaft>& shafts = world.all<Shaft>();
  if (!shafts_of(world.model().scene()).touch) {
    for (std::size_t i = 0; i < shafts.size(); ++i)
      world.find<ShaftState>(shafts.owner(i))->axis =
          axis_of_shaft(world, shafts.owner(i), context.time);
    return;
  }
  for (std::size_t i = 0; i < shafts.size(); ++i) Meet(world, shafts.owner(i), context).run();
}

}  // namespace viscera
