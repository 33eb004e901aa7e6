#include "engine/features/jaws/jaw_forces.h"

#include <algorithm>
#include <cmath>

#include "engine/features/contact/foot.h"
#include "engine/features/deformation/deformation_flags.h"
#include "engine/features/jaws/hold.h"

namespace viscera {
namespace {

using Mat2 = Eigen::Matrix2d;

/// Of the friction and of the jaws' force: what both may miss.
constexpr double kExact = 1e-3;
/// What a trial may find of the tissue's stiffness over its response's.
constexpr double kLeastStiffer = 0.1, kMostStiffer = 10.0;
constexpr double kLeastWay = 1e-9;  // [m]

struct Plane {
  Vec3 normal, first, second;
  explicit Plane(const Vec3& n) : normal(n) {
    const auto [e1, e2] = plane_across(n);
    first = e1;
    second = e2;
  }
  Vec2 of(const Vec3& v) const { return {v.dot(first), v.dot(second)}; }
  Vec3 back(const Vec2& v) const { return v.x() * first + v.y() * second; }
};

/// Forces that shifts of the held cells change: two along the jaws' plane, and closing. World.
struct Stiffness {
  Mat2 along = Mat2::Zero();  // [N/m]
  double across = 0.0;        // either jaw's squeeze per way closed [N/m]
};

std::optional<Stiffness> stiffness(const MatrixX& response, const CellRange& range,
                                   const Pose& organ, const Plane& plane, std::size_t upper) {
  const auto at = static_cast<Eigen::Index>(3 * range.begin);
  const auto size = static_cast<Eigen::Index>(3 * (range.end - range.begin));
  if (response.rows() < at + size) return std::nullopt;
  const MatrixX own = response.block(at, at, size, size);
  const Eigen::LLT<MatrixX> factor(0.5 * (own + own.transpose()));
  if (factor.info() != Eigen::Success) return std::nullopt;
  MatrixX shifts(size, 3);
  const Vec3 first = organ.direction_to_local(plane.first);
  const Vec3 second = organ.direction_to_local(plane.second);
  const Vec3 normal = organ.direction_to_local(plane.normal);
  for (Eigen::Index k = 0; 3 * k < size; ++k) {
    shifts.block<3, 1>(3 * k, 0) = first;
    shifts.block<3, 1>(3 * k, 1) = second;
    shifts.block<3, 1>(3 * k, 2) = (static_cast<std::size_t>(k) < upper ? -0.5 : 0.5) * normal;
  }
  const MatrixX forces = factor.solve(shifts);
  const MatrixX all = shifts.transpose() * forces;
  if (!all.allFinite()) return std::nullopt;
  return Stiffness{all.topLeftCorner<2, 2>(), all(2, 2)};
}

/// How far a body slides that friction of at most `limit` holds against the force `pull` on it had
/// it not slid, and that answers by `stiffness`: friction is against the slide, Coulomb's.
Vec2 slide(const Mat2& stiffness, const Vec2& pull, double limit) {
  if (pull.norm() <= limit) return Vec2::Zero();
  // (1 + s K) f = pull with |f| = limit; the slide is s f.
  const auto held = [&](double s) -> Vec2 {
    return (Mat2::Identity() + s * stiffness).inverse() * pull;
  };
  double low = 0.0, high = 1.0 / stiffness.trace();
  while (held(high).norm() > limit && high < 1e12) high *= 2.0;
  for (int i = 0; i < 60; ++i) {
    const double mid = 0.5 * (low + high);
    (held(mid).norm() > limit ? low : high) = mid;
  }
  return high * held(high);
}

void correct(double found, double awaited, double& stiffer) {
  if (awaited == 0.0) return;
  stiffer =
      std::clamp(stiffer * std::clamp(found / awaited, 0.25, 4.0), kLeastStiffer, kMostStiffer);
}

}  // namespace

bool settle_jaws(const JawsBody& body, const Pose& organ, const Grasp& grasp,
                 const CellRange& range, const ContactSolution& solution, const MatrixX& response,
                 double dt, Jaws& jaws, std::vector<ContactCell>& cells) {
  const Plane plane(jaws.normal);
  Vec3 sum = Vec3::Zero();
  double squeeze = 0.0;
  for (std::size_t k = range.begin; k < range.end; ++k) {
    const Vec3 force = organ.direction_to_world(solution.forces[k]);
    sum += force;
    squeeze += (k - range.begin < jaws.upper ? -0.5 : 0.5) * force.dot(plane.normal);
  }
  const Vec3 friction = plane.back(plane.of(sum));
  if (jaws.trials > 0) {
    const double awaited = jaws.awaited.squaredNorm();
    if (awaited > 0.0)
      correct((friction - jaws.friction).dot(jaws.awaited) / awaited, 1.0, jaws.stiffer_along);
    correct(squeeze - jaws.squeeze, jaws.awaited_squeeze, jaws.stiffer_across);
  }
  jaws.awaited = Vec3::Zero();
  jaws.awaited_squeeze = 0.0;
  jaws.friction = friction;
  if (jaws.upper > 0) jaws.squeeze = squeeze;

  // The plane between the jaws, as it was when they took what they hold.
  Mat3 now, then;
  now << jaws.shaft, jaws.normal, jaws.shaft.cross(jaws.normal);
  then << jaws.shaft_then, jaws.normal_then, jaws.shaft_then.cross(jaws.normal_then);
  const Mat3 turned = now * then.transpose();
  const Vec2 slid = plane.of(turned * (jaws.slid - jaws.slid_before));
  const double limit = 2.0 * body.friction * jaws.force;
  const bool drags = jaws.taken && jaws.dragged.norm() > 0.0;
  const bool slides = friction.norm() > (1.0 + kExact) * limit || slid.norm() > kLeastWay || drags;
  const bool friction_fits = !slides || (std::abs(friction.norm() - limit) <= kExact * limit);
  const double least = jaws.gap_then - kLeastGap * jaws.thickness;
  const bool squeeze_fits =
      jaws.upper == 0 || std::abs(squeeze - jaws.force) <= kExact * jaws.force;
  if (friction_fits && squeeze_fits) {
    jaws.sliding = slides;
    return false;
  }
  auto stiff = stiffness(response, range, organ, plane, jaws.upper);
  if (!stiff) return false;
  stiff->along *= jaws.stiffer_along;
  stiff->across *= jaws.stiffer_across;

  Vec2 next = slid;
  if (!friction_fits) {
    const Vec2 pull = plane.of(friction);
    if (drags) {
      // Tissue that slid on: dragged by as much as before.
      next = slid + stiff->along.inverse() * (pull - limit * plane.of(jaws.dragged));
    } else {
      next = slide(stiff->along, pull + stiff->along * slid, limit);
    }
    jaws.sliding = drags || next.norm() > kLeastWay;
  } else {
    jaws.sliding = slides;
  }
  double closed = jaws.closed;
  if (!squeeze_fits && stiff->across > 0.0) {
    closed += (jaws.force - squeeze) / stiff->across;
    closed = std::clamp(closed, jaws.closed_before - kClosingSpeed * dt,
                        jaws.closed_before + kClosingSpeed * dt);
    jaws.shut = closed > least;
    closed = std::min(closed, std::max(least, jaws.closed_before));
  }
  const Vec2 more = next - slid;
  const double closer = closed - jaws.closed;
  if (more.norm() < kLeastWay && std::abs(closer) < kLeastWay) return false;
  jaws.awaited = -plane.back(stiff->along * more);
  jaws.awaited_squeeze = stiff->across * closer;
  jaws.slid = jaws.slid_before + turned.transpose() * plane.back(next);
  jaws.closed = closed;
  ++jaws.trials;
  for (std::size_t k = range.begin; k < range.end; ++k)
    cells[k].displacement = carried(jaws, grasp, k - range.begin, organ);
  return true;
}

void note_jaws(const Pose& organ, const CellRange& range, const std::vector<ContactCell>& cells,
               const ContactSolution& solution, FrameReport& report, Jaws& jaws) {
  for (std::size_t k = range.begin; k < range.end; ++k) {
    const Vec3 force = organ.direction_to_world(solution.forces[k]);
    const Vec3 arm = organ.to_world(cells[k].position + cells[k].displacement) - jaws.tip;
    jaws.torque -= arm.cross(force);
    jaws.presses[k - range.begin < jaws.upper ? 0 : 1] += force;
  }
  jaws.way += (jaws.slid - jaws.slid_before).norm();
  if (jaws.sliding) report.raise(kGripSlipped);
  if (!jaws.shut) return;
  ++jaws.shut_frames;
  report.raise(kJawsShut);
}

}  // namespace viscera
