#include "kernels/base/disjoint_sets.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <vector>

#include "kernels/base/random.h"

namespace viscera {
namespace {

TEST(DisjointSets, StandAloneUntilTheyAreJoined) {
  DisjointSets sets(3);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(sets.root(i), i);
}

TEST(DisjointSets, AreNamedByTheirLeastNumberInWhateverOrderTheyAreJoined) {
  DisjointSets up(6), down(6);
  for (int i = 1; i < 5; ++i) up.join(i, i + 1);
  for (int i = 4; i >= 1; --i) down.join(i + 1, i);
  for (int i = 1; i < 6; ++i) {
    EXPECT_EQ(up.root(i), 1) << i;
    EXPECT_EQ(down.root(i), 1) << i;
  }
  EXPECT_EQ(up.root(0), 0);
}

/// Against names that are handed on by going through all.
TEST(DisjointSets, AgreeWithNamesHandedOnOneByOne) {
  constexpr int kCount = 60;
  DisjointSets sets(kCount);
  std::vector<int> names(kCount);
  std::iota(names.begin(), names.end(), 0);
  const Random random(1, 0);
  for (std::uint64_t joined = 0; joined < 50; ++joined) {
    const int a = static_cast<int>(random.bits(2 * joined) % kCount);
    const int b = static_cast<int>(random.bits(2 * joined + 1) % kCount);
    sets.join(a, b);
    const auto names_of_both = std::minmax({names[std::size_t(a)], names[std::size_t(b)]});
    std::replace(names.begin(), names.end(), names_of_both.second, names_of_both.first);
    for (int i = 0; i < kCount; ++i) ASSERT_EQ(sets.root(i), names[std::size_t(i)]);
  }
}

}  // namespace
}  // namespace viscera
