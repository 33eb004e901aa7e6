#include "engine/features/clips/hold_clips.h"

#include <algorithm>
#include <limits>

#include "engine/features/clips/clips_flags.h"
#include "engine/features/contact/contact.h"
#include "engine/features/jaws/hold.h"
#include "engine/simulation/tool_shape.h"

namespace viscera {
namespace {

/// Cells along a bar are so many spacings of nodes apart, and so many.
constexpr double kCellPitch = 0.7;
constexpr int kFewestCells = 3, kMostCells = 15;
/// Fewer pairs, or cells of one bar, hold nothing.
constexpr std::size_t kLeastClipPairs = 2;
/// A cell whose tissue is no nearer than this to the organ's surface has lost it [m].
constexpr double kTissueLostBy = 1e-3;

/// What bars in this place would hold of an organ.
Pinch between_bars(const World& world, Entity organ, const Vec3& middle,
                   const InstrumentState& state, const ClipsDescription& clips) {
  if (!may_lie_within(world, organ, middle, 0.5 * std::hypot(clips.length, clips.opening)))
    return {.organ = organ};
  const Pose& pose = pose_of(world, organ);
  const double spacing = world.find<OrganBody>(organ)->model->finest_spacing;
  const int count =
      std::clamp(static_cast<int>(clips.length / (kCellPitch * spacing)), kFewestCells, kMostCells);
  const double pitch = clips.length / count;
  std::vector<Vec3> places;
  for (int k = 0; k < count; ++k)
    places.push_back(
        pose.to_local(middle + ((k + 0.5) * pitch - 0.5 * clips.length) * state.shaft_direction));
  const std::vector<double> areas(places.size(), pitch * clips.width);
  return pinched(world, organ, places, areas, state.side_direction, clips.opening);
}

/// Lays its bars on both sides of what they pinch.
Clip begin_clip(const World& world, const Pinch& pinch, const Vec3& middle,
                const InstrumentState& state, const ClipsDescription& clips, double time) {
  const Pose& pose = pose_of(world, pinch.organ);
  Clip clip;
  clip.organ = pinch.organ;
  const Vec3 along = pose.direction_to_local(state.shaft_direction);
  const Vec3 normal = pose.direction_to_local(state.side_direction);
  clip.pose.centre = pose.to_local(middle);
  clip.pose.axes << along, normal, along.cross(normal);
  clip.axes_then = clip.pose.axes;
  clip.applied = time;
  clip.cells = pinch.cells;
  clip.points = pinch.points;
  clip.upper = pinch.cells.size() / 2;
  double highest = -std::numeric_limits<double>::infinity(), lowest = -highest, thickest = 0.0;
  for (std::size_t k = 0; k < clip.cells.size(); ++k) {
    const ContactCell& cell = clip.cells[k];
    clip.arms.push_back(clip.pose.axes.transpose() *
                        (cell.position + cell.displacement - clip.pose.centre));
    highest = std::max(highest, clip.arms.back().y());
    lowest = std::min(lowest, clip.arms.back().y());
    if (k >= clip.upper)
      thickest = std::max(thickest, (clip.cells[k - clip.upper].position - cell.position).norm());
  }
  const double shift = 0.5 * (highest + lowest);
  clip.pose.centre += shift * normal;
  for (Vec3& arm : clip.arms) arm.y() -= shift;
  clip.apart = clip.open = highest - lowest;
  clip.shut = std::min(clip.apart, std::max(clips.gap, kLeastGap * thickest));
  return clip;
}

void apply_clip(World& world, const FrameContext& context, Entity applier, AppliedClips& applied) {
  const ClipsDescription& clips = world.find<ClipApplier>(applier)->clips;
  const InstrumentState& state = *world.find<InstrumentState>(applier);
  if (applied.clips.size() == static_cast<std::size_t>(clips.count))
    return context.report->raise(kNoClipLeft);
  const Vec3 middle = state.tip + 0.5 * clips.length * state.shaft_direction;
  std::optional<Pinch> most;
  const Pool<OrganBody>& organs = world.all<OrganBody>();
  for (std::size_t o = 0; o < organs.size(); ++o) {
    Pinch pinch = between_bars(world, organs.owner(o), middle, state, clips);
    if (pinch.cells.size() >= 2 * kLeastClipPairs &&
        (!most || pinch.cells.size() > most->cells.size()))
      most = std::move(pinch);
  }
  if (!most) return context.report->raise(kClipOnNothing);
  applied.clips.push_back(begin_clip(world, *most, middle, state, clips, context.time));
}

/// How far the clip has turned what moves its cell, less that at rest [m]: a cell's displacement is
/// the mean one of places beside it, which squeezing alone would leave aside of a clip that turns.
Vec3 turned_beside(const Clip& clip, std::size_t k) {
  if (clip.beside.empty()) return Vec3::Zero();
  return clip.pose.axes * (clip.axes_then.transpose() * clip.beside[k]) - clip.beside[k];
}

/// u wanted of its cell [m].
Vec3 wanted(const Clip& clip, std::size_t k) {
  Vec3 arm = clip.arms[k];
  arm.y() = std::clamp(arm.y(), -0.5 * clip.apart, 0.5 * clip.apart);
  return clip.pose.centre + clip.pose.axes * arm - clip.cells[k].position - turned_beside(clip, k);
}

void lay_cells(World& world, Clip& clip) {
  OrganContact& contact = *world.find<OrganContact>(clip.organ);
  clip.first = contact.cells.size();
  for (std::size_t k = 0; k < clip.cells.size(); ++k) {
    ContactCell cell = clip.cells[k];
    cell.displacement = wanted(clip, k);
    contact.cells.push_back(cell);
    contact.held_points.push_back(clip.points[k]);
  }
}

bool holds_on(const World& world, const Clip& clip, Entity organ) {
  return clip.organ == organ && !clip.fell && !world.find<OrganState>(organ)->frozen;
}

/// The mean place of what moves with its cell: forces turn the tissue about these.
Vec3 moved_place(const Clip& clip, const OrganContact& contact, std::size_t k) {
  const Vec3 beside = clip.beside.empty() ? Vec3(Vec3::Zero()) : clip.beside[k];
  return clip.cells[k].position + contact.cells[clip.first + k].displacement - beside;
}

/// Force and moment about its centre that a clip puts on the tissue.
struct Wrench {
  Vec3 force = Vec3::Zero();   // [N]
  Vec3 moment = Vec3::Zero();  // [N m]
  double squeeze = 0.0;        // of either bar [N]
};

Wrench wrench_of(const Clip& clip, const OrganContact& contact) {
  Wrench wrench;
  for (std::size_t k = 0; k < clip.cells.size(); ++k) {
    const Vec3& force = contact.solution.forces[clip.first + k];
    const Vec3 place = moved_place(clip, contact, k);
    wrench.force += force;
    wrench.moment += (place - clip.pose.centre).cross(force);
    wrench.squeeze += (k < clip.upper ? -0.5 : 0.5) * force.dot(clip.pose.axes.col(1));
  }
  return wrench;
}

/// By the axes: shifts [m] and turns times half a bar [m]; forces [N] and moments over half a bar
/// [N].
using ClipVector = Eigen::Matrix<double, 6, 1>;
using ClipStiffness = Eigen::Matrix<double, 6, 6>;  // [N/m]

ClipVector pull_of(const Clip& clip, const Wrench& wrench, double half_bar) {
  const Mat3 to_clip = clip.pose.axes.transpose();
  ClipVector pull;
  pull << to_clip * wrench.force, to_clip * wrench.moment / half_bar;
  return pull;
}

/// What motions would add to its pull by the tissue's response, which is of tissue at rest.
std::optional<ClipStiffness> stiffness_of(const Clip& clip, const OrganContact& contact,
                                          const MatrixX& response, double half_bar) {
  const auto at = static_cast<Eigen::Index>(3 * clip.first);
  const auto size = static_cast<Eigen::Index>(3 * clip.cells.size());
  if (response.rows() < at + size) return std::nullopt;
  const MatrixX own = response.block(at, at, size, size);
  const Eigen::LLT<MatrixX> factor(0.5 * (own + own.transpose()));
  if (factor.info() != Eigen::Success) return std::nullopt;
  const Mat3& axes = clip.pose.axes;
  MatrixX motions(size, 6);
  for (std::size_t k = 0; k < clip.cells.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(3 * k);
    const Vec3 arm = moved_place(clip, contact, k) - clip.pose.centre;
    motions.block<3, 3>(row, 0) = axes;
    for (int i = 0; i < 3; ++i) motions.block<3, 1>(row, 3 + i) = axes.col(i).cross(arm) / half_bar;
  }
  const ClipStiffness stiffness = motions.transpose() * factor.solve(motions);
  if (!stiffness.allFinite()) return std::nullopt;
  return stiffness;
}

/// The stiffness that also has what a trial found: BFGS's, damped so that it stays positive
/// (Powell's).
ClipStiffness as_found(const ClipStiffness& stiffness, const ClipVector& motion,
                       const ClipVector& change) {
  constexpr double kLeastCurvature = 0.2;
  const ClipVector awaited = stiffness * motion;
  const double by_awaited = motion.dot(awaited), by_found = motion.dot(change);
  if (!(by_awaited > 0.0)) return stiffness;
  const double share = by_found >= kLeastCurvature * by_awaited
                           ? 1.0
                           : (1.0 - kLeastCurvature) * by_awaited / (by_awaited - by_found);
  const ClipVector found = share * change + (1.0 - share) * awaited;
  return stiffness - awaited * awaited.transpose() / by_awaited +
         found * found.transpose() / motion.dot(found);
}

/// The response's stiffness with all that trials have taught; without, where that isn't positive
/// with this response.
ClipStiffness with_learned(const ClipStiffness& stiffness, const Clip& clip) {
  const ClipStiffness learned = stiffness + Eigen::Map<const ClipStiffness>(clip.learned.data());
  return Eigen::LLT<ClipStiffness>(learned).info() == Eigen::Success ? learned : stiffness;
}

void move(const ClipVector& motion, double half_bar, ClipPose& pose) {
  const Vec3 turn = pose.axes * motion.tail<3>() / half_bar;
  pose.centre += pose.axes * motion.head<3>();
  if (!(turn.norm() > 0.0)) return;
  const Eigen::AngleAxisd turned(turn.norm(), turn.normalized());
  const Vec3 along = (turned * pose.axes.col(0)).normalized(), up = turned * pose.axes.col(1);
  const Vec3 normal = (up - up.dot(along) * along).normalized();
  pose.axes << along, normal, along.cross(normal);
}

/// Of the squeeze, and besides: what may be left of its pull.
constexpr double kInBalance = 2e-3, kBalanceBesides = 2e-5;  // ., [N]
/// Of a motion in one trial, at the most [m].
constexpr double kFarthest = 1e-3;

void lay_again(const Clip& clip, OrganContact& contact) {
  for (std::size_t k = 0; k < clip.cells.size(); ++k)
    contact.cells[clip.first + k].displacement = wanted(clip, k);
}

/// A trial that the tissue had no answer to; false: there was none.
bool take_back(Clip& clip, OrganContact& contact) {
  if (clip.trials == 0) return false;
  clip.pose = clip.before;
  clip.trials = 0;
  lay_again(clip, contact);
  return true;
}

/// False: it is in balance, or nothing is known to better it.
bool settle(Clip& clip, OrganContact& contact, const MatrixX& response, double half_bar) {
  const Wrench wrench = wrench_of(clip, contact);
  ClipVector pull = pull_of(clip, wrench, half_bar);
  if (!(pull.norm() > kInBalance * std::abs(wrench.squeeze) + kBalanceBesides)) {
    clip.trials = 0;
    return false;
  }
  const auto stiffness = stiffness_of(clip, contact, response, half_bar);
  if (!stiffness) return false;
  ClipStiffness learned = with_learned(*stiffness, clip);
  if (clip.trials > 0) {
    const ClipVector before = Eigen::Map<const ClipVector>(clip.pull.data());
    const ClipVector motion = Eigen::Map<const ClipVector>(clip.motion.data());
    learned = as_found(learned, motion, pull - before);
    // What has come out worse is taken back, and tried with what it taught.
    if (pull.norm() > before.norm()) {
      pull = before;
      clip.pose = clip.before;
    }
  }
  Eigen::Map<ClipStiffness>(clip.learned.data()) = learned - *stiffness;
  ClipVector motion = -learned.ldlt().solve(pull);
  if (!motion.allFinite()) return false;
  motion *= std::min(1.0, kFarthest / std::max(motion.norm(), 1e-12));
  Eigen::Map<ClipVector>(clip.pull.data()) = pull;
  Eigen::Map<ClipVector>(clip.motion.data()) = motion;
  clip.before = clip.pose;
  ++clip.trials;
  move(motion, half_bar, clip.pose);
  lay_again(clip, contact);
  return true;
}

bool is_sound(const World& world, const Clip& clip) {
  const OrganBody* body = world.find<OrganBody>(clip.organ);
  if (!body || !world.find<OrganContact>(clip.organ)) return false;
  const std::size_t count = clip.cells.size(), triangles = body->model->surface.triangles.size();
  if (clip.points.size() != count || clip.arms.size() != count || clip.upper > count ||
      (!clip.beside.empty() && clip.beside.size() != count))
    return false;
  if (!clip.fell && (clip.upper < kLeastClipPairs || count - clip.upper < kLeastClipPairs))
    return false;
  return std::ranges::all_of(clip.points, [&](const SurfacePoint& point) {
    return point.triangle >= 0 && static_cast<std::size_t>(point.triangle) < triangles;
  });
}

}  // namespace

double Clip::pressure() const {
  double area = 0.0;
  for (std::size_t k = 0; k < upper; ++k) area += cells[k].area;
  return area > 0.0 ? std::max(0.0, squeeze) / area : 0.0;
}

std::size_t end_of_clip_cells(const World& world, Entity organ) {
  std::size_t end = 0;
  each_clip(world, [&](const Clip& clip, const ClipsDescription&) {
    if (holds_on(world, clip, organ))
      end = std::max<std::size_t>(end, clip.first + clip.cells.size());
  });
  return end;
}

void begin_clips(World& world, Entity organ) {
  each_clip(world, [&](Clip& clip, const ClipsDescription&) {
    if (clip.organ == organ) clip.trials = 0;
  });
}

bool settle_clips(World& world, Entity organ) {
  OrganContact& contact = *world.find<OrganContact>(organ);
  TissueContact& solver = *world.find<OrganTouch>(organ)->solver;
  bool moved = false;
  each_clip(world, [&](Clip& clip, const ClipsDescription& clips) {
    if (!holds_on(world, clip, organ)) return;
    moved |= contact.solution.converged
                 ? settle(clip, contact, solver.cell_response(), 0.5 * clips.length)
                 : take_back(clip, contact);
  });
  return moved;
}

void hold_clips(World& world, const FrameContext& context) {
  Pool<AppliedClips>& all = world.all<AppliedClips>();
  for (std::size_t i = 0; i < all.size(); ++i) {
    AppliedClips& applied = all[i];
    const bool was_closed = applied.closed;
    applied.closed = jaw_closed(was_closed, world.find<InstrumentState>(all.owner(i))->jaw);
    if (applied.closed && !was_closed) apply_clip(world, context, all.owner(i), applied);
  }
  each_clip(world, [&](Clip& clip, const ClipsDescription&) {
    if (!holds_on(world, clip, clip.organ)) return;
    clip.apart = std::max(clip.shut, clip.apart - kClosingSpeed * context.dt);
    clip.trials = 0;
    lay_cells(world, clip);
  });
}

void feel_clips(World& world, const FrameContext& context) {
  each_clip(world, [&](Clip& clip, const ClipsDescription&) {
    clip.squeeze = 0.0;
    if (clip.fell) context.report->raise(kClipFell);
    if (!holds_on(world, clip, clip.organ)) return;
    const OrganContact& contact = *world.find<OrganContact>(clip.organ);
    const std::size_t end = clip.first + clip.cells.size();
    if (contact.solution.forces.size() < end) return;
    clip.squeeze = wrench_of(clip, contact).squeeze;
    clip.beside = world.find<OrganTouch>(clip.organ)->solver->beside_places(clip.first, end);
  });
  for (const DuctFigures& duct : duct_figures(world))
    if (duct.open) context.report->raise(kDuctOpen);
}

void drop_unsound(World& world) {
  const Pool<ClipApplier>& appliers = world.all<ClipApplier>();
  for (std::size_t i = 0; i < appliers.size(); ++i) {
    std::vector<Clip>& clips = world.find<AppliedClips>(appliers.owner(i))->clips;
    std::erase_if(clips, [&](const Clip& clip) { return !is_sound(world, clip); });
    clips.resize(std::min(clips.size(), static_cast<std::size_t>(appliers[i].clips.count)));
  }
}

void hold_what_is_left(World& world, Entity organ, const Continuation*) {
  const OrganContact* contact = world.find<OrganContact>(organ);
  if (!contact) return;
  each_clip(world, [&](Clip& clip, const ClipsDescription&) {
    if (!(clip.organ == organ) || clip.fell) return;
    Clip left = clip;
    left.cells.clear();
    left.points.clear();
    left.arms.clear();
    left.beside.clear();
    left.upper = 0;
    for (std::size_t k = 0; k < clip.cells.size(); ++k) {
      const auto hit = contact->rest->closest(clip.cells[k].position, kTissueLostBy);
      if (!hit) continue;
      if (k < clip.upper) ++left.upper;
      left.cells.push_back(clip.cells[k]);
      left.points.push_back(hit->point);
      left.arms.push_back(clip.arms[k]);
      if (!clip.beside.empty()) left.beside.push_back(clip.beside[k]);
    }
    left.learned.fill(0.0);
    left.fell = left.upper < kLeastClipPairs || left.cells.size() - left.upper < kLeastClipPairs;
    clip = std::move(left);
  });
}

}  // namespace viscera
