#include "kernels/base/random.h"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <set>

namespace viscera {
namespace {

constexpr std::uint64_t kDraws = 200'000;
const double kNoise = 5.0 / std::sqrt(static_cast<double>(kDraws));  // five standard deviations

TEST(Random, ValueDependsOnSeedStreamAndCounterAlone) {
  const Random random(7, 3);
  const double late = random.uniform(1000);
  for (std::uint64_t i = 0; i < 1000; ++i) random.bits(i);
  EXPECT_EQ(random.uniform(1000), late);
  EXPECT_EQ(Random(7, 3).uniform(1000), late);
  EXPECT_NE(Random(8, 3).uniform(1000), late);
  EXPECT_NE(Random(7, 4).uniform(1000), late);
}

// The first outputs of SplitMix64 with the state 0 [Steele2014].
TEST(Random, MixerIsSplitMix64) {
  EXPECT_EQ(mix64(0), 0xe220a8397b1dcdafull);
  EXPECT_EQ(mix64(0x9e3779b97f4a7c15ull), 0x6e789e6aa1b965f4ull);
}

TEST(Random, UniformHasTheMomentsOfTheUnitInterval) {
  const Random random(1, 2);
  double sum = 0.0, square = 0.0, cube = 0.0, neighbours = 0.0;
  for (std::uint64_t i = 0; i < kDraws; ++i) {
    const double u = random.uniform(i);
    ASSERT_GE(u, 0.0);
    ASSERT_LT(u, 1.0);
    sum += u;
    square += u * u;
    cube += u * u * u;
    neighbours += (u - 0.5) * (random.uniform(i + 1) - 0.5);
  }
  EXPECT_NEAR(sum / kDraws, 1.0 / 2.0, 0.289 * kNoise);
  EXPECT_NEAR(square / kDraws, 1.0 / 3.0, 0.298 * kNoise);
  EXPECT_NEAR(cube / kDraws, 1.0 / 4.0, 0.284 * kNoise);
  EXPECT_NEAR(neighbours / kDraws, 0.0, kNoise / 12.0);
}

TEST(Random, NormalHasTheMomentsOfTheGaussian) {
  const Random random(5, 6);
  double sum = 0.0, square = 0.0, cube = 0.0, fourth = 0.0;
  for (std::uint64_t i = 0; i < kDraws; ++i) {
    const double x = random.normal(i);
    ASSERT_TRUE(std::isfinite(x));
    sum += x;
    square += x * x;
    cube += x * x * x;
    fourth += x * x * x * x;
  }
  EXPECT_NEAR(sum / kDraws, 0.0, kNoise);
  EXPECT_NEAR(square / kDraws, 1.0, std::sqrt(2.0) * kNoise);
  EXPECT_NEAR(cube / kDraws, 0.0, std::sqrt(15.0) * kNoise);
  EXPECT_NEAR(fourth / kDraws, 3.0, std::sqrt(96.0) * kNoise);
}

TEST(Random, DirectionsCoverTheSphereEvenly) {
  const Random random(9, 1);
  Vec3 sum = Vec3::Zero();
  Mat3 spread = Mat3::Zero();
  for (std::uint64_t i = 0; i < kDraws; ++i) {
    const Vec3 direction = random.direction(i);
    ASSERT_NEAR(direction.norm(), 1.0, 1e-12);
    sum += direction;
    spread += direction * direction.transpose();
  }
  EXPECT_LT((sum / kDraws).cwiseAbs().maxCoeff(), 0.577 * kNoise);
  EXPECT_LT((spread / kDraws - Mat3::Identity() / 3.0).cwiseAbs().maxCoeff(), 0.3 * kNoise);
}

// Neighbouring streams and seeds are what particles and instruments use.
TEST(Random, StreamsAreIndependent) {
  const std::array<std::pair<Random, Random>, 3> pairs = {{
      {Random(1, 0), Random(1, 1)},
      {Random(1, 0), Random(2, 0)},
      {Random(1, 2), Random(2, 1)},
  }};
  for (const auto& [a, b] : pairs) {
    double product = 0.0, bits = 0.0;
    for (std::uint64_t i = 0; i < kDraws; ++i) {
      product += (a.uniform(i) - 0.5) * (b.uniform(i) - 0.5);
      bits += std::popcount(a.bits(i) ^ b.bits(i));
    }
    EXPECT_NEAR(product / kDraws, 0.0, kNoise / 12.0);
    EXPECT_NEAR(bits / kDraws, 32.0, 4.0 * kNoise);
  }
}

TEST(Random, ManyStreamsShareNoValue) {
  std::set<std::uint64_t> seen;
  for (std::uint64_t stream = 0; stream < 100; ++stream) {
    const Random random(1, stream);
    for (std::uint64_t i = 0; i < 100; ++i) seen.insert(random.bits(i));
  }
  EXPECT_EQ(seen.size(), 10'000u);
}

}  // namespace
}  // namespace viscera
