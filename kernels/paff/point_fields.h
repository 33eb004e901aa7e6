// Shape functions evaluated at many points, in compressed rows, and the way back from a node to the
// points that it reaches.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "kernels/base/result.h"
#include "kernels/paff/shape_functions.h"

namespace viscera {

/// Row q holds the nodes that reach point q, ascending.
struct PointFields {
  std::vector<std::size_t> begin{0};  ///< (points + 1)
  std::vector<int> nodes;             ///<                                         (entries)
  std::vector<double> values;         ///< phi_J(x_q)                              (entries)
  std::vector<Vec3> gradients;        ///< [1/m]; empty when not asked for         (entries)
  std::vector<double> weights;        ///< W_J(x_q)                                (entries)

  std::size_t points() const { return begin.size() - 1; }
};

/// Fails, naming the point, where the nodes that reach it can't carry the fields' basis.
Result<PointFields> evaluate_fields(const ShapeFunctions& shape, std::span<const Vec3> points,
                                    bool with_gradients);

/// For each node the entries of a PointFields that name it, in the order of the points.
class NodeIncidence {
 public:
  struct Entry {
    int point;
    std::size_t entry;  ///< index into PointFields::nodes
  };

  NodeIncidence(const PointFields& fields, std::size_t node_count);

  std::span<const Entry> of(std::size_t node) const {
    return {entries_.data() + begin_[node], begin_[node + 1] - begin_[node]};
  }

 private:
  std::vector<std::size_t> begin_;
  std::vector<Entry> entries_;
};

}  // namespace viscera
