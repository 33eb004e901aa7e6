// A factor as a preconditioner that is asked thousands of times a second: what it takes is to read
// it, so it is kept in sixteen bits, and separate parts of the body are read by separate threads.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/paff/stiffness_factor.h"

namespace viscera {

/// K ~ L L^T, each column of L below its diagonal in whole numbers of a 32,767th of its greatest
/// entry. Immutable; from many threads at once.
class CompactFactor {
 public:
  explicit CompactFactor(const PackedFactor& factor);

  /// x ~ K^-1 b, symmetric and positive. The same bits for any number of threads.       (3 N)
  void apply(std::span<const double> b, std::span<double> x) const;

  std::size_t nodes() const { return order_.size(); }
  std::size_t memory_bytes() const;

 private:
  struct Front {
    std::size_t first = 0, own = 0, border = 0;  // of unknowns
    std::size_t targets = 0;                     // of its border
    std::size_t numbers = 0;                     // of its first column
  };
  /// A subtree, which one thread reads; what it adds to unknowns after its own is kept apart.
  struct Part {
    std::vector<std::size_t> fronts;  // children first
    std::vector<std::size_t> beyond;  // those unknowns
  };

  struct Work {
    std::vector<float> factors, border;
  };

  template <class Real>
  void take_panels(const std::vector<Real>& panels);
  void part_fronts(std::span<const int> parents);
  void forward(const Front& front, float* x, float* beyond, Work& work) const;
  void back(const Front& front, float* x, const float* beyond, Work& work) const;

  std::vector<int> order_;  // node at each position
  std::vector<Front> fronts_;
  std::vector<Part> parts_;
  std::vector<std::size_t> top_;  // fronts above all parts, children first
  /// Of each unknown of a border: itself, or, beyond a part, -1 - its number there.
  std::vector<std::ptrdiff_t> targets_;
  /// Of L below the diagonal: of each front its own square, then its border, both by columns.
  std::vector<std::int16_t> numbers_;
  std::vector<float> units_;    // of the numbers of each column
  std::vector<float> inverse_;  // of each column's diagonal
};

}  // namespace viscera
