// Boxes in a tree of four children a node, for straight ways: one step compares a way with four
// boxes at once, in single precision. A box that a way meets is never missed; one that it misses by
// less than rounding may be found.
#pragma once

#include <array>
#include <vector>

#include "kernels/base/types.h"

namespace viscera {

class BoxFours {
 public:
  /// Nodes of a tree of two children; a leaf has none.
  struct Two {
    Box box;
    int left = -1, right = -1;
  };
  /// Of these nodes, the first of which is the root; none: no way meets anything. No leaf lies more
  /// than 40 below the root, as of halves none does. Coordinates far below 1e30.
  explicit BoxFours(const std::vector<Two>& twos);
  BoxFours() = default;

  /// A straight way from `from` to `to`, for boxes larger by `pad` (at least a millionth of its
  /// length).
  struct Way {
    Way(const Vec3& from, const Vec3& to, double pad);
    std::array<float, 3> low, high;  ///< where it begins, seen by the boxes' faces
    std::array<float, 3> inverse;    ///< of its length along each axis
  };

  /// Calls visit(leaf), a number of `twos`, for each leaf whose box the way meets, until it says
  /// true for one, which is the answer.
  template <class Visit>
  bool any_leaf(const Way& way, const Visit& visit) const {
    std::array<int, kStackSize> stack;
    int depth = 0;
    if (!fours_.empty()) stack[depth++] = 0;
    while (depth > 0) {
      const Four& four = fours_[static_cast<std::size_t>(stack[--depth])];
      for (unsigned met = boxes_met(four, way), child = 0; met != 0; met >>= 1, ++child) {
        if ((met & 1) == 0) continue;
        const int next = four.next[child];
        if (next >= 0) {
          stack[depth++] = next;
        } else if (visit(-1 - next)) {
          return true;
        }
      }
    }
    return false;
  }

 private:
  static constexpr int kStackSize = 128;
  static constexpr int kChildren = 4;
  using Floats = float __attribute__((vector_size(16)));

  struct Four {
    Floats low[3], high[3];           // of the children; of none, far away
    std::array<int, kChildren> next;  // a four; -1 - k: the leaf k
  };

  int add(const std::vector<Two>& twos, int root);
  static unsigned boxes_met(const Four& four, const Way& way);

  std::vector<Four> fours_;
};

/// A bit for each child.
inline unsigned BoxFours::boxes_met(const Four& four, const Way& way) {
  Floats begin = {0.0f, 0.0f, 0.0f, 0.0f}, end = {1.0f, 1.0f, 1.0f, 1.0f};
  for (std::size_t a = 0; a < 3; ++a) {
    const Floats first = (four.low[a] - way.low[a]) * way.inverse[a];
    const Floats second = (four.high[a] - way.high[a]) * way.inverse[a];
    const Floats nearer = first < second ? first : second;
    const Floats farther = first < second ? second : first;
    begin = begin > nearer ? begin : nearer;
    end = end < farther ? end : farther;
  }
  const auto met = begin <= end;
  return static_cast<unsigned>((met[0] & 1) | (met[1] & 2) | (met[2] & 4) | (met[3] & 8));
}

}  // namespace viscera
