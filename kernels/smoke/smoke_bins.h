// Particles sorted into the cells of a dense grid over their bounding box, so that the neighbours
// of a particle lie in nine contiguous runs.
#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "kernels/smoke/smoke_particles.h"

namespace viscera {

class SmokeBins {
 public:
  /// Reorders the particles by cell (counting sort, stable); x is the fastest of the cells. Cells
  /// have the edge `support` [m], or more where the bounding box would need over four million.
  void sort(SmokeParticles& particles, float support);

  using Run = std::pair<std::uint32_t, std::uint32_t>;  ///< first and one past the last particle
  /// The particles of the 27 cells about a position: nine runs of three cells along x.
  std::array<Run, 9> runs(const Vec3f& position) const;

  std::size_t memory_bytes() const;

 private:
  Eigen::Vector3i cell_of(const Vec3f& position) const;

  Vec3f origin_ = Vec3f::Zero();
  Eigen::Vector3i size_ = Eigen::Vector3i::Zero();  // a margin of one empty cell all around
  float inverse_cell_ = 0.0f;
  std::vector<std::uint32_t> cell_begin_, particle_cell_, order_;
  SmokeParticles sorted_;
};

}  // namespace viscera
