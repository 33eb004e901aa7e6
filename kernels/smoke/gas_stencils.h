// Many points between the faces of the gas grid. What each reads and writes is found once; values
// are then read there and spread from there in an order that doesn't depend on threads.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/smoke/gas_layout.h"
#include "kernels/smoke/gas_points.h"

namespace viscera {

/// gas_sampling.h for many points at once. Reading and spreading take the same weights, so that
/// what particles exchange with the gas is conserved.
class GasStencils {
 public:
  /// `least`: the domain's least corner [m, world].
  void place(const GasLayout& layout, const Vec3& least, const Vec3& spacing,
             const GasPoints& points);
  std::size_t size() const { return layer_.size(); }

  /// Values between the faces at every point.
  void read(const GasFaces& faces, const StridedVectors<float>& values) const;
  /// Values between the middles of cells at every point.
  void read_cells(std::span<const float> cells, std::span<float> values) const;
  /// Adds every point's value of an axis to its eight faces of that axis by their weights. A point
  /// with a value that isn't finite adds nothing.
  void spread(const StridedVectors<const float>& values, std::array<std::vector<double>, 3>& sums);
  std::size_t memory_bytes() const;

 private:
  void sort_by_layer();

  GasLayout layout_;
  // Of each point, along each axis: how far it is from the lower to the upper of the grid lines
  // about it, and of the middles between them.
  std::array<std::vector<float>, 3> line_, middle_;
  std::array<std::vector<std::int32_t>, 3> base_;  // the least of its eight faces of each axis
  std::vector<std::int32_t> cell_base_;            // and of its eight middles
  std::vector<std::int32_t> layer_;                // of cells that it lies in
  // Points by layer, in their own order within one: it reaches faces of its own layer and the two
  // beside it, so every third layer may be worked on at once.
  bool sorted_ = true;
  std::vector<std::uint32_t> order_;
  std::vector<std::size_t> first_;   // of each layer in order_
  std::vector<std::uint32_t> next_;  // of each chunk of points and layer
};

}  // namespace viscera
