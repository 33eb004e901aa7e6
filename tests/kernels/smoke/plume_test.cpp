// A laminar plume over a steady source of heat, against its similarity solution in closed form
// (docs/theory/smoke.md, [Yih1951]).
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "kernels/smoke/gas_grid.h"

namespace viscera {
namespace {

constexpr double kPower = 0.1;    // [W]
constexpr double kCell = 1.5e-3;  // [m]
constexpr double kWidth = 72e-3, kHeight = 96e-3;
constexpr double kStep = 1.0 / 120.0;
constexpr double kViscosity = 1.4e-5;  // [m2/s]

struct Station {
  double height;      // over the floor [m]
  double speed;       // on the axis [m/s]
  double half_width;  // where it is half of that [m]
};

GasParameters room(double prandtl) {
  GasParameters parameters;
  parameters.domain =
      Box(Vec3(-0.5 * kWidth, -0.5 * kWidth, 0.0), Vec3(0.5 * kWidth, 0.5 * kWidth, kHeight));
  parameters.cells = static_cast<int>(std::lround(kHeight / kCell));
  parameters.kinematic_viscosity = kViscosity;
  parameters.eddy_viscosity = 0.0;
  parameters.heat_diffusivity = kViscosity / prandtl;
  // Gas slides on the floor, and comes in from all other sides.
  parameters.no_slip = false;
  parameters.open = {true, true, true, true, false, true};
  return parameters;
}

std::vector<Station> plume(double prandtl, double time) {
  GasGrid gas(room(prandtl));
  const GasGift heat = GasGift::warmth(gas.parameters().mixture, kPower * kStep);
  for (int step = 0; step * kStep < time; ++step) {
    gas.give({.position = Vec3(0.0, 0.0, 3e-3), .radius = 1.5e-3, .gift = heat});
    gas.step(kStep);
  }
  std::vector<Station> stations;
  for (double height = 45e-3; height < 76e-3; height += 5e-3) {
    const auto at = [&](double r) { return gas.velocity(Vec3(r, 0.0, height)).z(); };
    const double axis = at(0.0);
    double low = 0.0, high = 0.5 * kWidth;
    for (int i = 0; i < 40; ++i) {
      const double middle = 0.5 * (low + high);
      (at(middle) > 0.5 * axis ? low : high) = middle;
    }
    stations.push_back({height, axis, low});
  }
  return stations;
}

double buoyancy_flux() {
  const GasParameters parameters = room(1.0);
  return parameters.gravity * kPower / parameters.mixture.full_heat();
}

/// Over a source that isn't a point the speed on the axis comes to its own from below, as 1 / z.
/// The widths begin at an origin that is near the source.
void expect_plume(double prandtl, double speed, double shape) {
  const std::vector<Station> stations = plume(prandtl, 2.0);
  double n = 0.0, sum_z = 0.0, sum_w = 0.0, sum_zz = 0.0, sum_zw = 0.0;
  for (const Station& s : stations) {
    const double w = s.half_width * s.half_width;
    n += 1.0, sum_z += s.height, sum_w += w, sum_zz += s.height * s.height, sum_zw += s.height * w;
  }
  const double slope = (n * sum_zw - sum_z * sum_w) / (n * sum_zz - sum_z * sum_z);
  const double expected = (std::sqrt(2.0) - 1.0) / shape;
  const double origin = (sum_z - sum_w / expected) / n;
  testing::Test::RecordProperty("speed_over_exact", std::to_string(stations.back().speed / speed));
  testing::Test::RecordProperty("slope_over_exact", std::to_string(slope / expected));
  testing::Test::RecordProperty("origin_mm", std::to_string(1e3 * origin));
  EXPECT_NEAR(slope, expected, 0.04 * expected);
  EXPECT_NEAR(origin, 3e-3, 15e-3);
  double before = 0.0;
  for (const Station& s : stations) {
    EXPECT_NEAR(s.speed, speed, 0.08 * speed) << s.height;
    EXPECT_GT(s.speed, before) << s.height;
    EXPECT_LT(s.speed, speed) << s.height;
    before = s.speed;
    const double width = std::sqrt(expected * (s.height - origin));
    EXPECT_NEAR(s.half_width, width, 0.03 * width) << s.height;
  }
  EXPECT_NEAR(stations.back().speed, speed, 0.05 * speed);
}

TEST(Plume, RisesAndWidensAsItsSimilaritySolutionForPrandtlOne) {
  const double flux = buoyancy_flux();
  const double shape = std::sqrt(flux / (288.0 * std::numbers::pi * std::pow(kViscosity, 3)));
  expect_plume(1.0, std::sqrt(flux / (2.0 * std::numbers::pi * kViscosity)), shape);
}

TEST(Plume, RisesAndWidensAsItsSimilaritySolutionForPrandtlTwo) {
  const double flux = buoyancy_flux();
  const double shape = std::sqrt(5.0 * flux / (512.0 * std::numbers::pi * std::pow(kViscosity, 3)));
  expect_plume(2.0, std::sqrt(5.0 * flux / (8.0 * std::numbers::pi * kViscosity)), shape);
}

}  // namespace
}  // namespace viscera
