#include "engine/render/vessel_pattern.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdlib>

namespace viscera {
namespace {

constexpr int kEdge = 512;

double share_covered(const VesselPattern& pattern, std::size_t channel, int least) {
  std::size_t covered = 0;
  for (std::size_t i = channel; i < pattern.coverage.size(); i += 2)
    covered += pattern.coverage[i] >= least;
  return 2.0 * static_cast<double>(covered) / static_cast<double>(pattern.coverage.size());
}

TEST(VesselPattern, ArteriesAndVeinsAreThinLinesWithThickerTrunks) {
  const VesselPattern pattern = grow_vessels(kEdge);
  ASSERT_EQ(pattern.edge, kEdge);
  ASSERT_EQ(pattern.coverage.size(), 2u * kEdge * kEdge);
  for (const std::size_t channel : {0u, 1u}) {
    const double any = share_covered(pattern, channel, 20);
    EXPECT_GT(any, 0.03) << channel;
    EXPECT_LT(any, 0.35) << channel;
    const double trunks = share_covered(pattern, channel, 150);
    EXPECT_GT(trunks, 0.002) << channel;
    EXPECT_LT(trunks, 0.5 * any) << channel;
  }
}

TEST(VesselPattern, VesselsReachEveryPartOfTheSquare) {
  const VesselPattern pattern = grow_vessels(kEdge);
  constexpr int kPart = kEdge / 4;
  for (int py = 0; py < 4; ++py) {
    for (int px = 0; px < 4; ++px) {
      int covered = 0;
      for (int y = 0; y < kPart; ++y)
        for (int x = 0; x < kPart; ++x) {
          const auto at = static_cast<std::size_t>((py * kPart + y) * kEdge + px * kPart + x);
          covered += pattern.coverage[2 * at] > 20;
        }
      EXPECT_GT(covered, 20) << px << " " << py;
    }
  }
}

TEST(VesselPattern, EdgesMeetWhereTheSquareIsRepeated) {
  const VesselPattern pattern = grow_vessels(kEdge);
  // Across the seam neighbours differ no more than within.
  const auto difference = [&](int column, int next) {
    double sum = 0.0;
    for (int y = 0; y < kEdge; ++y)
      sum += std::abs(pattern.coverage[static_cast<std::size_t>(2 * (y * kEdge + column))] -
                      pattern.coverage[static_cast<std::size_t>(2 * (y * kEdge + next))]);
    return sum / kEdge;
  };
  double within = 0.0;
  for (int x = 0; x + 1 < kEdge; ++x) within += difference(x, x + 1) / (kEdge - 1);
  EXPECT_LT(difference(kEdge - 1, 0), 2.0 * within + 1.0);
}

TEST(VesselPattern, GrowsTheSameEveryTime) {
  EXPECT_EQ(grow_vessels(128).coverage, grow_vessels(128).coverage);
}

}  // namespace
}  // namespace viscera
