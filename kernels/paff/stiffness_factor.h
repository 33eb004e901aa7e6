// A factored stiffness: in single precision where that is enough, solving in double all the same.
#pragma once

#include <span>
#include <variant>
#include <vector>

#include "kernels/base/progress.h"
#include "kernels/paff/elasticity.h"
#include "kernels/paff/frontal_cholesky.h"

namespace viscera {

/// The precision of a factor. `measured`: single, unless a test solve with it is wrong by more than
/// 1e-5 of the answer or a pivot isn't positive in it (bodies near incompressible, or hardly held);
/// then double.
enum class FactorPrecision { kMeasured, kSingle, kFull };

class StiffnessFactor {
 public:
  /// K with blocks of 3, and where its nodes are. Fails on a matrix that is singular or not
  /// positive definite.
  static Result<StiffnessFactor> factor(const SymmetricBlockMatrix& stiffness,
                                        std::span<const Vec3> positions,
                                        FactorPrecision precision = FactorPrecision::kMeasured);

  /// K x = b in place, column-major (3 N x columns), to double precision: conjugate gradients
  /// preconditioned by the factor, with the residual of `stiffness`, the matrix factored.
  Result<void> solve(const SymmetricBlockMatrix& stiffness, std::span<double> right_hand_sides,
                     int columns) const;

  /// As ElasticSolver::compliance promises; exactly symmetric. Blocks of columns run side by side;
  /// a block skips the parts of the body where its loads have no effect yet, and those where
  /// nothing of it is to be stored. In single precision its error is 1e-6 to 1e-4 of the largest
  /// entry.
  Result<SurfaceCompliance> compliance(const SparseWeights& places, std::vector<int> touchable,
                                       const Progress& progress) const;

  bool is_single() const { return std::holds_alternative<FrontalCholesky<float>>(factor_); }
  std::size_t factor_bytes() const;

 private:
  using Factor = std::variant<FrontalCholesky<float>, FrontalCholesky<double>>;
  explicit StiffnessFactor(Factor factor) : factor_(std::move(factor)) {}

  Factor factor_;
};

}  // namespace viscera
