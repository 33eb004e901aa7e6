#include "kernels/smoke/mie.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "kernels/smoke/droplet_optics.h"

namespace viscera {
namespace {

// [Bohren1983], appendix A: 0.525 um of radius at 0.6328 um.
TEST(Mie, GivesTheEfficienciesOfThePublishedExample) {
  const double x = 2.0 * std::numbers::pi * 0.525 / 0.6328;
  const MieEfficiencies found = mie(x, 1.55);
  EXPECT_NEAR(found.extinction, 3.10543, 5e-6);
  EXPECT_NEAR(found.scattering, 3.10543, 5e-6);
}

// [Wiscombe1979], index 1.5.
TEST(Mie, GivesThePublishedEfficienciesOfLargeSpheres) {
  const struct {
    double x, extinction, asymmetry;
  } cases[] = {
      {10.0, 2.881999, 0.742913}, {100.0, 2.094388, 0.818246}, {1000.0, 2.013945, 0.827882}};
  for (const auto& [x, extinction, asymmetry] : cases) {
    const MieEfficiencies found = mie(x, 1.5);
    EXPECT_NEAR(found.extinction, extinction, 1e-6) << x;
    EXPECT_NEAR(found.scattering, extinction, 1e-6) << x;
    EXPECT_NEAR(found.asymmetry, asymmetry, 1e-6) << x;
  }
}

TEST(Mie, OfSmallSpheresIsRayleighs) {
  const std::complex<double> index(1.4, 0.05);
  const double x = 0.01;
  const std::complex<double> square = index * index, share = (square - 1.0) / (square + 2.0);
  const MieEfficiencies found = mie(x, index);
  EXPECT_NEAR(found.scattering, 8.0 / 3.0 * std::pow(x, 4) * std::norm(share),
              1e-3 * found.scattering);
  EXPECT_NEAR(found.extinction - found.scattering, 4.0 * x * share.imag(), 1e-3 * found.extinction);
  EXPECT_NEAR(found.asymmetry, 0.0, 1e-3);
}

TEST(Mie, AbsorbingSpheresScatterLessThanTheyTake) {
  for (const double x : {0.3, 3.0, 30.0, 300.0}) {
    const MieEfficiencies found = mie(x, {1.5, 0.1});
    EXPECT_GT(found.scattering, 0.0);
    EXPECT_LT(found.scattering, found.extinction);
    EXPECT_GT(found.asymmetry, 0.0);
    EXPECT_LT(found.asymmetry, 1.0);
  }
}

TEST(Droplets, OfOneSizeHaveItsEfficiencies) {
  const Droplets fog = {
      .median = 5e-6, .deviation = 1.0, .density = 1000.0, .refraction = 1.33, .absorption = 0.0};
  const double wavelength = 0.55e-6;
  const MieEfficiencies one = mie(std::numbers::pi * fog.median / wavelength, 1.33);
  const SmokeOptics optics = optics_of(fog, wavelength);
  EXPECT_NEAR(optics.mass_extinction, 1.5 * one.extinction / (1000.0 * 5e-6), 1e-9);
  EXPECT_NEAR(optics.albedo, 1.0, 1e-9);
  EXPECT_NEAR(optics.asymmetry, one.asymmetry, 1e-9);
}

TEST(Droplets, LargeOnesTakeTwiceTheirOwnShadow) {
  const Droplets rain = {
      .median = 200e-6, .deviation = 1.2, .density = 1000.0, .refraction = 1.33, .absorption = 0.0};
  // The mean of 1/d over the mass of a lognormal: exp(s^2 / 2) / median.
  const double mean = std::exp(0.5 * std::pow(std::log(1.2), 2)) / 200e-6;
  EXPECT_NEAR(optics_of(rain, 0.55e-6).mass_extinction, 1.5 * 2.0 * mean / 1000.0,
              0.03 * 1.5 * 2.0 * mean / 1000.0);
}

TEST(Droplets, SettleAsStokesSaysAndSmallOnesFaster) {
  const GasMixture mixture;
  const auto stokes = [](double d, double density) {
    return density * 9.81 * d * d / (18.0 * gas::kViscosity);
  };
  EXPECT_NEAR(settling_speed({.median = 20e-6, .deviation = 1.0, .density = 1000.0}, mixture),
              stokes(20e-6, 1000.0), 0.01 * stokes(20e-6, 1000.0));
  const double slow =
      settling_speed({.median = 0.1e-6, .deviation = 1.0, .density = 1000.0}, mixture);
  EXPECT_GT(slow, 1.8 * stokes(0.1e-6, 1000.0)) << "slip";
  EXPECT_LT(slow, 4.0 * stokes(0.1e-6, 1000.0));
}

}  // namespace
}  // namespace viscera
