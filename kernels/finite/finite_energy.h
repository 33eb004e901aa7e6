// What the GLSL twin of a body's energy at finite strain knows of it. A twin header
// (engine/gpu/twin_header.h).
#pragma once

#include <cstddef>
#include <cstdint>

namespace viscera {

inline constexpr std::size_t kCellGroup = 64;  ///< threads of a cell: a point each
inline constexpr std::size_t kNodeGroup = 32;  ///< threads that sum a node's force
inline constexpr std::size_t kRowsAtOnce = 4;  ///< of a dense inverse, in a work group

struct FiniteEnergyParameters {
  double mu = 0.0, lambda = 0.0, averaged = 0.0;  ///< [Pa]
  double viscous = 0.0;                           ///< time mu / dt [Pa]; 0: none
  std::uint32_t averages = 0;                     ///< cells average a part of the dilatation
  std::uint32_t changed = 0;                      ///< some tissue has stiffened or shrunk
  std::uint32_t unused_a = 0, unused_b = 0;
};

}  // namespace viscera
