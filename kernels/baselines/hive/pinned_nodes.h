// Tool nodes of the published scheme: surface nodes under the tool are moved with it [De2006]
// eq. 9.
#pragma once

#include <span>
#include <vector>

#include "kernels/contact/patch_contact.h"
#include "kernels/hive/hive_nodes.h"

namespace viscera {

/// f = C_nn^-1 U over the nodes that the tool touches, along its cells' directions; no more than
/// that: nodes may pull, and C_nn isn't symmetric.
class PinnedNodes {
 public:
  explicit PinnedNodes(int most_nodes);

  /// The free surface nodes that lie under a cell, or the one nearest to the tool's middle.
  void seat(std::span<const ContactCell> cells, const HiveNodes& nodes, int free_nodes,
            Eigen::Ref<const MatrixX> compliance) noexcept;
  /// Forces on the tissue along the directions of `cells()` [N]; false: C_nn is singular.
  bool solve(std::span<const double> depths) noexcept;

  std::span<const int> nodes() const noexcept { return nodes_; }
  std::span<const int> cells() const noexcept { return cells_; }  ///< the cell over each node
  std::span<const double> forces() const noexcept { return forces_; }

 private:
  std::vector<int> nodes_, cells_;
  std::vector<double> forces_, rows_;
  MatrixX matrix_;
};

}  // namespace viscera
