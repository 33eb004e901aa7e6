// A body at finite strain as one flat piece, for who evaluates it elsewhere: FiniteBody's packs of
// four points, cell by cell, with the body's own numbers of nodes.
#pragma once

#include <cstdint>
#include <vector>

namespace viscera {

struct FiniteLayout {
  std::size_t nodes = 0;
  std::vector<std::uint32_t> cell_begin{0};  ///< packs of each cell                       (C + 1)
  /// The node over which a cell's displacements are taken, so that gradients in single precision
  /// act on what is small.                                                                     (C)
  std::vector<std::uint32_t> cell_origin;
  std::vector<std::uint32_t> pack_begin{0};  ///< entries of each pack                 (packs + 1)
  std::vector<std::uint32_t> entry_nodes;
  std::vector<float> gradients;  ///< of four points along x, y, z [1/m]             (12 x entries)
  std::vector<double> weights;   ///< volumes times relative modulus [m3]               (4 x packs)
  /// Polynomials of the cells [m^-1.5], four of each point in turn; empty: nothing is averaged.
  std::vector<double> psi;                        //                            (16 x packs)
  double mu = 0.0, lambda = 0.0, averaged = 0.0;  ///< [Pa]
  bool fibres = false;                            ///< it has some, which aren't in here
  bool was_loaded = false;                        ///< in the image, which isn't in here either
};

}  // namespace viscera
