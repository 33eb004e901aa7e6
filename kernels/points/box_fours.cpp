#include "kernels/points/box_fours.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace viscera {
namespace {

/// Where the box of no child lies: no way that begins in a scene reaches it.
constexpr float kFar = 1e30f;
/// Along an axis a way is at least so long, over its whole length; so far it stays within its pad.
constexpr double kLeastSlope = 1e-8;
/// Coordinates lose less than this by rounding, over their size: each, and their difference.
constexpr double kRounding = 4.0 * std::numeric_limits<float>::epsilon();

}  // namespace

BoxFours::BoxFours(const std::vector<Two>& twos) {
  if (twos.empty()) return;
  fours_.reserve(twos.size() / 2 + 1);
  add(twos, 0);
}

int BoxFours::add(const std::vector<Two>& twos, int root) {
  const auto at = [&](int k) -> const Two& { return twos[static_cast<std::size_t>(k)]; };
  // The largest of those that can be opened is, until there are four.
  std::array<int, kChildren> children{root};
  std::size_t count = 1;
  while (count < kChildren) {
    int opened = -1;
    double largest = 0.0;
    for (std::size_t c = 0; c < count; ++c) {
      const Two& two = at(children[c]);
      const Vec3 size = two.box.sizes();
      const double area = size.x() * size.y() + size.y() * size.z() + size.z() * size.x();
      if (two.left >= 0 && (opened < 0 || area > largest)) {
        largest = area;
        opened = static_cast<int>(c);
      }
    }
    if (opened < 0) break;
    const Two& two = at(children[static_cast<std::size_t>(opened)]);
    children[static_cast<std::size_t>(opened)] = two.left;
    children[count++] = two.right;
  }
  const std::size_t self = fours_.size();
  fours_.push_back({});
  for (std::size_t c = 0; c < kChildren; ++c) {
    for (std::size_t a = 0; a < 3; ++a) fours_[self].low[a][c] = fours_[self].high[a][c] = kFar;
    if (c >= count) continue;
    const Two& two = at(children[c]);
    for (std::size_t a = 0; a < 3; ++a) {
      const double low = two.box.min()[static_cast<int>(a)];
      const double high = two.box.max()[static_cast<int>(a)];
      fours_[self].low[a][c] = static_cast<float>(low - kRounding * std::abs(low));
      fours_[self].high[a][c] = static_cast<float>(high + kRounding * std::abs(high));
    }
    const int next = two.left >= 0 ? add(twos, children[c]) : -1 - children[c];
    fours_[self].next[c] = next;
  }
  return static_cast<int>(self);
}

BoxFours::Way::Way(const Vec3& from, const Vec3& to, double pad) {
  const Vec3 way = to - from;
  const double least =
      std::max(kLeastSlope * way.norm(), double{std::numeric_limits<float>::min()});
  for (std::size_t a = 0; a < 3; ++a) {
    const int axis = static_cast<int>(a);
    const double start = from[axis], along = way[axis];
    // The share of the way at which it meets a face loses less than a part in a million, which is
    // of the pad's size; twice that makes up for it.
    const double beside = 2.0 * pad + kRounding * std::abs(start);
    low[a] = static_cast<float>(start + beside);
    high[a] = static_cast<float>(start - beside);
    inverse[a] =
        static_cast<float>(1.0 / (std::abs(along) < least ? std::copysign(least, along) : along));
  }
}

}  // namespace viscera
