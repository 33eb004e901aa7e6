#include "engine/verification/hemisphere_reference.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/verification/number_table.h"

namespace viscera {
namespace {

Result<HemisphereProfile> read_profile(const std::filesystem::path& path) {
  const auto table = read_number_table(path, 3);
  if (!table) return std::unexpected(table.error());
  if (table->size() < 2) return failure(path.string() + ": found fewer than two rows");
  std::vector<HemisphereProfile::Row> rows;
  for (const auto& row : *table) rows.push_back({row[0], row[1], row[2]});
  return HemisphereProfile(std::move(rows));
}

}  // namespace

std::string_view name_of(HemisphereContact contact) {
  switch (contact) {
    case HemisphereContact::kStick:
      return "stick";
    case HemisphereContact::kFrictionless:
      return "frictionless";
    case HemisphereContact::kPress:
      return "press";
  }
  return "";
}

Vec3 HemisphereProfile::at(const Vec3& direction) const {
  const double across = std::hypot(direction.x(), direction.y());
  const double angle = std::atan2(across, direction.z());
  const auto next =
      std::upper_bound(rows_.begin() + 1, rows_.end() - 1, angle,
                       [](double value, const Row& row) { return value < row.polar_angle; });
  const Row& after = *next;
  const Row& before = *(next - 1);
  const double t =
      std::clamp((angle - before.polar_angle) / (after.polar_angle - before.polar_angle), 0.0, 1.0);
  const double radial = (1.0 - t) * before.radial + t * after.radial;
  const double axial = (1.0 - t) * before.axial + t * after.axial;
  if (across == 0.0) return {0.0, 0.0, axial};
  return {radial * direction.x() / across, radial * direction.y() / across, axial};
}

double HemisphereReference::force(HemisphereContact contact) const {
  switch (contact) {
    case HemisphereContact::kStick:
      return stick;
    case HemisphereContact::kFrictionless:
      return frictionless;
    case HemisphereContact::kPress:
      return pressure_force;
  }
  return 0.0;
}

Result<std::vector<HemisphereReference>> read_hemisphere_references(
    const std::filesystem::path& folder) {
  const auto forces = read_number_table(folder / "forces.csv", 6);
  if (!forces) return std::unexpected(forces.error());
  std::vector<HemisphereReference> references;
  for (const auto& row : *forces) {
    HemisphereReference one;
    one.a_over_R = row[0];
    one.poisson_ratio = row[1];
    one.stick = row[2];
    one.frictionless = row[3];
    one.pressure_force = row[4];
    for (const HemisphereContact contact : kHemisphereContacts) {
      const char* prefix = contact == HemisphereContact::kStick          ? "stick"
                           : contact == HemisphereContact::kFrictionless ? "norm"
                                                                         : "press";
      auto profile = read_profile(
          folder / fmt::format("{}_nu{:.2f}_a{:.1f}.csv", prefix, one.poisson_ratio, one.a_over_R));
      if (!profile) return std::unexpected(profile.error());
      one.profiles[static_cast<std::size_t>(contact)] = std::move(*profile);
    }
    references.push_back(std::move(one));
  }
  return references;
}

const HemisphereReference* find_reference(const std::vector<HemisphereReference>& references,
                                          double poisson_ratio, double a_over_R) {
  for (const HemisphereReference& one : references) {
    if (std::abs(one.poisson_ratio - poisson_ratio) < 1e-6 &&
        std::abs(one.a_over_R - a_over_R) < 1e-6) {
      return &one;
    }
  }
  return nullptr;
}

}  // namespace viscera
