// Values of many points onto the faces about them, in an order that doesn't depend on threads.
#pragma once

#include <cstdint>
#include <vector>

#include "kernels/base/parallel.h"
#include "kernels/smoke/gas_points.h"
#include "kernels/smoke/gas_sampling.h"

namespace viscera {

/// Points sorted by the layer of cells that they lie in, in their own order within one. A point
/// reaches faces of its own layer and the next to it, so every third layer may be worked on at
/// once.
class PointLayers {
 public:
  /// `places` in cells from the domain's least corner by `to_cells`(i).
  template <class ToCells>
  void sort(const GasLayout& layout, std::size_t points, const ToCells& to_cells) {
    const int layers = layout.n[2];
    layer_.resize(points);
    parallel_for_each_index(points, 4096, [&](std::size_t i) {
      const float z = std::min(std::max(0.0f, to_cells(i).z()), static_cast<float>(layers - 1));
      layer_[i] = static_cast<int>(z);
    });
    first_.assign(static_cast<std::size_t>(layers) + 1, 0);
    for (const int layer : layer_) ++first_[static_cast<std::size_t>(layer) + 1];
    for (std::size_t l = 0; l + 1 < first_.size(); ++l) first_[l + 1] += first_[l];
    order_.resize(points);
    next_.assign(first_.begin(), first_.end() - 1);
    for (std::size_t i = 0; i < points; ++i) {
      order_[next_[static_cast<std::size_t>(layer_[i])]++] = static_cast<std::uint32_t>(i);
    }
  }

  /// Calls body(i) for every point, never at once for points that share a face.
  template <class Body>
  void each(const Body& body) const {
    const std::size_t layers = first_.size() - 1;
    for (std::size_t colour = 0; colour < 3; ++colour) {
      parallel_for_each_index((layers + 2 - colour) / 3, 1, [&](std::size_t l) {
        const std::size_t layer = 3 * l + colour;
        for (std::size_t i = first_[layer]; i < first_[layer + 1]; ++i) body(order_[i]);
      });
    }
  }

 private:
  std::vector<int> layer_;          // a point's
  std::vector<std::size_t> first_;  // of each layer in order_
  std::vector<std::size_t> next_;
  std::vector<std::uint32_t> order_;  // points by layer
};

}  // namespace viscera
