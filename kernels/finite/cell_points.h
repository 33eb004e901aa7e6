// What every loop over a cell's points reads: packs of four, their nodes and gradients.
#pragma once

#include "kernels/finite/finite_body.h"
#include "kernels/finite/point_lanes.h"

namespace viscera {

struct FiniteBody::CellPoints {
  std::size_t packs;
  const std::size_t* begin;  // of the packs, one more than these
  const std::uint16_t* nodes;
  const std::array<float, 3 * kLanes>* gradients;
  const Lane* weights;
  const std::array<Lane, 4>* psi;      // null: nothing is averaged
  const FibrePack* fibres;             // null: there are none
  const ChangedTissue::Pack* changed;  // null: nothing has changed
  double mu, lambda, averaged;

  /// F of a pack's points.
  VISCERA_INLINE void deform(std::size_t pack, const double* displacements,
                             point_lanes::Lanes* f) const {
    using point_lanes::Lanes;
    const Lanes zero = {}, one = zero + 1.0;
    for (std::size_t i = 0; i < 9; ++i) f[i] = i % 4 == 0 ? one : zero;
    for (std::size_t e = begin[pack]; e < begin[pack + 1]; ++e) {
      Lanes g[3];
      __builtin_prefetch(gradients + e + point_lanes::kEntriesAhead);
      for (std::size_t k = 0; k < 3; ++k) point_lanes::load(gradients[e].data() + kLanes * k, g[k]);
      const double* u = displacements + 3 * static_cast<std::size_t>(nodes[e]);
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t k = 0; k < 3; ++k) f[3 * i + k] += u[i] * g[k];
    }
  }
};

}  // namespace viscera
