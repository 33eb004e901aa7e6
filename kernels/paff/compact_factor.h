// A factor as a preconditioner that is asked thousands of times a second: what it takes is to read
// it, so it is kept in sixteen bits, in a form that several threads read at once.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/paff/stiffness_factor.h"

namespace viscera {

/// K ~ L D L^T with ones on L's diagonal. Of each front with the columns [L; B], B being those of
/// its border, stands M = [L^-1; -B L^-1]: a solve multiplies by it on the way up and by its
/// transpose on the way down, and each product is as many threads' as it has rows. Columns are
/// whole numbers of a 32,767th of their greatest entry. Immutable; from many threads at once.
class CompactFactor {
 public:
  explicit CompactFactor(const PackedFactor& factor);

  /// x ~ K^-1 b, symmetric and positive, for columns one after another: each has the bits that it
  /// has alone. The same bits for any number of threads.                           (3 N x columns)
  void apply(std::span<const double> b, std::span<double> x, std::size_t columns = 1) const;

  std::size_t nodes() const { return order_.size(); }
  std::size_t memory_bytes() const;

 private:
  struct Front {
    std::size_t first = 0, own = 0, border = 0;  // of unknowns
    std::size_t targets = 0;                     // of its border
    std::size_t tiles = 0, last_tile = 0;
    bool wide = false;  // several threads share it
  };
  /// Rows of M; of those of its own square, the columns that end in them. Padded.
  struct Tile {
    std::size_t first = 0, rows = 0, columns = 0, numbers = 0;
  };
  /// A subtree, which one thread reads; what it adds to unknowns after its own is kept apart.
  struct Part {
    std::vector<std::size_t> fronts;  // children first
    std::vector<std::size_t> beyond;  // those unknowns
  };
  /// Columns that are solved for together, in the factor's order.
  struct Block {
    std::vector<float> numbers;
    std::size_t rows = 0, columns = 0;
    float* column(std::size_t c) { return numbers.data() + c * rows; }
  };
  struct Work {
    std::vector<float> in, out;
  };

  template <class Real>
  void take_panels(const std::vector<Real>& panels);
  void take_front(Front& front, const MatrixX& m);
  void part_fronts(std::span<const int> parents);
  template <class Body>
  void each_tile(const Front& front, const Body& body) const;
  void up(const Front& front, Block& block, float* beyond, Work& work) const;
  void down(const Front& front, Block& block, const float* beyond, Work& work) const;

  std::vector<int> order_;  // node at each position
  std::vector<Front> fronts_;
  std::vector<Tile> tiles_;
  std::vector<Part> parts_;
  std::vector<std::size_t> top_;  // fronts above all parts, children first
  /// Of each unknown of a border: itself, or, beyond a part, -1 - its number there.
  std::vector<std::ptrdiff_t> targets_;
  std::vector<std::int16_t> numbers_;  // tile after tile
  std::vector<float> units_;           // of the numbers of each column
  std::vector<float> inverse_;         // of D
};

}  // namespace viscera
