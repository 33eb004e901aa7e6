#include "engine/simulation/tool_shape.h"

#include <algorithm>
#include <cmath>

namespace viscera {
namespace {

using Shape = TipDescription::Shape;
using Lowest = ToolShape::Lowest;

std::optional<Lowest> lowest_of_ball(const Vec3& centre, double radius, const Vec3& at,
                                     const Vec3& up) {
  const Vec3 to_centre = centre - at;
  const double height = to_centre.dot(up);
  const double height2 = radius * radius - (to_centre - height * up).squaredNorm();
  if (height2 < 0.0) return std::nullopt;
  const double along = height - std::sqrt(height2);
  return Lowest{along, (along * up - to_centre) / radius};
}

/// Where the line enters the open cylinder around the capsule's axis. From where it comes closest
/// to the axis, so that a line that begins far off loses no digits of what is near.
std::optional<Lowest> lowest_of_tube(const Vec3& foot, const Vec3& axis, double length,
                                     double radius, const Vec3& at, const Vec3& up) {
  const Vec3 m = at - foot;
  const Vec3 up_across = up - up.dot(axis) * axis;
  const Vec3 m_across = m - m.dot(axis) * axis;
  const double a = up_across.squaredNorm();
  if (a < 1e-12) return std::nullopt;  // along the axis: an end ball is met first
  const double closest = -m_across.dot(up_across) / a;
  const Vec3 beside = m_across + closest * up_across;
  const double chord2 = radius * radius - beside.squaredNorm();
  if (chord2 < 0.0) return std::nullopt;
  const double back = std::sqrt(chord2 / a), s = closest - back;
  const double along = (m + s * up).dot(axis);
  if (along < 0.0 || along > length) return std::nullopt;
  return Lowest{s, (beside - back * up_across).normalized()};
}

}  // namespace

std::optional<Lowest> ToolShape::lowest(const Vec3& at, const Vec3& up) const {
  if (kind == Shape::kMesh) {
    // In the instrument's own frame: shaft along z, side along x.
    Mat3 frame;
    frame.col(0) = side;
    frame.col(1) = shaft.cross(side);
    frame.col(2) = shaft;
    const double below = 0.1;  // start well under the tool
    const Vec3 origin = frame.transpose() * (at - below * up - tip);
    const auto hit = body->mesh_surface->cast(origin, frame.transpose() * up, 2.0 * below);
    if (!hit) return std::nullopt;
    const Vec3 facet = area_vector(body->mesh, hit->point.triangle);
    const double size = facet.stableNorm();
    return Lowest{hit->distance - below, size > 0.0 ? Vec3(frame * (facet / size)) : Vec3(-up)};
  }
  std::optional<Lowest> best = lowest_of_ball(tip, radius, at, up);
  if (kind == Shape::kCapsule) {
    for (const std::optional<Lowest>& other : {lowest_of_ball(tip + length * shaft, radius, at, up),
                                               lowest_of_tube(tip, shaft, length, radius, at, up)})
      if (other && (!best || other->along < best->along)) best = other;
  }
  return best;
}

std::vector<Vec3> ToolShape::probes() const {
  if (kind == Shape::kMesh) {
    std::vector<Vec3> places;
    for (const Vec3& v : body->mesh_samples)
      places.push_back(tip + v.x() * side + v.y() * shaft.cross(side) + v.z() * shaft);
    return places;
  }
  std::vector<Vec3> places{tip};
  if (kind == Shape::kCapsule) {
    const int steps = std::clamp(static_cast<int>(std::ceil(length / radius)), 1, 32);
    for (int i = 1; i <= steps; ++i) places.push_back(tip + (length * i / steps) * shaft);
  }
  return places;
}

ToolShape tool_shape(const InstrumentBody& body, const InstrumentState& state, const Pose& pose) {
  const TipDescription& description = body.description.tip;
  ToolShape shape;
  shape.kind = description.shape == Shape::kPoint ? Shape::kSphere : description.shape;
  shape.tip = pose.to_local(state.tip);
  shape.shaft = pose.direction_to_local(state.shaft_direction);
  shape.side = pose.direction_to_local(state.side_direction);
  shape.radius = description.shape == Shape::kPoint ? kPointTipRadius : description.radius;
  shape.length = description.length;
  shape.body = &body;
  return shape;
}

}  // namespace viscera
