#include "engine/features/gravity/gravity.h"

#include <algorithm>
#include <cmath>

namespace viscera {
namespace {

/// Tables turn slowly: greatest_sag looks this often [s].
constexpr double kLookEvery = 0.1;

KeyFrames table_path(const std::vector<TableKey>& table) {
  if (table.empty()) return KeyFrames({0.0}, {Vec3::Zero()});
  std::vector<double> times;
  std::vector<Vec3> angles;
  for (const TableKey& key : table) {
    times.push_back(key.time);
    angles.emplace_back(key.head_up, key.left_down, 0.0);
  }
  return KeyFrames(std::move(times), std::move(angles));
}

/// Where gravity points on a table with its head end up and then rolled about its long axis. Head
/// up pulls to the feet (-y), the left side (+x) down to the left.
Vec3 down(double head_up, double left_down) {
  return {std::cos(head_up) * std::sin(left_down), -std::sin(head_up),
          -std::cos(head_up) * std::cos(left_down)};
}

}  // namespace

Gravity::Gravity(const GravityDescription& description)
    : acceleration_(description.acceleration),
      rest_direction_(description.rest_direction),
      table_(table_path(description.table)) {}

Vec3 Gravity::change_at(double time) const {
  const Vec3 angles = table_.at(time);
  return acceleration_ * (down(angles[0], angles[1]) - rest_direction_);
}

Vec3 Gravity::at(double time) const {
  const Vec3 angles = table_.at(time);
  return acceleration_ * down(angles[0], angles[1]);
}

void add_sag(const OrganModel& model, const Vec3& change, std::vector<float>& places) {
  if (!model.sag.empty()) add_along_axes(model.sag, change, places);
}

double greatest_sag(const OrganModel& model, const Pose& pose, const Gravity& gravity,
                    double duration) {
  if (model.sag.empty()) return 0.0;
  std::vector<float> places;
  float greatest = 0.0f;
  Vec3 last = Vec3::Zero();
  for (double time = 0.0; time < duration + kLookEvery; time += kLookEvery) {
    const Vec3 change = pose.direction_to_local(gravity.change_at(std::min(time, duration)));
    if (change == last) continue;
    last = change;
    places.assign(model.displacement_rows(), 0.0f);
    add_sag(model, change, places);
    for (std::size_t p = 0; p < places.size(); p += 3)
      greatest = std::max(greatest, Vec3f::Map(places.data() + p).squaredNorm());
  }
  return std::sqrt(static_cast<double>(greatest));
}

}  // namespace viscera
