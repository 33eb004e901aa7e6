#include "engine/features/jaws/hold.h"

#include <algorithm>

#include "engine/features/contact/contact_cells.h"
#include "kernels/contact/cell_pattern.h"

namespace viscera {
namespace {

/// As a patch that one jaw holds (contact_cells.cpp).
constexpr int kRings = 2;
/// Fewer pairs of cells fix no direction; also what is left between jaws that count as empty.
constexpr std::size_t kLeastPairs = 3;
/// Jaws that slid over this share of their radius take what lies between them. A smaller one makes
/// what they hold smoother, and the body's answer at new places is due more often. Chosen.
constexpr double kRetakeShare = 0.5;

Mat3 axes(const Vec3& shaft, const Vec3& normal) {
  Mat3 axes;
  axes << shaft, normal, shaft.cross(normal);
  return axes;
}

/// The pairs on one organ.
Pinch pairs_on(const World& world, Entity organ, const Vec3& middle, const Vec3& normal,
               double radius) {
  if (!may_lie_within(world, organ, middle, radius)) return {.organ = organ};
  const Pose& pose = pose_of(world, organ);
  const Vec3 at = pose.to_local(middle);
  const auto [e1, e2] = plane_across(pose.direction_to_local(normal));
  const double poisson_ratio = world.find<OrganBody>(organ)->model->material.poisson_ratio;
  const CellPattern pattern =
      fitted_to_punch(hexagonal_grid(1.0, kRings), radius, poisson_ratio, true);
  std::vector<Vec3> places;
  for (const Vec2& place : pattern.places) places.push_back(at + place.x() * e1 + place.y() * e2);
  return pinched(world, organ, places, pattern.areas, normal, 2.0 * radius);
}

}  // namespace

void move_jaws(const JawsBody& body, const InstrumentState& state, double time, bool hold,
               Jaws& jaws) {
  const double turn = body.turns ? body.turn.at(time).x() : 0.0;
  if (hold) {
    // The shaft swings in its trocar without spin; only the handle spins it. What is drawn, the
    // side that points down the most, spins as a vertical shaft tilts.
    const Vec3 swung =
        Eigen::Quaterniond::FromTwoVectors(jaws.shaft, state.shaft_direction) * jaws.normal;
    const Vec3 across = swung - swung.dot(state.shaft_direction) * state.shaft_direction;
    jaws.normal = Eigen::AngleAxisd(turn - jaws.turn, state.shaft_direction) * across.normalized();
  } else {
    jaws.normal = state.side_direction;
    jaws.sliding = false;
  }
  jaws.tip = state.tip;
  jaws.shaft = state.shaft_direction;
  jaws.turn = turn;
  jaws.force = share_of_grip(state.jaw) * body.force;
  jaws.slid_before = jaws.slid;
  jaws.closed_before = jaws.closed;
  jaws.taken = jaws.shut = false;
  jaws.dragged = jaws.friction.norm() > 0.0 ? Vec3(jaws.friction.normalized()) : Vec3::Zero();
  jaws.trials = 0;
  jaws.torque = Vec3::Zero();
  jaws.presses = {Vec3::Zero(), Vec3::Zero()};
}

bool should_retake(const Jaws& jaws, double radius) {
  return jaws.sliding && jaws.slid.norm() > kRetakeShare * radius;
}

bool may_lie_within(const World& world, Entity organ, const Vec3& middle, double distance) {
  const OrganTouch* touch = world.find<OrganTouch>(organ);
  return touch && world.find<OrganContact>(organ) && !world.find<OrganState>(organ)->frozen &&
         !(touch->bounds.exteriorDistance(middle) > distance);
}

Pinch pinched(const World& world, Entity organ, std::span<const Vec3> places,
              std::span<const double> areas, const Vec3& normal, double opening) {
  Pinch pinch{.organ = organ};
  const OrganTouch* touch = world.find<OrganTouch>(organ);
  const OrganModel& model = *world.find<OrganBody>(organ)->model;
  const TissueSheet drawn(model, *world.find<OrganState>(organ),
                          *world.find<OrganContact>(organ)->surface);
  const Vec3 up = pose_of(world, organ).direction_to_local(normal);
  const double reach = 0.5 * opening;
  std::vector<ContactCell> lower;
  std::vector<SurfacePoint> lower_points;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto top = drawn.cast(places[i] + reach * up, -up, opening);
    const auto bottom = drawn.cast(places[i] - reach * up, up, opening);
    if (!top || !bottom) continue;
    const double gap = (top->position - bottom->position).dot(up);
    if (gap <= 0.0) continue;
    const auto cell_at = [&](const TissueSheet::Hit& hit) {
      ContactCell cell;
      cell.held = true;
      cell.position = position(model.surface, hit.point);
      cell.normal = corner_mean(model.rest_normals, model.surface, hit.point).normalized();
      cell.area = areas[i];
      cell.displacement = hit.position - cell.position;
      return cell;
    };
    const ContactCell above = cell_at(*top), below = cell_at(*bottom);
    if (!touch->solver->touchable(above.position) || !touch->solver->touchable(below.position))
      continue;
    pinch.gap += gap;
    pinch.thickness += (above.position - below.position).norm();
    pinch.cells.push_back(above);
    pinch.points.push_back(top->point);
    lower.push_back(below);
    lower_points.push_back(bottom->point);
  }
  if (lower.empty()) return pinch;
  pinch.gap /= static_cast<double>(lower.size());
  pinch.thickness /= static_cast<double>(lower.size());
  pinch.cells.insert(pinch.cells.end(), lower.begin(), lower.end());
  pinch.points.insert(pinch.points.end(), lower_points.begin(), lower_points.end());
  return pinch;
}

std::optional<Pinch> between_jaws(const World& world, const Vec3& middle, const Vec3& normal,
                                  double radius, std::optional<Entity> only) {
  std::optional<Pinch> best;
  const Pool<OrganBody>& organs = world.all<OrganBody>();
  for (std::size_t o = 0; o < organs.size(); ++o) {
    if (only && !(*only == organs.owner(o))) continue;
    Pinch pinch = pairs_on(world, organs.owner(o), middle, normal, radius);
    if (pinch.cells.size() < 2 * kLeastPairs) continue;
    if (!best || pinch.cells.size() > best->cells.size()) best = std::move(pinch);
  }
  return best;
}

bool lies_between(const World& world, Entity organ, const Vec3& middle, const Vec3& normal,
                  double radius) {
  return pairs_on(world, organ, middle, normal, radius).cells.size() >= 2 * kLeastPairs;
}

JawPose pose_of_jaws(const Jaws& jaws) {
  return {jaws.tip, jaws.shaft, jaws.normal};
}

void begin_hold(const JawPose& pose, const Pinch* pinch, bool again, Jaws& jaws, Grasp& grasp) {
  grasp.tip_at_start = pose.tip;
  jaws.shaft_then = pose.shaft;
  jaws.normal_then = pose.normal;
  jaws.upper = pinch ? pinch->cells.size() / 2 : 0;
  jaws.gap_then = pinch ? pinch->gap : 0.0;
  jaws.thickness = pinch ? pinch->thickness : 0.0;
  jaws.slid = jaws.slid_before = Vec3::Zero();
  jaws.closed = jaws.closed_before = 0.0;
  jaws.taken = again;
  if (again) {
    ++jaws.retaken;
    return;
  }
  jaws.friction = Vec3::Zero();
  jaws.squeeze = 0.0;
  jaws.stiffer_along = jaws.stiffer_across = 1.0;
  jaws.sliding = false;
}

Vec3 carried(const Jaws& jaws, const Grasp& grasp, std::size_t k, const Pose& organ) {
  const ContactCell& cell = grasp.cells[k];
  const Vec3 then = organ.direction_to_world(cell.position + cell.displacement) +
                    grasp.organ_at_start - grasp.tip_at_start;
  Vec3 within = then - jaws.slid;
  if (jaws.upper > 0) within += (k < jaws.upper ? -0.5 : 0.5) * jaws.closed * jaws.normal_then;
  const Mat3 turned =
      axes(jaws.shaft, jaws.normal) * axes(jaws.shaft_then, jaws.normal_then).transpose();
  return organ.to_local(jaws.tip + turned * within) - cell.position;
}

}  // namespace viscera
