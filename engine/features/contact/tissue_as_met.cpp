#include "engine/features/contact/tissue_as_met.h"

#include <algorithm>
#include <cmath>

#include "engine/features/contact/contact.h"
#include "engine/features/contact/foot.h"
#include "engine/simulation/frame.h"
#include "engine/simulation/instruments.h"

namespace viscera {
namespace {

/// Where no cells of the tool are: the motion of the drawn surface over this many mean spacings of
/// its vertices about the foot, and at least so many radii of the tool.
constexpr double kSpacingsAbout = 2.0, kRadiiAbout = 1.5;
/// What a way back and one on make of the share that is gone of it, and the least. Chosen.
constexpr double kShareBack = 0.5, kShareOn = 1.2, kLeastShare = 0.05;

Pose composed(const Pose& outer, const Pose& inner) {
  return {outer.to_world(inner.position), (outer.orientation * inner.orientation).normalized()};
}

/// Its shape without this tool isn't its shape at rest.
bool moves_itself(const World& world, Entity organ) {
  return world.find<OrganTouch>(organ)->solver->abilities().moves;
}

const SurfaceScan& scan_of(const World& world, Entity organ) {
  const RescannedSurface* again = world.find<RescannedSurface>(organ);
  return again ? again->scan : world.find<ScannedSurface>(organ)->scan;
}

/// About a range of cells; nothing where they have no side.
std::optional<FirstOrder> about_cells(const OrganContact& contact, const CellRange& range) {
  std::vector<Vec3> places;
  Vec3 normal = Vec3::Zero();
  for (std::size_t k = range.begin; k < range.end; ++k) {
    places.push_back(contact.cells[k].position);
    normal += contact.cells[k].normal;
  }
  if (!(normal.norm() > 0.0)) return std::nullopt;
  return FirstOrder(places, normal);
}

/// How far a tool itself has carried the tissue that it presses aside, across the contact's
/// direction: the mean over its forces [m]. By symmetry none on a half-space; near an edge, or
/// where a body gives way as a whole, tissue leaves sideways from under the tool. `others` moved
/// its cells by so much.
Vec3 carried_aside(const OrganContact& contact, const CellRange& range,
                   std::span<const Vec3> displacements, std::span<const Vec3> others) {
  double pressed = 0.0;
  Vec3 sum = Vec3::Zero();
  for (std::size_t k = range.begin; k < range.end; ++k) {
    const double push = contact.solution.forces[k].dot(contact.cells[k].direction);
    if (!(push > 0.0)) continue;
    const Vec3 by_others = others.empty() ? Vec3::Zero() : others[k - range.begin];
    sum += push * (displacements[k] - by_others);
    pressed += push;
  }
  if (pressed == 0.0) return Vec3::Zero();
  sum /= pressed;
  return sum - sum.dot(range.outward) * range.outward;
}

/// Deep in soft tissue, cells that lie a little to one side may carry it farther to the other, to
/// and fro from frame to frame. So a share of the way to where it is found is gone: each way back
/// halves it, each way on raises it by a fifth.
void settle(const Pose& found, CellRange& range) {
  const Pose before = range.met;
  const bool back = (found.position - before.position).dot(range.met_way) < 0.0;
  const double share = (back ? kShareBack : kShareOn) * range.met_share;
  range.met_share = std::max(kLeastShare, std::min(1.0, share));
  range.met = range.met_share == 1.0
                  ? found
                  : Pose{before.position + range.met_share * (found.position - before.position),
                         before.orientation.slerp(range.met_share, found.orientation)};
  range.met_way = range.met.position - before.position;
}

/// Under a tool that presses or holds: from its cells, since the drawn surface shows its own dent.
/// False: this frame's contact has no answer.
bool meet_touched(const World& world, Entity organ, const TissueUnder& under,
                  TissueSnapshot& snapshot) {
  if (!under.about || !under.others) return false;
  // It is alone.
  if (under.others->taken.size() == 0 && !world.find<FreeShape>(organ) &&
      !moves_itself(world, organ))
    return true;
  const Pose motion = under.about->motion(under.others->free);
  snapshot.pose = composed(snapshot.pose, motion);
  if (under.others->taken.size() > 0)
    snapshot.hold = under.about->hold(*under.others, motion.orientation);
  return true;
}

/// Under a tool that doesn't: as the surface is drawn.
Pose motion_as_drawn(const World& world, Entity organ, const SurfacePoint& nearest, double radius) {
  const OrganState& state = *world.find<OrganState>(organ);
  if (!state.deformed || nearest.triangle < 0) return {};
  const TriangleSurface& rest = world.find<OrganBody>(organ)->model->surface;
  const Vec3 foot = position(rest, nearest);
  const auto& corners = rest.triangles[static_cast<std::size_t>(nearest.triangle)];
  const auto corner = [&](std::size_t c) -> const Vec3& {
    return rest.vertices[static_cast<std::size_t>(corners[c])];
  };
  const Vec3 across = (corner(1) - corner(0)).cross(corner(2) - corner(0));
  const double edge = std::sqrt(across.norm());
  const double about = std::max(kSpacingsAbout * edge, kRadiiAbout * radius);
  const OrganModel& model = *world.find<OrganBody>(organ)->model;
  std::vector<Vec3> places, displacements;
  for (std::size_t v = 0; v < rest.vertices.size(); ++v) {
    if ((rest.vertices[v] - foot).squaredNorm() > about * about ||
        model.rest_normals[v].cast<double>().dot(across) <= 0.0)
      continue;
    places.push_back(rest.vertices[v]);
    displacements.push_back((state.positions[v] - model.rest_positions[v]).cast<double>());
  }
  if (places.empty()) return {};
  return FirstOrder(places, across).motion(displacements);
}

}  // namespace

void take_motion_as_met(const World& world, Entity organ, const Vec3& tip, CellRange& range) {
  for (const CellRange& last : world.find<OrganTouch>(organ)->ranges)
    if (last.instrument == range.instrument && !last.held) {
      const bool goes = (tip - last.tip).norm() > kStandsStill * world.model().time_step();
      range.met = last.met;
      range.met_way = last.met_way;
      range.met_share = goes ? 1.0 : last.met_share;
      return;
    }
  if (!world.find<OrganState>(organ)->deformed) return;
  const double extent = world.find<InstrumentBody>(range.instrument)->extent;
  const auto nearest = world.find<OrganContact>(organ)->surface->closest(tip, extent + kFrameReach);
  if (nearest) range.met = motion_as_drawn(world, organ, nearest->point, extent);
}

void note_what_tools_meet(World& world, Entity organ) {
  const OrganContact& contact = *world.find<OrganContact>(organ);
  OrganTouch& touch = *world.find<OrganTouch>(organ);
  for (CellRange& range : touch.ranges) {
    if (range.held) continue;
    Pose found;
    std::vector<Vec3> by_others;
    const std::size_t own = range.end - range.begin;
    if (own < contact.cells.size() || world.find<FreeShape>(organ) || moves_itself(world, organ)) {
      const auto about = about_cells(contact, range);
      auto others = touch.solver->hold_of_others(contact.cells, range.begin, range.end,
                                                 MatrixX(0, static_cast<Eigen::Index>(own)));
      if (about && others) {
        found = about->motion(others->free);
        by_others = std::move(others->free);
      }
    }
    found.position += carried_aside(contact, range, touch.solver->cell_displacements(), by_others);
    settle(found, range);
  }
}

std::function<TissueUnder()> ask_tissue_under(World& world, Entity organ, Entity instrument) {
  const OrganContact* contact = world.find<OrganContact>(organ);
  if (!contact || world.find<OrganState>(organ)->frozen) return {};
  const OrganTouch& touch = *world.find<OrganTouch>(organ);
  const auto mine = std::ranges::find(touch.ranges, instrument, &CellRange::instrument);
  if (mine == touch.ranges.end()) return {};
  return [contact, &range = *mine, &solver = *touch.solver] {
    TissueUnder under;
    if (!contact->solution.converged) return under;
    under.about = about_cells(*contact, range);
    if (under.about)
      under.others =
          solver.hold_of_others(contact->cells, range.begin, range.end, under.about->shares());
    return under;
  };
}

bool meet_tissue(World& world, Entity organ, Entity instrument, double reach,
                 const std::optional<TissueUnder>& under, TissueSnapshot& snapshot) {
  snapshot.pose = pose_of(world, organ);
  snapshot.hold = {};
  snapshot.nearest = {};
  const OrganContact* contact = world.find<OrganContact>(organ);
  if (!contact || world.find<OrganState>(organ)->frozen) return true;
  const Vec3& tip = world.find<InstrumentState>(instrument)->tip;
  if (world.find<OrganTouch>(organ)->bounds.exteriorDistance(tip) > reach) return true;
  const Vec3 from = pose_of(world, organ).to_local(tip);
  if (under) {
    // The next step's contact asks the fitted tree again.
    const auto hit = contact->surface->closest(from, reach);
    if (!hit) return true;
    snapshot.nearest = hit->point;
    return meet_touched(world, organ, *under, snapshot);
  }
  const auto found = scan_of(world, organ)
                         .closest(world.find<OrganBody>(organ)->model->surface.triangles,
                                  world.find<OrganState>(organ)->positions, from, reach);
  if (!found) return true;
  snapshot.nearest = {found->triangle, found->weights};
  snapshot.pose =
      composed(snapshot.pose, motion_as_drawn(world, organ, snapshot.nearest,
                                              world.find<InstrumentBody>(instrument)->extent));
  return true;
}

}  // namespace viscera
