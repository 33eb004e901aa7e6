// A factored stiffness: in single precision where that is enough, solving in double all the same.
#pragma once

#include <limits>
#include <memory>
#include <span>
#include <variant>
#include <vector>

#include "kernels/base/progress.h"
#include "kernels/paff/columns_on_demand.h"
#include "kernels/paff/elasticity.h"
#include "kernels/paff/frontal_cholesky.h"

namespace viscera {

/// The precision of a factor. `measured`: single, unless test solves with it are wrong by more than
/// 1e-5 of the answer (7e-5 under an even pull) or a pivot isn't positive in it (bodies near
/// incompressible, or hardly held); then double.
enum class FactorPrecision { kMeasured, kSingle, kFull };

/// A factor as a file keeps it.
struct PackedFactor {
  static constexpr std::size_t kNumbersAFront = 4;
  std::vector<int> order;    ///< node at each position                                      (N)
  std::vector<int> fronts;   ///< first and last position, parent, size of border        (F x 4)
  std::vector<int> borders;  ///< positions, front after front
  // Panels, front after front; those of one precision alone.
  std::vector<float> single_panels;
  std::vector<double> full_panels;
};

class StiffnessFactor {
 public:
  /// K with blocks of 3, and where its nodes are. Fails on a matrix that is singular or not
  /// positive definite, and before it takes more than `most_memory` [bytes].
  static Result<StiffnessFactor> factor(
      const SymmetricBlockMatrix& stiffness, std::span<const Vec3> positions,
      FactorPrecision precision = FactorPrecision::kMeasured,
      std::size_t most_memory = std::numeric_limits<std::size_t>::max());

  /// K x = b in place, column-major (3 N x columns), to double precision: conjugate gradients
  /// preconditioned by the factor, with the residual of `stiffness`, the matrix factored.
  Result<void> solve(const SymmetricBlockMatrix& stiffness, std::span<double> right_hand_sides,
                     int columns) const;

  /// x ~ K^-1 b in the precision of the factor, once through it (3 N); compact_factor.h is faster.
  void apply(std::span<const double> b, std::span<double> x) const;
  /// The same of many right-hand sides in place, stored row by row (3 N x columns).
  void apply(std::span<float> block, int columns) const;

  /// As ElasticSolver::compliance promises; exactly symmetric. Blocks of columns run side by side;
  /// a block skips the parts of the body where its loads have no effect yet, and those where
  /// nothing of it is to be stored. In single precision its error is 1e-6 to 1e-4 of the largest
  /// entry.
  Result<SurfaceCompliance> compliance(const SparseWeights& places, std::vector<int> touchable,
                                       const Progress& progress) const;

  /// Columns of all these places among themselves, in blocks of 64 places that act near each other,
  /// which take that factor with them. A block skips no row: it is symmetric with others to single
  /// precision, not exactly.
  static std::shared_ptr<const ColumnSource> columns(std::shared_ptr<const StiffnessFactor> factor,
                                                     const SparseWeights& places);
  /// With rows for all places, and columns of those before `touchable` alone.
  static std::shared_ptr<const ColumnSource> columns(std::shared_ptr<const StiffnessFactor> factor,
                                                     const SparseWeights& places,
                                                     std::size_t touchable);

  PackedFactor pack() const;
  /// The same factor, to the last bit. Fails, in words that complete "rebuilt because", for what
  /// no factor can be.
  static Result<StiffnessFactor> unpack(const PackedFactor& packed);

  std::size_t nodes() const;
  bool is_single() const { return std::holds_alternative<FrontalCholesky<float>>(factor_); }
  std::size_t factor_bytes() const;

 private:
  using Factor = std::variant<FrontalCholesky<float>, FrontalCholesky<double>>;
  explicit StiffnessFactor(Factor factor) : factor_(std::move(factor)) {}

  Factor factor_;
};

}  // namespace viscera
