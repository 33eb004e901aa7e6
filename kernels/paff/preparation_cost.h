// What preparing a body will take, from its nodes alone: the equations are eliminated on paper.
#pragma once

#include <cstddef>

#include "kernels/paff/dissection.h"
#include "kernels/paff/elasticity.h"

namespace viscera {

struct PreparationCost {
  std::size_t stiffness_blocks = 0;   ///< of 3 x 3, the upper triangle with its diagonal
  std::size_t factor_entries = 0;     ///< numbers
  std::size_t assembling_bytes = 0;   ///< peak of quadrature, fields and stiffness
  std::size_t factoring_bytes = 0;    ///< peak of that, factor and fronts, in single precision
  double factoring_operations = 0.0;  ///< multiplications and additions
};

/// Takes little more than ordering the nodes. Counts are within 15 % of what preparation makes
/// (tested).
PreparationCost preparation_cost(const PointCloud& cloud, const Coupling& coupling);

/// What two levels in its place will take (two_levels.h), beside what goes with the nodes.
struct LevelsCost {
  std::size_t coarse_nodes = 0;
  PreparationCost coarse;             ///< of the coarse nodes' equations
  std::size_t consistency_bytes = 0;  ///< of the factor that makes gradients consistent
  double consistency_operations = 0.0;
};
LevelsCost levels_cost(const PointCloud& cloud, const Coupling& coupling);

/// Peak while a matrix of blocks of 3 is eliminated in that order with numbers of `real_bytes` on
/// `threads` threads: the factor and the fronts that wait for their parents, without the matrix.
std::size_t elimination_bytes(const Dissection& dissection, std::size_t real_bytes, int threads);

}  // namespace viscera
