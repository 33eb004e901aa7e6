#include "kernels/points/box_fours.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "kernels/base/random.h"

namespace viscera {
namespace {

/// Halves of a list, down to single boxes; which node stands for each.
int add_halves(const std::vector<Box>& boxes, std::size_t begin, std::size_t end,
               std::vector<BoxFours::Two>& twos, std::vector<int>& leaf_of) {
  const int self = static_cast<int>(twos.size());
  twos.push_back({});
  Box about;
  for (std::size_t b = begin; b < end; ++b) about.extend(boxes[b]);
  twos.back().box = about;
  if (end - begin == 1) {
    leaf_of[begin] = self;
    return self;
  }
  const std::size_t middle = (begin + end) / 2;
  const int left = add_halves(boxes, begin, middle, twos, leaf_of);
  const int right = add_halves(boxes, middle, end, twos, leaf_of);
  twos[static_cast<std::size_t>(self)].left = left;
  twos[static_cast<std::size_t>(self)].right = right;
  return self;
}

/// Exactly, for a box larger by this on all sides.
bool meets(const Vec3& from, const Vec3& to, const Box& box, double more) {
  double begin = 0.0, end = 1.0;
  for (int a = 0; a < 3; ++a) {
    const double low = box.min()[a] - more - from[a], high = box.max()[a] + more - from[a];
    const double way = to[a] - from[a];
    if (way == 0.0) {
      if (low > 0.0 || high < 0.0) return false;
      continue;
    }
    begin = std::max(begin, std::min(low / way, high / way));
    end = std::min(end, std::max(low / way, high / way));
  }
  return begin <= end;
}

std::set<int> met(const BoxFours& fours, const Vec3& from, const Vec3& to, double pad) {
  std::set<int> leaves;
  fours.any_leaf(BoxFours::Way(from, to, pad), [&](int leaf) {
    leaves.insert(leaf);
    return false;
  });
  return leaves;
}

struct Cloud {
  std::size_t boxes;
  double size, offset;  // of all of them; along each axis
};

class RandomBoxes : public testing::TestWithParam<Cloud> {
 protected:
  Vec3 share() {
    const double x = random_.uniform(at_++), y = random_.uniform(at_++), z = random_.uniform(at_++);
    return Vec3(x, y, z);
  }
  Vec3 place() { return GetParam().size * share() + GetParam().offset * Vec3(1.0, -1.0, 0.7); }

  Random random_{11, 0};
  std::uint64_t at_ = 0;
};

TEST_P(RandomBoxes, AreFoundByEveryWayThatMeetsThemAndByFewOthers) {
  std::vector<Box> boxes;
  for (std::size_t b = 0; b < GetParam().boxes; ++b) {
    const Vec3 lowest = place();
    Vec3 size = 0.3 * GetParam().size * share();
    if (b % 3 == 1) size.z() = 0.0;  // a flat triangle's
    boxes.emplace_back(lowest, Vec3(lowest + size));
  }
  // Far from the origin single precision tells fewer boxes apart.
  const double rounding = 5e-7 * std::abs(GetParam().offset);
  std::vector<BoxFours::Two> twos;
  std::vector<int> leaf_of(boxes.size());
  add_halves(boxes, 0, boxes.size(), twos, leaf_of);
  const BoxFours fours(twos);
  int found = 0;
  for (int way = 0; way < 400; ++way) {
    const Vec3 from = place();
    Vec3 to = place();
    // Along one axis, in a plane, or of no length, too.
    if (way % 4 == 1) to.tail<2>() = from.tail<2>();
    if (way % 4 == 2) to.x() = from.x();
    if (way % 4 == 3) to.y() = from.y() + (way % 8 == 3 ? 0.5e-8 : 2e-8) * GetParam().size;
    if (way % 40 == 3) to = from;
    const double pad = 1e-6 * (to - from).norm() + 1e-7 * GetParam().size;
    const std::set<int> leaves = met(fours, from, to, pad);
    for (std::size_t b = 0; b < boxes.size(); ++b) {
      const bool seen = leaves.contains(leaf_of[b]);
      if (meets(from, to, boxes[b], pad)) {
        EXPECT_TRUE(seen) << way << " " << b;
        ++found;
      } else if (!meets(from, to, boxes[b], 10.0 * (pad + rounding))) {
        EXPECT_FALSE(seen) << way << " " << b;
      }
    }
  }
  EXPECT_GT(found, 0);
}

INSTANTIATE_TEST_SUITE_P(Clouds, RandomBoxes,
                         testing::Values(Cloud{1, 1.0, 0.0}, Cloud{2, 1.0, 0.0}, Cloud{5, 1.0, 0.0},
                                         Cloud{300, 1.0, 0.0}, Cloud{300, 0.05, 0.3},
                                         Cloud{300, 1e-5, 0.3}, Cloud{300, 1.0, 10.0},
                                         Cloud{300, 200.0, -1000.0}));

TEST(BoxFours, OfNothingAreMetByNoWay) {
  EXPECT_TRUE(met(BoxFours(), {0, 0, 0}, {1, 1, 1}, 1e-6).empty());
  EXPECT_TRUE(met(BoxFours(std::vector<BoxFours::Two>()), {0, 0, 0}, {1, 1, 1}, 1e-6).empty());
}

TEST(BoxFours, StopAtTheFirstLeafThatWillDo) {
  std::vector<Box> boxes(9, Box(Vec3(0, 0, 0), Vec3(1, 1, 1)));
  std::vector<BoxFours::Two> twos;
  std::vector<int> leaf_of(boxes.size());
  add_halves(boxes, 0, boxes.size(), twos, leaf_of);
  int visited = 0;
  const bool any = BoxFours(twos).any_leaf(BoxFours::Way({-1, 0.5, 0.5}, {2, 0.5, 0.5}, 1e-5),
                                           [&](int) { return ++visited == 3; });
  EXPECT_TRUE(any);
  EXPECT_EQ(visited, 3);
}

}  // namespace
}  // namespace viscera
