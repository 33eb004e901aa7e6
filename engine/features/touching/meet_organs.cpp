#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "engine/features/contact/contact.h"
#include "engine/features/free_bodies/free_bodies.h"
#include "engine/features/touching/cut_bodies.h"
#include "engine/features/touching/drawn_organ.h"
#include "engine/features/touching/edge_samples.h"
#include "engine/features/touching/folds.h"
#include "engine/features/touching/resting.h"
#include "engine/features/touching/touching.h"
#include "engine/features/touching/touching_flags.h"
#include "kernels/base/parallel.h"

namespace viscera {
namespace {

/// Patches that are no farther from the other organ than they may come within two frames enter the
/// contact problem: as they moved in the last one, and this besides; at most what two organs make
/// that go 100 mm/s each. One that is in it leaves it a little later [m].
constexpr double kLeastMargin = 0.3e-3, kMostMargin = 3.5e-3, kLater = 0.3e-3;
/// Places of edges enter only when they would stand too deep, and leave sooner: beside patches that
/// hold the same nodes already they say nothing new, and bodies a few nodes wide with many more
/// rows than these had steps without an answer [m].
constexpr double kEdgeLater = 0.05e-3;
constexpr double kFrames = 2.0;
/// A patch that is deeper inside the other organ isn't found there any more [m].
constexpr double kDeepest = 8e-3;
/// A free body that goes farther than this in a frame is asked what it meets where it will meet
/// that: from where it is something else may be nearest. It goes there in so many leaps at most,
/// until they are shorter than the last [m].
constexpr double kFastWay = 2e-3, kLeastLeap = 0.2e-3;
constexpr int kLeaps = 4;
/// Surfaces that face each other less than this (cosine) don't meet: the far side of a thin organ.
constexpr double kFacing = -0.2;
/// A patch whose nearest place of the other organ is farther than so many times how far it is along
/// the normal there, and its own radius, lies beside an edge, neither above nor inside.
constexpr double kBesideEdge = 1.2;
/// What is above an edge is pushed straight away from it, where the normal of the side that was hit
/// is farther from that than this (cosine; 30 degrees).
constexpr double kOverEdge = 0.87;
/// A meeting keeps its place of the second organ until the patch has slid off it by this share of
/// its radius.
constexpr double kSlidOff = 0.35;
/// ContactCell::bell of a patch. Patches lie side by side, half a spacing apart, so that together
/// they load what no node feels as narrow; and a wide bell takes what lies at an edge for tissue
/// that goes on beyond it. Error of the force between two balls with fine patches (linear, finite
/// strain), and of a block between plates at a tenth of its modulus (viscera bench contact):
///   bell   balls          block
///   0.85   -3.2, -2.2 %   -19 %
///   0.5    -3.2, -2.0      -7
///   0.4    -2.7, -1.5      -4
///   0.3    -1.3,  0.0      -1
/// By 0.3 a soft ball hardly rolls (a patch that comes down meets few nodes), and bodies three
/// nodes wide with friction had steps without an answer; 0.2 holds no place of the surface where
/// nodes lie wide apart.
constexpr float kBell = 0.4f;
/// What met in the last frame already and lies deeper inside the other organ than this is told as a
/// flag: chosen, a third of the pitch of patches in a fine organ [m].
constexpr double kMostOverlap = 1e-3;

/// Where a patch, or a place of an edge, is nearest to the other organ.
struct Near {
  SurfacePoint point;
  Vec3 place = Vec3::Zero();
  Vec3 normal = Vec3::UnitZ();  ///< outward there
  double gap = 0.0;             ///< below 0: inside [m]
  bool over_edge = false;       ///< the normal is the way from an edge to what is above it
};

Near near_at(const CollisionSurface::Hit& hit, const Vec3& here, const DrawnOrgan& other) {
  Near near{hit.point, other.pose.to_world(hit.position), other.normal(hit.point.triangle), 0.0};
  near.gap = (here - near.place).dot(near.normal);
  return near;
}

bool is_beside_edge(double distance, double gap, const SurfacePatch& patch) {
  return distance > kBesideEdge * (std::abs(gap) + std::sqrt(patch.area / 3.0));
}

bool is_awake(const World& world, Entity organ) {
  const OrganState& state = *world.find<OrganState>(organ);
  if (state.deformed) return true;
  const OrganContact* contact = world.find<OrganContact>(organ);
  return contact && (!contact->cells.empty() || world.find<OrganTouch>(organ)->solver->moving());
}

Box bounds_of(const World& world, Entity organ) {
  if (const OrganTouch* touch = world.find<OrganTouch>(organ)) return touch->bounds;
  return bounds_at_rest(*world.find<OrganBody>(organ)->model, pose_of(world, organ));
}

/// What became of a patch in this frame.
struct Found {
  bool meets = false;
  Meeting meeting;
  Vec3 normal = Vec3::UnitZ();
  double depth = 0.0;
};

class PairSearch {
 public:
  PairSearch(World& world, Entity entity)
      : world_(world),
        pair_(*world.find<OrganPair>(entity)),
        state_(*world.find<PairState>(entity)),
        joints_(*world.find<PairJoints>(entity)),
        edges_(world.find<EdgeSamples>(entity)),
        may_stand_(edges_ ? kEdgeMayStand : 0.0),
        patches_(brought_now(world, entity)),
        overlaps_(overlaps_now(world, entity)),
        one_(world, pair_.organs[0]),
        other_(world, pair_.organs[1]),
        finder_(finder_of(world, pair_.organs[1], false)),
        rest_finder_(finder_of(world, pair_.organs[1], true)),
        folds_(world.find<FoldSides>(pair_.organs[0])),
        falls_(!(pair_.folds() && folds_) &&
               (is_loose(world, pair_.organs[0]) || is_loose(world, pair_.organs[1]))),
        step_(world.model().time_step()),
        to_come_(pair_.folds() && folds_
                     ? Coming{}
                     : way_to_come(world, pair_.organs[0], pair_.organs[1], step_)) {}

  void run(TouchingFigures& figures, FrameReport* report) {
    joints_.normals.clear();
    joints_.depths.clear();
    const Box reach = bounds_of(world_, pair_.organs[1]);
    const Box own = bounds_of(world_, pair_.organs[0]);
    const double farthest = kMostMargin + to_come_.at_most();
    const bool is_one_piece =
        pair_.folds() && !folds_ && pieces_of(world_, pair_.organs[0]).empty();
    const bool out_of_reach = is_one_piece || reach.exteriorDistance(own) > farthest;
    shifted_ = apart(world_, pair_.organs).norm();
    if (out_of_reach || !(falls_ || is_awake(world_, pair_.organs[0]) ||
                          is_awake(world_, pair_.organs[1]) || shifted_ > kUnmoved)) {
      state_ = {};
      return;
    }
    std::vector<std::optional<Near>> near = search(reach, farthest);
    const std::vector<double> came = approached(near);
    const double fastest = came.empty() ? 0.0 : *std::ranges::max_element(came);
    if (const Vec3 way = coming_way(world_, pair_.organs[0], pair_.organs[1], step_);
        way.norm() > kFastWay)
      for (int leap = 0; leap < kLeaps && go_on(way, near); ++leap) near = search(reach, farthest);
    const bool may_fall = !(edges_ && carried());
    const auto margin = [&](std::size_t p) {
      const double falls = may_fall ? to_come_.towards(near[p]->normal) : 0.0;
      const double soon = kFrames * (falls_ && to_come_.as_ones ? came[p] : fastest);
      return falls + soon + (edges_ ? -kEdgeMayStand : kLeastMargin);
    };
    const double later = edges_ ? kEdgeLater : kLater;
    std::vector<const Meeting*> before(patches_.size(), nullptr);
    for (const Meeting& meeting : state_.meetings) before[meeting.patch] = &meeting;
    std::vector<Found> found(patches_.size());
    parallel_for_each_index(patches_.size(), 64, [&](std::size_t p) {
      if (near[p] && near[p]->gap < margin(p) + (before[p] ? later : 0.0))
        found[p] = meet(p, *near[p], before[p]);
    });
    if (pair_.folds()) leave_one_of_each(found, before);
    std::vector<Meeting> meetings;
    for (const Found& one : found) {
      if (!one.meets) continue;
      const double overlap = overlap_of(one);
      figures.greatest_overlap = std::max(figures.greatest_overlap, overlap);
      if (report && before[one.meeting.patch] && overlap > kMostOverlap)
        report->raise(kOrgansOverlap);
      meetings.push_back(one.meeting);
      joints_.normals.push_back(one.normal);
      joints_.depths.push_back(one.depth);
    }
    state_.meetings = std::move(meetings);
  }

 private:
  static const CollisionSurface& finder_of(const World& world, Entity organ, bool rest) {
    if (const OrganContact* contact = world.find<OrganContact>(organ))
      return rest ? *contact->rest : *contact->surface;
    return *world.find<StillSurface>(organ)->surface;
  }

  std::vector<std::optional<Near>> search(const Box& reach, double farthest) const {
    std::vector<std::optional<Near>> near(patches_.size());
    parallel_for_each_index(patches_.size(), 64, [&](std::size_t p) {
      if (pair_.folds())
        near[p] = own_of(p, farthest);
      else if (reach.exteriorDistance(place(p)) < farthest)
        near[p] = faced(nearest(p, farthest), p, farthest);
    });
    return near;
  }

  /// Goes on along the rest of its way, until the first patch may meet something. False: by so
  /// little that what is near stays.
  bool go_on(const Vec3& way, std::span<const std::optional<Near>> near) {
    const Vec3 rest = way - gone_;
    double share = 1.0;
    for (const std::optional<Near>& one : near)
      if (const double down = one ? -rest.dot(one->normal) : 0.0; down > 0.0)
        share = std::min(share, std::max(0.0, one->gap) / down);
    gone_ += share * rest;
    return share * rest.norm() > kLeastLeap;
  }

  /// Of a patch, after the way that its organ has gone on.
  Vec3 place(std::size_t p) const { return one_.place(patches_[p].point) + gone_; }

  std::optional<CollisionSurface::Hit> nearest(std::size_t p, double farthest) const {
    const Vec3 here = other_.pose.to_local(place(p));
    return finder_.closest(here, std::max(kDeepest, farthest));
  }

  /// Of a pair of edges: whether patches of both organs carry already.
  bool carried() const {
    return std::ranges::any_of(world_.find<PairState>(edges_->beside)->meetings,
                               [](const Meeting& one) { return !one.force.isZero(0.0); });
  }

  bool faces(std::size_t p, const Vec3& normal) const {
    if (edges_) return edge_faces(one_, edges_->faces[p], normal, kFacing);
    return one_.normal(patches_[p].point.triangle).dot(normal) < kFacing;
  }

  /// If the patch faces what it hit, within `farthest` [m].
  std::optional<Near> faced(const std::optional<CollisionSurface::Hit>& hit, std::size_t p,
                            double farthest) const {
    if (!hit) return std::nullopt;
    Near near = near_at(*hit, place(p), other_);
    if (is_beside_edge(hit->distance, near.gap, patches_[p])) return std::nullopt;
    if (!(near.gap < farthest) || !faces(p, near.normal)) return std::nullopt;
    if (near.gap > 0.0 && near.gap < kOverEdge * hit->distance) {
      const Vec3 away = place(p) - near.place;
      near.gap = away.norm();
      near.normal = away / near.gap;
      near.over_edge = true;
    }
    return near;
  }

  /// On its own organ: what a piece that was cut off lies on, or the other side of a fold.
  std::optional<Near> own_of(std::size_t p, double farthest) const {
    if (!folds_) {
      const auto hit = nearest_piece(one_, pieces_of(world_, pair_.organs[0]), finder_, patches_[p],
                                     std::max(kDeepest, farthest));
      return faced(hit, p, farthest);
    }
    const auto hit =
        nearest_fold(one_, finder_, patches_[p], static_cast<double>(folds_->behind[p]), farthest);
    if (!hit) return std::nullopt;
    return near_at(*hit, one_.place(patches_[p].point), other_);
  }

  /// Where both sides of a fold have found each other; that which met before stays.
  void leave_one_of_each(std::vector<Found>& found, std::span<const Meeting* const> before) const {
    std::vector<std::size_t> kept;
    for (const bool old : {true, false})
      for (std::size_t p = 0; p < found.size(); ++p) {
        if (!found[p].meets || (before[p] != nullptr) != old) continue;
        found[p].meets = std::ranges::none_of(kept, [&](std::size_t q) {
          return same_fold(patches_[p], found[p].meeting.on, patches_[q], found[q].meeting.on);
        });
        if (found[p].meets) kept.push_back(p);
      }
  }

  Vec3 moved_apart(const Meeting& meeting) const {
    return one_.displacement(patches_[meeting.patch]) - other_.displacement(meeting.on);
  }

  /// How deep the drawn surfaces overlap there, beyond what they do at rest.
  double overlap_of(const Found& found) const {
    const Meeting& meeting = found.meeting;
    return found.depth - moved_apart(meeting).dot(found.normal);
  }

  /// How much nearer each patch came within the last frame [m]; remembers gaps.
  std::vector<double> approached(std::span<const std::optional<Near>> near) {
    std::vector<float> gaps(near.size(), static_cast<float>(kMostMargin + to_come_.at_most()));
    std::vector<double> came(near.size(), 0.0);
    for (std::size_t p = 0; p < near.size(); ++p) {
      if (!near[p]) continue;
      gaps[p] = static_cast<float>(near[p]->gap);
      if (state_.gaps.size() == gaps.size())
        came[p] = std::max(0.0, static_cast<double>(state_.gaps[p] - gaps[p]));
    }
    state_.gaps = std::move(gaps);
    return came;
  }

  Found meet(std::size_t p, const Near& near, const Meeting* before) const {
    const SurfacePatch& patch = patches_[p];
    Found found;
    Meeting& meeting = found.meeting;
    const double radius = std::sqrt(patch.area / 3.0);
    // Along a side's normal a place beside the nearest is as good; along the way from an edge it
    // would be deeper or less deep.
    if (before && !near.over_edge &&
        (other_.place(before->on.point) - near.place).norm() < kSlidOff * radius) {
      meeting = *before;
    } else {
      const OrganModel& model = *world_.find<OrganBody>(pair_.organs[1])->model;
      meeting.on =
          patch_at(near.point, patch.area, model.surface, model.rest_normals, rest_finder_);
    }
    meeting.patch = static_cast<std::uint32_t>(p);
    const Vec3 moved = moved_apart(meeting);
    if (!before) {
      meeting.cling = moved;
    } else {
      // What the patch has slipped stays, on another place of the other organ too.
      meeting.cling = before->cling + moved - moved_apart(*before);
      meeting.force = before->force;
    }
    if (!falls_ && moved.norm() + shifted_ < kUnmoved && meeting.force.isZero(0.0)) return {};
    found.meets = true;
    found.normal = near.normal;
    const Vec3 at_rest = one_.pose.to_world(patch.mean()) - other_.pose.to_world(meeting.on.mean());
    found.depth = -at_rest.dot(found.normal) - static_cast<double>(overlaps_[p]) - may_stand_;
    return found;
  }

  World& world_;
  const OrganPair& pair_;
  PairState& state_;
  PairJoints& joints_;
  const EdgeSamples* edges_;  // null: the patches are those of its faces
  double may_stand_;          // so deep they may lie in the other [m]
  const std::vector<SurfacePatch>& patches_;
  const std::vector<float>& overlaps_;
  DrawnOrgan one_, other_;
  const CollisionSurface &finder_, &rest_finder_;
  const FoldSides* folds_;  // null: if it is one organ, pieces of it meet
  bool falls_;              // nothing holds one of them
  double step_;             // of the scene [s]
  Coming to_come_;          // how they may fall in this frame
  double shifted_ = 0.0;
  Vec3 gone_ = Vec3::Zero();  // beside the other in this frame, until they meet, world [m]
};

/// The cell of a patch that is pushed this way by what it meets.
ContactCell met_cell(const SurfacePatch& patch, const Vec3& way, double friction) {
  ContactCell cell;
  cell.position = patch.position;
  cell.normal = patch.normal;
  cell.area = patch.area;
  cell.bell = kBell;
  cell.direction = way;
  cell.depth = -1.0;  // the joint says what is wanted
  cell.friction = friction;
  return cell;
}

void lay_cells(World& world, Entity entity) {
  const OrganPair& pair = *world.find<OrganPair>(entity);
  const PairState& state = *world.find<PairState>(entity);
  PairJoints& joints = *world.find<PairJoints>(entity);
  const std::vector<SurfacePatch>& patches = brought_now(world, entity);
  const double friction = touching_of(world.model().scene()).friction;
  for (std::size_t side = 0; side < 2; ++side) {
    if (!yields(world, pair.organs[side])) continue;
    OrganContact& contact = *world.find<OrganContact>(pair.organs[side]);
    const Pose& pose = pose_of(world, pair.organs[side]);
    joints.first_cells[side] = contact.cells.size();
    for (std::size_t m = 0; m < state.meetings.size(); ++m) {
      const Meeting& meeting = state.meetings[m];
      const SurfacePatch& patch = side == 0 ? patches[meeting.patch] : meeting.on;
      const Vec3 way = pose.direction_to_local(joints.normals[m]);
      contact.cells.push_back(met_cell(patch, side == 0 ? way : Vec3(-way), friction));
      contact.held_points.push_back(patch.point);
    }
  }
}

/// What comes near to organs that rest wakes them, and then they look around themselves.
void search_pairs(World& world, FrameReport* report) {
  TouchingFigures& figures = *world.one<TouchingFigures>();
  const Pool<OrganPair>& pairs = world.all<OrganPair>();
  std::vector<char> searched(pairs.size(), 0);
  for (bool woke = true; woke;) {
    woke = false;
    for (std::size_t p = 0; p < pairs.size(); ++p) {
      if (searched[p] || pair_rests(world, pairs.owner(p))) continue;
      searched[p] = 1;
      const PairState& state = *world.find<PairState>(pairs.owner(p));
      const bool met = !state.meetings.empty();
      PairSearch(world, pairs.owner(p)).run(figures, report);
      if (!met && state.meetings.empty()) continue;
      for (const Entity organ : pairs[p].organs) {
        if (!rests(world, organ)) continue;
        wake(world, organ);
        woke = true;
      }
    }
  }
}

}  // namespace

Vec3 apart(const World& world, const std::array<Entity, 2>& organs) {
  const auto shift = [&](Entity organ) {
    return Vec3(pose_of(world, organ).position -
                world.model().scene().organs[organ.index].pose_at(0.0).position);
  };
  return shift(organs[0]) - shift(organs[1]);
}

bool yields(const World& world, Entity organ) {
  const OrganTouch* touch = world.find<OrganTouch>(organ);
  return touch && touch->solver->abilities().springs && !world.find<OrganState>(organ)->frozen;
}

std::size_t count_pairs(const World& world) {
  return world.all<OrganPair>().size() - world.all<EdgeSamples>().size();
}

std::vector<float> overlaps_of(const Pose& pose, std::span<const SurfacePatch> patches,
                               const OrganModel& other, const Pose& other_pose,
                               const CollisionSurface& finder, bool facing) {
  std::vector<float> overlaps(patches.size(), 0.0f);
  parallel_for_each_index(patches.size(), 64, [&](std::size_t p) {
    const SurfacePatch& patch = patches[p];
    const Vec3 mean = pose.to_world(patch.mean());
    const auto hit = finder.closest(other_pose.to_local(pose.to_world(patch.position)), kDeepest);
    if (!hit) return;
    const SurfacePatch on =
        patch_at(hit->point, patch.area, other.surface, other.rest_normals, finder);
    const Vec3 normal = other_pose.direction_to_world(on.normal);
    if (facing && !(pose.direction_to_world(patch.normal).dot(normal) < kFacing)) return;
    const double gap = (mean - other_pose.to_world(on.mean())).dot(normal);
    if (is_beside_edge(hit->distance, gap, patch)) return;
    overlaps[p] = static_cast<float>(std::max(0.0, -gap));
  });
  return overlaps;
}

void meet_organs(World& world, const FrameContext& context) {
  TouchingFigures& figures = *world.one<TouchingFigures>();
  wake_disturbed(world);
  if (all_at_rest(world)) return;
  search_pairs(world, context.report);
  let_rest(world);
  std::uint64_t resting = 0;
  std::set<std::array<std::uint32_t, 2>> meeting;
  const Pool<OrganPair>& pairs = world.all<OrganPair>();
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    if (!world.find<PairState>(pairs.owner(p))->meetings.empty())
      meeting.insert(pairs[p].between());
    if (!pair_rests(world, pairs.owner(p))) lay_cells(world, pairs.owner(p));
  }
  for (const Resting& one : world.all<Resting>()) resting += one.rests ? 1 : 0;
  figures.most_pairs = std::max(figures.most_pairs, std::uint64_t{meeting.size()});
  figures.most_resting = std::max(figures.most_resting, resting);
  note_all_at_rest(world);
}

}  // namespace viscera
