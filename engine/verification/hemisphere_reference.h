// Converged answers for the hemisphere pressed at its pole (assets/reference/hemisphere/README.md).
#pragma once

#include <array>
#include <filesystem>
#include <string_view>
#include <vector>

#include "kernels/base/result.h"
#include "kernels/base/types.h"

namespace viscera {

/// How the hemisphere is loaded within polar angle asin(a / R): moved down whole and stuck there,
/// moved down and free to slide, or under the smooth pressure (1 - s^2 / a^2)^2 E.
enum class HemisphereContact { kStick, kFrictionless, kPress };
inline constexpr std::array kHemisphereContacts = {
    HemisphereContact::kStick, HemisphereContact::kFrictionless, HemisphereContact::kPress};
std::string_view name_of(HemisphereContact contact);

/// Depth of stick and frictionless contact over the radius.
inline constexpr double kHemisphereDepth = 0.08;

/// The deformed dome as a function of the polar angle, in units of R and E.
class HemisphereProfile {
 public:
  struct Row {
    double polar_angle;    ///< from the pole [rad]
    double radial, axial;  ///< displacement over R: away from the axis, up along it
  };
  HemisphereProfile() = default;
  /// Rows by ascending angle, at least two.
  explicit HemisphereProfile(std::vector<Row> rows) : rows_(std::move(rows)) {}

  /// Displacement over R at a place of the dome, linear between rows. `direction` is unit, the pole
  /// along z.
  Vec3 at(const Vec3& direction) const;
  const std::vector<Row>& rows() const { return rows_; }

 private:
  std::vector<Row> rows_;
};

/// One Poisson's ratio and one contact radius.
struct HemisphereReference {
  double poisson_ratio = 0.0;
  double a_over_R = 0.0;
  double stick = 0.0, frictionless = 0.0;     ///< F / (E R delta)
  double pressure_force = 0.0;                ///< F / (E R^2)
  std::array<HemisphereProfile, 3> profiles;  ///< by HemisphereContact

  /// F / (E R delta); for `press`, F / (E R^2).
  double force(HemisphereContact contact) const;
  const HemisphereProfile& profile(HemisphereContact contact) const {
    return profiles[static_cast<std::size_t>(contact)];
  }
};

/// forces.csv of the folder and the profiles that it names. Fails, naming file and line, where one
/// is missing or isn't a table of numbers.
Result<std::vector<HemisphereReference>> read_hemisphere_references(
    const std::filesystem::path& folder);

/// The entry of this case, or nullptr.
const HemisphereReference* find_reference(const std::vector<HemisphereReference>& references,
                                          double poisson_ratio, double a_over_R);

}  // namespace viscera
