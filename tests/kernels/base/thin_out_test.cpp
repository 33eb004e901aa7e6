#include "kernels/base/thin_out.h"

#include <gtest/gtest.h>

#include <numeric>

namespace viscera {
namespace {

std::vector<int> thinned(int count, std::size_t most) {
  std::vector<int> values(static_cast<std::size_t>(count));
  std::iota(values.begin(), values.end(), 0);
  thin_out(values, most);
  return values;
}

TEST(ThinOut, KeepsEveryNthInOrder) {
  EXPECT_EQ(thinned(10, 4), (std::vector<int>{0, 3, 6, 9}));
  EXPECT_EQ(thinned(7, 6), (std::vector<int>{0, 2, 4, 6}));
}

TEST(ThinOut, LeavesFewAsTheyAre) {
  EXPECT_EQ(thinned(4, 4), (std::vector<int>{0, 1, 2, 3}));
  EXPECT_EQ(thinned(0, 4), std::vector<int>());
}

TEST(ThinOut, NeverLeavesMoreThanAsked) {
  for (int count = 1; count < 200; ++count) {
    for (std::size_t most = 1; most < 20; ++most) {
      const auto left = thinned(count, most);
      EXPECT_LE(left.size(), most) << count;
      EXPECT_EQ(left.front(), 0);
    }
  }
}

}  // namespace
}  // namespace viscera
