// Where a blade's edge is in tissue as it was at rest, and what it has swept since the last step.
#include <algorithm>
#include <cmath>

#include "engine/features/breathing/breathing.h"
#include "engine/features/contact/tissue_sheet.h"
#include "engine/features/parting/jaw_knife.h"
#include "engine/features/parting/parting.h"
#include "engine/features/parting/remove_pieces.h"
#include "kernels/parting/blade_sweep.h"

namespace viscera {
namespace {

/// Places along an edge are so far from each other, at most [m]: between them it stays straight at
/// rest.
constexpr double kAlongEdge = 1e-3;
/// A blade whose edge is farther from an organ than this doesn't come to it within a step [m].
constexpr double kBeside = 6e-3;
/// What has moved less than this has swept nothing that a voxel sees, in voxels: its way adds up
/// until it is more.
constexpr double kStill = 0.02;
/// Of the search for where a place was at rest.
constexpr int kMostSteps = 20;
constexpr double kFound = 1e-6;  // [m]

/// An organ as it is now, to find where places of it were at rest. All in the organ's frame.
class MovedTissue {
 public:
  MovedTissue(const World& world, Entity organ)
      : model_(*world.find<OrganBody>(organ)->model),
        state_(*world.find<OrganState>(organ)),
        drawn_(*world.find<OrganContact>(organ)->surface),
        moved_(world.find<OrganTouch>(organ)->solver->state().motion.displacements),
        left_(*world.find<OrganLeft>(organ)),
        fields_(*left_.fields),
        skin_(*world.find<Cuttable>(organ)->organ->skin) {}

  struct AtRest {
    Vec3 place = Vec3::Zero();  ///< [m]
    double above = 0.0;         ///< the drawn surface; below 0 in tissue [m]
    double above_skin = 0.0;    ///< the surface that the organ had as nothing was cut [m]
    std::int32_t piece = 0;     ///< of the organ, whose surface is nearest
  };
  /// Tissue that is at this place; beside the organ what moves as the surface nearest to it does.
  std::optional<AtRest> at_rest(const Vec3& place, double reach) const {
    const auto hit = drawn_.closest(place, reach);
    if (!hit) return std::nullopt;
    const TissueSheet sheet(model_, state_, drawn_);
    const Vec3 rest = corner_mean(model_.rest_positions, model_.surface, hit->point);
    const bool inside = (place - hit->position).dot(sheet.normal(hit->point)) < 0.0;
    AtRest found{.place = place - (hit->position - rest),
                 .above = inside ? -hit->distance : hit->distance,
                 .piece = piece_of(left_.pieces, model_.surface, hit->point.triangle)};
    if (inside) refine(place, found.place);
    found.above_skin = skin_.signed_distance(found.place);
    return found;
  }

 private:
  Vec3 displacement(const Vec3& rest, bool& known) const {
    Vec3 moved = Vec3::Zero();
    known = fields_.evaluate(rest, false, values_);
    for (std::size_t k = 0; known && k < values_.nodes.size(); ++k) {
      const auto node = static_cast<std::size_t>(values_.nodes[k]);
      moved += values_.values[k] * Eigen::Map<const Vec3>(moved_.data() + 3 * node);
    }
    return moved;
  }
  /// rest + displacement(rest) = place, from a guess, which stays where the search ends in nothing.
  void refine(const Vec3& place, Vec3& rest) const {
    Vec3 now = rest;
    double last = std::numeric_limits<double>::infinity();
    for (int step = 0; step < kMostSteps; ++step) {
      bool known = false;
      const Vec3 missed = place - now - displacement(now, known);
      if (!known || !(missed.norm() < last)) return;
      last = missed.norm();
      now += missed;
      if (last < kFound) break;
    }
    rest = now;
  }

  const OrganModel& model_;
  const OrganState& state_;
  const CollisionSurface& drawn_;
  const std::vector<double>& moved_;
  const OrganLeft& left_;
  const ShapeFunctions& fields_;
  const SurfaceTree& skin_;
  mutable ShapeValues values_;
};

/// Of a straight piece between two heights above a surface.
double share_below(double one, double other) {
  if (one <= 0.0 && other <= 0.0) return 1.0;
  if (one >= 0.0 && other >= 0.0) return 0.0;
  return std::min(one, other) / (std::min(one, other) - std::max(one, other));
}

/// How wide a cut by it is in these voxels [m].
double kerf_of(const BladeDescription& blade, const TissueShare& tissue) {
  return std::max(blade.thickness, tissue.least_kerf());
}

/// A blade in one organ.
class Cutting {
 public:
  Cutting(World& world, Entity organ, const BladeDescription& blade)
      : world_(world),
        organ_(organ),
        blade_(blade),
        tissue_(world, organ),
        leaving_(leaving_pieces(world, organ, world.find<OrganCut>(organ)->removed.size())) {}

  /// From where the edge was, in `track`, to where it is; if it `cuts`, through what is between.
  /// The force on the blade, world [N].
  Vec3 go_on(const std::vector<Vec3>& edge, bool cuts, BladeTrack& track) {
    OrganCut& cut = *world_.find<OrganCut>(organ_);
    std::vector<Vec3> rest;
    std::vector<double> above, outside;
    std::vector<std::int32_t> pieces;
    for (const Vec3& place : edge) {
      const auto found = tissue_.at_rest(place, blade_.length + kBeside);
      if (!found) {
        track.lose();
        return Vec3::Zero();
      }
      rest.push_back(found->place);
      above.push_back(found->above);
      outside.push_back(beyond_kerf(*found, cut.gone));
      pieces.push_back(found->piece);
    }
    const bool follows = track.edge.size() == rest.size() && track.outside.size() == rest.size() &&
                         track.pieces.size() == rest.size();
    const bool same_body = std::exchange(track.body, cut.bodies) == cut.bodies;
    for (std::size_t k = 0; follows && cuts && k < rest.size(); ++k) {
      if (pieces[k] != track.pieces[k] ||
          !((rest[k] - track.edge[k]).norm() < kStill * cut.gone.voxel()))
        continue;
      rest[k] = track.edge[k];
      above[k] = track.above[k];
      outside[k] = track.outside[k];
    }
    const std::vector<Vec3> before = std::exchange(track.edge, rest);
    const std::vector<double> outside_before = std::exchange(track.outside, outside);
    track.above = std::move(above);
    const std::vector<std::int32_t> pieces_before = std::exchange(track.pieces, pieces);
    if (!follows || !cuts) return Vec3::Zero();
    Vec3 force = Vec3::Zero();
    for (std::size_t k = 0; k + 1 < rest.size(); ++k) {
      // From one piece to another there is no way at rest.
      if (pieces[k] != pieces[k + 1] ||
          (same_body && (pieces_before[k] != pieces[k] || pieces_before[k + 1] != pieces[k])))
        continue;
      // What leaves the scene does so in one.
      if (std::ranges::find(leaving_, pieces[k]) != leaving_.end()) continue;
      // An edge of the organ may stick out between places that are all outside.
      if (std::min({outside[k], outside[k + 1], outside_before[k], outside_before[k + 1]}) >
          0.5 * kAlongEdge)
        continue;
      const double inside = 0.5 * (share_below(outside[k], outside[k + 1]) +
                                   share_below(outside_before[k], outside_before[k + 1]));
      force += sweep_piece({before[k], before[k + 1]}, {rest[k], rest[k + 1]}, inside, cut);
    }
    return pose_of(world_, organ_).direction_to_world(force);
  }

 private:
  /// How far a place is outside of tissue and of the kerf that the blade makes, behind whose front
  /// its edge stands by half of that [m].
  double beyond_kerf(const MovedTissue::AtRest& place, const TissueShare& gone) const {
    const double own = 0.5 * kerf_of(blade_, gone) + gone.voxel();
    return std::max(place.above - own, place.above_skin);
  }

  /// `inside`: the share of its way that is in tissue.
  Vec3 sweep_piece(const std::array<Vec3, 2>& before, const std::array<Vec3, 2>& now, double inside,
                   OrganCut& cut) {
    if (now == before) return Vec3::Zero();
    const double taken = sweep({before, now, blade_.thickness}, cut.gone);
    if (taken == 0.0) return Vec3::Zero();
    cut.changed = true;
    const Vec3 way = 0.5 * (now[0] + now[1] - before[0] - before[1]);
    const Vec3 along = 0.5 * (now[1] - now[0] + before[1] - before[0]);
    // Of what it went over a part may have been parted before.
    const double over = along.cross(way).norm();
    const double area =
        inside * std::min(over, taken / cut.gone.taken_by_plate(kerf_of(blade_, cut.gone)));
    cut.area += area;
    const double work = world_.find<Cuttable>(organ_)->fracture_energy * area;
    cut.work += work;
    const double length = way.norm();
    return length > 0.0 ? Vec3(-work / (length * length) * way) : Vec3(Vec3::Zero());
  }

  World& world_;
  Entity organ_;
  BladeDescription blade_;
  MovedTissue tissue_;
  std::vector<int> leaving_;
};

BladeTrack& track_of(OrganCut& cut, Entity instrument, std::uint64_t blade) {
  for (BladeTrack& track : cut.blades)
    if (track.instrument == instrument && track.blade == blade) return track;
  return cut.blades.emplace_back(BladeTrack{.instrument = instrument, .blade = blade});
}

bool is_near(const std::vector<Vec3>& edge, const OrganTouch& touch, const Pose& pose) {
  Box world;
  for (const Vec3& place : edge) world.extend(pose.to_world(place));
  return touch.bounds.exteriorDistance(world) <= kBeside;
}

/// All blades of an instrument in one organ.
void cut_with(World& world, Entity instrument, Entity organ, const OrganTouch& touch,
              OrganCut& cut) {
  const InstrumentDescription& tool = world.find<InstrumentBody>(instrument)->description;
  const InstrumentState& state = *world.find<InstrumentState>(instrument);
  const Pose& pose = pose_of(world, organ);
  const auto edges = edges_of(tool, state, pose);
  for (std::size_t b = 0; b < edges.size(); ++b) {
    BladeTrack& track = track_of(cut, instrument, b);
    // Scissors cut as they close; open, tissue lies between their blades.
    const bool cuts = tool.kind != InstrumentKind::kScissors || state.jaw < track.jaw;
    track.jaw = state.jaw;
    if (!is_near(edges[b], touch, pose))
      track.lose();
    else
      world.find<InstrumentContact>(instrument)->force +=
          Cutting(world, organ, *blade_of(tool)).go_on(edges[b], cuts, track);
  }
}

/// The knife between an instrument's jaws in one organ. It parts tissue as it runs forward; its
/// back is blunt.
void cut_with_knife(World& world, Entity instrument, Entity organ, const OrganTouch& touch,
                    OrganCut& cut) {
  const JawKnife& knife = *world.find<JawKnife>(instrument);
  BladeTrack& track = track_of(cut, instrument, 0);
  if (knife.travel == 0.0) return track.lose();
  const std::vector<Vec3> edge = knife_edge(world, instrument, organ, knife.travel);
  if (!is_near(edge, touch, pose_of(world, organ))) return track.lose();
  const bool forward = knife.travel > knife.before;
  Cutting cutting(world, organ, knife_of(world.find<InstrumentBody>(instrument)->description));
  if (forward && track.edge.empty())
    cutting.go_on(knife_edge(world, instrument, organ, knife.before), false, track);
  // What it is held by, its own handle feels: between the jaws that is an inner force, which the
  // shaft bears, and it isn't the tip's.
  cutting.go_on(edge, forward, track);
}

/// What an organ's tissue about an edge in it withstands each way across -> felt.holds.
void add_holds(const World& world, Entity organ, const BladeTrack& track,
               const BladeDescription& blade, BladeAsFelt& felt) {
  const TissueShare& left = world.find<OrganCut>(organ)->gone;
  const double fracture = world.find<Cuttable>(organ)->fracture_energy;
  // Shares rise over two voxels across a wall, which is where half is left.
  const double ahead = 0.5 * kerf_of(blade, left) + 2.0 * left.voxel();
  for (std::size_t k = 0; k + 1 < track.edge.size(); ++k) {
    const double inside = share_below(track.outside[k], track.outside[k + 1]);
    if (inside == 0.0 || track.pieces[k] != track.pieces[k + 1]) continue;
    const Vec3 middle = 0.5 * (track.edge[k] + track.edge[k + 1]);
    const double length = inside * (track.edge[k + 1] - track.edge[k]).norm();
    for (std::size_t way = 0; way < BladeAsFelt::kWays; ++way) {
      const Vec3 beyond = middle + ahead * pose_of(world, organ).direction_to_local(felt.way(way));
      felt.holds[way] += fracture * length * std::max(0.0, 2.0 * left.share(beyond) - 1.0);
    }
  }
}

}  // namespace

BladeAsFelt blade_as_felt(const World& world, Entity instrument) {
  BladeAsFelt felt;
  const InstrumentDescription& tool = world.find<InstrumentBody>(instrument)->description;
  // What scissors shear holds their handles, not their tip.
  if (tool.kind != InstrumentKind::kScalpel) return felt;
  const InstrumentState& state = *world.find<InstrumentState>(instrument);
  felt.along = state.shaft_direction;
  felt.side = state.side_direction;
  const Pool<OrganCut>& organs = world.all<OrganCut>();
  for (std::size_t o = 0; o < organs.size(); ++o) {
    if (world.find<OrganState>(organs.owner(o))->frozen) continue;
    for (const BladeTrack& track : organs[o].blades) {
      if (!(track.instrument == instrument) || track.edge.empty()) continue;
      if (const OrganMotion* motion = world.find<OrganMotion>(organs.owner(o)))
        felt.velocity = motion->motion.velocity(world.time());
      add_holds(world, organs.owner(o), track, *blade_of(tool), felt);
    }
  }
  return felt;
}

std::vector<std::vector<Vec3>> edges_of(const InstrumentDescription& tool,
                                        const InstrumentState& state, const Pose& organ) {
  const BladeDescription& blade = *blade_of(tool);
  const int pieces = std::max(1, static_cast<int>(std::ceil(blade.length / kAlongEdge)));
  const auto line = [&](const Vec3& from, const Vec3& along) {
    std::vector<Vec3> places;
    for (int i = 0; i <= pieces; ++i)
      places.push_back(organ.to_local(from + blade.length * i / pieces * along));
    return places;
  };
  if (tool.kind != InstrumentKind::kScissors) return {line(state.tip, state.shaft_direction)};
  const Vec3 hinge = state.tip + blade.length * state.shaft_direction;
  const double angle = kScissorsOpen * std::clamp(state.jaw, 0.0, 1.0);
  const auto swung = [&](double sign) -> Vec3 {
    return sign * std::sin(angle) * state.side_direction - std::cos(angle) * state.shaft_direction;
  };
  return {line(hinge, swung(1.0)), line(hinge, swung(-1.0))};
}

void cut_tissue(World& world, const FrameContext& context) {
  run_knives(world, context.dt);
  Pool<OrganCut>& organs = world.all<OrganCut>();
  for (std::size_t o = 0; o < organs.size(); ++o) {
    const Entity organ = organs.owner(o);
    const OrganTouch* touch = world.find<OrganTouch>(organ);
    if (!touch || world.find<OrganState>(organ)->frozen) continue;
    for (std::size_t i = 0; i < world.all<InstrumentBody>().size(); ++i)
      if (blade_of(world.all<InstrumentBody>()[i].description))
        cut_with(world, world.all<InstrumentBody>().owner(i), organ, *touch, organs[o]);
    for (std::size_t k = 0; k < world.all<JawKnife>().size(); ++k)
      cut_with_knife(world, world.all<JawKnife>().owner(k), organ, *touch, organs[o]);
  }
}

}  // namespace viscera
