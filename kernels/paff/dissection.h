// The order in which the nodes of a body are eliminated, and the fronts that this makes.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "kernels/base/types.h"
#include "kernels/paff/block_matrix.h"

namespace viscera {

/// Nested dissection [George1973] by place: a set of nodes is cut across its longest side, those on
/// one side with a neighbour on the other are its separator, eliminated after both parts. The same
/// at every run, and as sparse as graph partitioning on clouds, whose stencils are balls.
struct Dissection {
  /// Nodes eliminated together. Children come before parents.
  struct Front {
    int first = 0, last = 0;    ///< positions in `order`
    int parent = -1;            ///< index of a front, -1 for a root
    std::vector<int> children;  ///< ascending
    std::vector<int> border;  ///< positions of later nodes that the elimination couples, ascending

    std::size_t own() const { return static_cast<std::size_t>(last - first); }
    std::size_t size() const { return own() + border.size(); }
  };

  std::vector<int> order;     ///< node at each position                        (N)
  std::vector<int> position;  ///< of each node                                 (N)
  std::vector<int> front_of;  ///< front of each position                       (N)
  std::vector<Front> fronts;

  /// Numbers in the factor of a matrix with blocks of `width`.
  std::size_t factor_entries(int width) const;
};

Dissection dissect(std::span<const Vec3> positions, const SymmetricPattern& pattern);

}  // namespace viscera
