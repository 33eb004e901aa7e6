#include "kernels/smoke/viscosity.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>

#include "engine/verification/shear_decay.h"
#include "kernels/smoke/step_passes.h"

namespace viscera {
namespace {

double shear_error(int across, double jitter, std::uint64_t seed, Laplacian laplacian) {
  CpuSmokePasses passes;
  return shear_decay_error(passes, laplacian, across, jitter, seed).value();
}

double vortex_error(int across, double jitter, std::uint64_t seed, Laplacian laplacian) {
  CpuSmokePasses passes;
  return vortex_decay_error(passes, laplacian, across, jitter, seed).value();
}

TEST(Viscosity, ShearWaveDecaysWithinThreePercentAtASixteenthOfItsLength) {
  for (const double jitter : {0.0, 0.2, 0.35, 0.5}) {
    for (const std::uint64_t seed : {1, 2, 3}) {
      const double error = shear_error(16, jitter, seed, Laplacian::kPairwise);
      RecordProperty("jitter_" + std::to_string(jitter), std::to_string(error));
      EXPECT_LT(std::abs(error), 0.03) << "jitter " << jitter << ", seed " << seed;
    }
  }
}

TEST(Viscosity, VortexDecaysAtTheExactRateToo) {
  for (const double jitter : {0.0, 0.35, 0.5}) {
    const double error = vortex_error(16, jitter, 4, Laplacian::kPairwise);
    EXPECT_LT(std::abs(error), 0.03) << "jitter " << jitter;
  }
}

TEST(Viscosity, ErrorShrinksWithSpacingPairwiseAndDoesNotByThePapersLaplacian) {
  std::array<double, 3> pairwise, paper, vortex;
  int n = 0;
  for (const int across : {8, 16, 24}) {
    pairwise[n] = std::abs(shear_error(across, 0.3, 5, Laplacian::kPairwise));
    paper[n] = std::abs(shear_error(across, 0.3, 5, Laplacian::kPaper));
    vortex[n] = std::abs(vortex_error(across, 0.3, 5, Laplacian::kPairwise));
    const std::string at = "_at_" + std::to_string(across);
    RecordProperty("pairwise" + at, std::to_string(pairwise[n]));
    RecordProperty("paper" + at, std::to_string(paper[n]));
    RecordProperty("vortex" + at, std::to_string(vortex[n]));
    ++n;
  }
  EXPECT_LT(pairwise[1], 0.5 * pairwise[0]);
  EXPECT_LT(pairwise[2], 0.01);
  EXPECT_LT(vortex[1], 0.3 * vortex[0]);
  EXPECT_LT(vortex[2], 0.01);
  // It stays near six percent (0.064 at 1/32).
  EXPECT_GT(paper[1], 0.04);
  EXPECT_GT(paper[2], 0.04);
}

}  // namespace
}  // namespace viscera
