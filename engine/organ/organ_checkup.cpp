#include "engine/organ/organ_checkup.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/organ/figures_text.h"

namespace viscera {
namespace {

constexpr double kReach = 20e-3;  // around the frontmost place [m]
constexpr double kVolumeError = 0.03;
constexpr double kSliver = 8.0;            // least angle [deg]
constexpr double kThinShare = 0.02;        // of the area that may be thin
constexpr double kLongPreparation = 60.0;  // [s]
/// As nearly incompressible as organs are: that decides what preparation takes.
constexpr IsotropicMaterial kSoftTissue{.youngs_modulus = 1e3, .poisson_ratio = 0.45};

}  // namespace

Resolution suggested_resolution(double volume) {
  Resolution resolution;
  const auto rounded = [](double x) { return std::round(x * 2e3) / 2e3; };  // to half millimetres
  resolution.spacing = rounded(std::clamp(std::cbrt(volume) / 9.0, 1.5e-3, 12e-3));
  resolution.finest = rounded(std::clamp(0.4 * resolution.spacing, 1.5e-3, 4e-3));
  resolution.finest = std::min(resolution.finest, resolution.spacing);
  return resolution;
}

Region back_region(const Box& box) {
  Region region;
  region.shape = Region::Shape::kHalfSpace;
  region.a = box.center();
  region.a.z() = box.min().z() + 0.25 * box.sizes().z();
  region.b = Vec3::UnitZ();
  return region;
}

OrganCheckup check_organ(const TriangleSurface& surface, OrganDescription& organ,
                         std::optional<double> label_volume) {
  OrganCheckup checkup;
  Reach reach;
  reach.radius = kReach;
  reach.tips.push_back(
      {*std::ranges::max_element(surface.vertices, {}, [](const Vec3& x) { return x.z(); })});
  const auto plan_it = [&]() -> Result<OrganPlan> {
    const auto demand = demand_on(organ, Tissue{}, reach, surface);
    if (!demand) return std::unexpected(demand.error());
    return plan_surface(surface, {organ, kSoftTissue, *demand});
  };
  Resolution& resolution = organ.resolution;
  const Resolution suggested = resolution;
  std::string reason;
  for (int attempt = 0; attempt < 3; ++attempt) {
    auto plan = plan_it();
    if (plan) {
      checkup.plan = std::move(*plan);
      reason.clear();
      break;
    }
    reason = plan.error().text();
    resolution.spacing *= 0.6;
    resolution.finest = std::min(resolution.finest, resolution.spacing);
  }
  std::vector<std::string>& warnings = checkup.warnings;
  if (!reason.empty()) {
    resolution = suggested;
    organ.deformable = false;
    warnings.push_back(
        "it can't be deformed at spacings down to a fifth of " +
        fmt::format("{:.3g} mm ({}): its entry makes it scenery", 1e3 * suggested.spacing, reason));
    auto plan = plan_it();
    if (plan) checkup.plan = std::move(*plan);
  }
  checkup.quality = measure_quality(surface, 2.0 * resolution.spacing);
  const SurfaceQuality& quality = checkup.quality;
  if (label_volume && std::abs(quality.volume / *label_volume - 1.0) > kVolumeError) {
    warnings.push_back(fmt::format("its volume is {:.1f} ml, that of the labels {:.1f} ml",
                                   1e6 * quality.volume, 1e6 * *label_volume));
  }
  if (quality.genus > 0) {
    warnings.push_back(fmt::format(
        "it has {} handle{} (holes that go through it): right for a ring of colon, a mistake of "
        "segmentation in most other organs",
        quality.genus, quality.genus == 1 ? "" : "s"));
  }
  if (const double angle = quality.least_angle * 180.0 / std::numbers::pi; angle < kSliver) {
    warnings.push_back(fmt::format("a triangle at {} has an angle of {:.1f} degrees",
                                   place_text(quality.least_angle_place), angle));
  }
  if (quality.thin_share > kThinShare && quality.thinnest_wall > 0.0) {
    warnings.push_back(fmt::format(
        "{:.0f} % of its area has walls thinner than two node spacings ({:.3g} mm), the thinnest "
        "{:.2g} mm at {}: such walls bend too little or too much; lower spacing_mm, or make it "
        "scenery (\"deformable\": false)",
        100.0 * quality.thin_share, 2e3 * resolution.spacing, 1e3 * quality.thinnest_wall,
        place_text(quality.thinnest_place)));
  }
  if (checkup.plan.prepare_s > kLongPreparation) {
    warnings.push_back(fmt::format("preparing it will take about {:.0f} s: raise finest_spacing_mm",
                                   checkup.plan.prepare_s));
  }
  return checkup;
}

}  // namespace viscera
