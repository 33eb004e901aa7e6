#include "kernels/paff/consistent_gradients.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "kernels/base/parallel.h"
#include "kernels/paff/moment_matrix.h"
#include "kernels/paff/sparse_cholesky.h"

namespace viscera {
namespace {

// Volume points y_q with weights w_q, surface points with weights w_b and normals n_b, nodes x_I.
// p_Iq is the basis at (x_I − y_q)/s_q, s_q a length; W_Iq the weight of node I at y_q,
// M_q = Σ_I W p pᵀ. The stresses that must balance their own tractions are the polynomials m of one
// degree less than the basis: constant for the linear basis, and 1, x, y, z for the quadratic; of
// node I they are m_I(y) = (1, (y − x_I)/r_I), r_I its support radius.
//
// Why. Such a stress must balance its tractions and body forces by the points at hand:
// Σ_q w_q (m_I ∇φ_I + φ_I ∇m_I) = Σ_b w_b m_I φ_I n_b, the integration constraint of [Chen2013].
// The gradients g_Iq of rational fields miss it by
//   r_I = Σ_b w_b m_I φ_I n_bᵀ − Σ_q w_q (m_I g_Iqᵀ + φ_I ∇m_I).                                (1)
// With trial gradients that still give the basis' polynomials exactly, Σ_I c_Iq p_Iqᵀ = 0 for the
// changes c, K then maps each of them to its own loads: the patch test holds to round-off.
//
// Derivation. The change c_Iq of least Σ_q w_q Σ_I |c_Iq|² / W_Iq with Σ_q w_q m_I c_Iqᵀ = r_I for
// each I and Σ_I c_Iq p_Iqᵀ = 0 for each q: with multipliers ξ_I (a row a polynomial of m, a column
// a component) and Λ_q it is c = W (ζ_I − Λ_q p_Iq), ζ_Iq = ξ_Iᵀ m_I(y_q), and the second condition
// gives Λ_q M_q = Σ_J W_Jq ζ_Jq p_Jqᵀ, so that
//   c_Iq = W_Iq (ζ_Iq − p_Iqᵀ M_q⁻¹ Σ_J W_Jq p_Jq ζ_Jq),                                        (2)
// the part of ζ that no polynomial of the basis carries. The first condition is then S ξ = r, one
// matrix for the three components, with blocks
//   S_IJ = Σ_q w_q m_I(y_q) m_J(y_q)ᵀ (W_Iq δ_IJ − W_Iq p_Iqᵀ M_q⁻¹ p_Jq W_Jq).                 (3)
//
// S is symmetric and positive semidefinite: ξᵀ S ξ sums the weighted squared distances of ζ from
// the basis at each point. So its kernel holds the ξ for which ζ_Iq is a polynomial of the basis in
// x_I, whatever the point: products of one in x_I and one of m in y. r is orthogonal to them where
// the points satisfy the divergence theorem for those products: the surface points must integrate
// degree 2 (linear basis: 1) and the volume points degree 1 (0), or 3 and 2 with the quadratic
// basis; and the cut cells measure the volume that the surface points enclose.
//
// With M = L Lᵀ and v_I = W_I L⁻¹ p_I, (2) reads W_I ζ_I − v_Iᵀ Σ_J v_J ζ_J, and in (3) the bracket
// is W_Iq δ_IJ − v_Iqᵀ v_Jq.

constexpr std::size_t kChunk = 512;

/// What the passes below share; kTerms polynomials of the basis, kStresses of m.
template <int kTerms, int kStresses>
class ConsistencyProblem {
 public:
  using Stresses = Eigen::Matrix<double, kStresses, 1>;
  using Multiplier = Eigen::Matrix<double, kStresses, 3>;

  ConsistencyProblem(const ShapeFunctions& shape, const VolumeQuadrature& volume,
                     const NodeIncidence& incidence, PointFields& fields)
      : shape_(shape), volume_(volume), incidence_(incidence), fields_(fields) {
    reduce_basis();
  }

  /// S of (3).
  SymmetricBlockMatrix matrix() const {
    SymmetricBlockMatrix matrix;
    matrix.width = kStresses;
    matrix.pattern = symmetric_pattern(node_count(), {{fields_, incidence_}});
    matrix.blocks.assign(matrix.pattern.columns.size() * kStresses * kStresses, 0.0);
    using Block = Eigen::Matrix<double, kStresses, kStresses>;
    const auto block = [&](std::size_t e) {
      return Eigen::Map<Block>(matrix.blocks.data() + kStresses * kStresses * e);
    };
    for_each_row(matrix.pattern, [&](std::size_t row, std::span<const std::size_t> slot) {
      for (const NodeIncidence::Entry& at : incidence_.of(row)) {
        const std::size_t q = static_cast<std::size_t>(at.point);
        const BasisVector<kTerms>& own = reduced_[at.entry];
        const Stresses own_stresses = volume_.weights[q] * stresses(row, volume_.positions[q]);
        block(slot[row]) += fields_.weights[at.entry] * stresses(row, volume_.positions[q]) *
                            own_stresses.transpose();
        for (std::size_t e = at.entry; e < fields_.begin[q + 1]; ++e) {
          const std::size_t column = static_cast<std::size_t>(fields_.nodes[e]);
          // Stored row by row, built as the transpose.
          block(slot[column]).noalias() -=
              (own.dot(reduced_[e]) * stresses(column, volume_.positions[q])) *
              own_stresses.transpose();
        }
      }
    });
    return matrix;
  }

  /// The diagonal of S without what (3) subtracts (kStresses N): what its entries are known
  /// relative to, since both terms may nearly cancel.
  std::vector<double> scale() const {
    std::vector<double> scale(kStresses * node_count(), 0.0);
    parallel_for_each_index(node_count(), 64, [&](std::size_t node) {
      Stresses sum = Stresses::Zero();
      for (const NodeIncidence::Entry& at : incidence_.of(node)) {
        const std::size_t q = static_cast<std::size_t>(at.point);
        sum += volume_.weights[q] * fields_.weights[at.entry] *
               stresses(node, volume_.positions[q]).cwiseAbs2();
      }
      Stresses::Map(scale.data() + kStresses * node) = sum;
    });
    return scale;
  }

  /// r of (1) as three columns of kStresses N numbers; `sizes` becomes the sums of the absolute
  /// values of what r is the difference of, alike.
  std::vector<double> defect(const SurfaceQuadrature& surface, const PointFields& surface_fields,
                             std::vector<double>& sizes) const {
    const NodeIncidence on_surface(surface_fields, node_count());
    const std::size_t rows = kStresses * node_count();
    std::vector<double> defect(3 * rows);
    sizes.assign(3 * rows, 0.0);
    parallel_for_each_index(node_count(), 64, [&](std::size_t node) {
      Multiplier sum = Multiplier::Zero(), size = Multiplier::Zero();
      const auto add = [&](const Multiplier& term) {
        sum += term;
        size += term.cwiseAbs();
      };
      for (const NodeIncidence::Entry& at : on_surface.of(node)) {
        const std::size_t b = static_cast<std::size_t>(at.point);
        add((surface.weights[b] * surface_fields.values[at.entry]) *
            stresses(node, surface.positions[b]) * surface.normals[b].transpose());
      }
      for (const NodeIncidence::Entry& at : incidence_.of(node)) {
        const std::size_t q = static_cast<std::size_t>(at.point);
        add(-stresses(node, volume_.positions[q]) *
            (volume_.weights[q] * fields_.gradients[at.entry]).transpose());
        if constexpr (kStresses == 4) {
          const double slope = 1.0 / shape_.support_radius(static_cast<int>(node));
          sum.template bottomRows<3>().diagonal().array() -=
              volume_.weights[q] * fields_.values[at.entry] * slope;
        }
      }
      for (int k = 0; k < 3; ++k) {
        for (int m = 0; m < kStresses; ++m) {
          const std::size_t at =
              static_cast<std::size_t>(k) * rows + kStresses * node + static_cast<std::size_t>(m);
          defect[at] = sum(m, k);
          sizes[at] = size(m, k);
        }
      }
    });
    return defect;
  }

  /// Adds the changes (2) of the multipliers to the gradients; returns their relative size.
  double correct(const std::vector<double>& multipliers) {
    using Sizes = Eigen::Array2d;  // of the change and of the gradients, squared and integrated
    const Sizes sizes = parallel_sum<Sizes>(
        volume_.size(), kChunk, Sizes::Zero(), [&](std::size_t first, std::size_t last) -> Sizes {
          Sizes sum = Sizes::Zero();
          std::vector<Vec3> zeta;
          for (std::size_t q = first; q < last; ++q) {
            const std::size_t begin = fields_.begin[q], end = fields_.begin[q + 1];
            Eigen::Matrix<double, 3, kTerms> carried = Eigen::Matrix<double, 3, kTerms>::Zero();
            zeta.clear();
            for (std::size_t e = begin; e < end; ++e) {
              zeta.push_back(multiplier_at(fields_.nodes[e], volume_.positions[q], multipliers));
              carried += zeta.back() * reduced_[e].transpose();
            }
            for (std::size_t e = begin; e < end; ++e) {
              Vec3& gradient = fields_.gradients[e];
              const Vec3 change = fields_.weights[e] * zeta[e - begin] - carried * reduced_[e];
              sum += volume_.weights[q] * Sizes(change.squaredNorm(), gradient.squaredNorm());
              gradient += change;
            }
          }
          return sum;
        });
    return std::sqrt(sizes[0] / sizes[1]);
  }

 private:
  std::size_t node_count() const { return shape_.cloud().size(); }

  /// m_I(y).
  Stresses stresses(std::size_t node, const Vec3& y) const {
    Stresses m;
    m[0] = 1.0;
    if constexpr (kStresses == 4) {
      m.template tail<3>() =
          (y - shape_.cloud().positions[node]) / shape_.support_radius(static_cast<int>(node));
    }
    return m;
  }

  /// zeta_I(y) = xi_I^T m_I(y).
  Vec3 multiplier_at(int node, const Vec3& y, const std::vector<double>& multipliers) const {
    const std::size_t i = static_cast<std::size_t>(node), rows = kStresses * node_count();
    const Stresses m = stresses(i, y);
    Vec3 zeta;
    for (int k = 0; k < 3; ++k) {
      const double* xi = multipliers.data() + static_cast<std::size_t>(k) * rows + kStresses * i;
      zeta[k] = m.dot(Eigen::Map<const Stresses>(xi));
    }
    return zeta;
  }

  /// v of every entry.
  void reduce_basis() {
    reduced_.resize(fields_.nodes.size());
    parallel_for_each_index(volume_.size(), kChunk, [&](std::size_t q) {
      const std::size_t first = fields_.begin[q], last = fields_.begin[q + 1];
      const double scale = shape_.support_radius(fields_.nodes[first]);
      MomentMatrix<kTerms> moments;
      for (std::size_t e = first; e < last; ++e) {
        const Vec3& node = shape_.cloud().positions[static_cast<std::size_t>(fields_.nodes[e])];
        reduced_[e] = basis_at<kTerms>((node - volume_.positions[q]) / scale);
        moments.add(fields_.weights[e], reduced_[e]);
      }
      moments.factor();  // the shape functions there were found regular already
      for (std::size_t e = first; e < last; ++e) reduced_[e] = moments.forward(reduced_[e]);
      // Sum W (L^-1 p)(L^-1 p)^T is the identity but for round-off times the condition of M: once
      // more with that sum, it is the identity to round-off.
      if (moments.loses_digits()) {
        MomentMatrix<kTerms> again;
        for (std::size_t e = first; e < last; ++e) again.add(fields_.weights[e], reduced_[e]);
        again.factor();
        for (std::size_t e = first; e < last; ++e) reduced_[e] = again.forward(reduced_[e]);
      }
      for (std::size_t e = first; e < last; ++e) reduced_[e] *= fields_.weights[e];
    });
  }

  const ShapeFunctions& shape_;
  const VolumeQuadrature& volume_;
  const NodeIncidence& incidence_;
  PointFields& fields_;
  std::vector<BasisVector<kTerms>> reduced_;  ///< v                               (entries)
};

/// D S D for a diagonal D.
void scale_both_sides(SymmetricBlockMatrix& matrix, std::span<const double> scales) {
  const std::size_t width = static_cast<std::size_t>(matrix.width), block = width * width;
  const SymmetricPattern& pattern = matrix.pattern;
  for (std::size_t row = 0; row < pattern.rows(); ++row) {
    for (std::size_t e = pattern.row_begin[row]; e < pattern.row_begin[row + 1]; ++e) {
      const std::size_t column = static_cast<std::size_t>(pattern.columns[e]);
      for (std::size_t k = 0; k < block; ++k)
        matrix.blocks[e * block + k] *=
            scales[row * width + k / width] * scales[column * width + k % width];
    }
  }
}

/// S ξ = r on D S D, D² = 1 / `scale`: nodes of any spacing count alike, and entries are known to
/// round-off of one. S is singular (each connected piece of the body has its kernel) and nearly so
/// where few nodes reach, so a factor of D S D + 1e-11 I is refined with S itself. An error of
/// eigenvalue λ falls by 1 + λ / 1e-11 each time; what meets no λ above 1e-11 is the kernel, which
/// r is orthogonal to, and what the solution holds of it drops out of (2).
///
/// It is refined as long as the residual falls; the rest is round-off of r's own sums, `sizes`, and
/// of the divergence theorem of the quadratures. Where that is more than 1e-11 of the sums the body
/// is refused: K would lose such a share of a constant stress's loads.
Result<std::vector<double>> solve_consistency(SymmetricBlockMatrix matrix,
                                              const std::vector<double>& scale,
                                              const std::vector<double>& defect,
                                              const std::vector<double>& sizes) {
  constexpr double kRoundOff = 0x1.0p-53, kMost = 1e-11;
  constexpr int kMostRounds = 20;
  const std::size_t n = scale.size();
  std::vector<double> scales(n, 0.0);  // D
  for (std::size_t i = 0; i < n; ++i)
    if (scale[i] > 0.0) scales[i] = 1.0 / std::sqrt(scale[i]);
  scale_both_sides(matrix, scales);
  Result<SparseCholesky> factor = SparseCholesky::factor(matrix, 1e-11, "consistent integration");
  if (!factor) return std::unexpected(factor.error());

  double whole = 0.0;
  for (std::size_t i = 0; i < 3 * n; ++i) whole += std::pow(scales[i % n] * sizes[i], 2);
  whole = std::sqrt(whole);
  std::vector<double> solution(3 * n, 0.0), trial(3 * n, 0.0), residual(3 * n), product(n);
  double left = std::numeric_limits<double>::infinity();
  for (int round = 0; round <= kMostRounds; ++round) {
    for (std::size_t k = 0; k < 3; ++k) {
      matrix.multiply(std::span(trial).subspan(k * n, n), product);
      for (std::size_t i = 0; i < n; ++i)
        residual[k * n + i] = scales[i] * defect[k * n + i] - product[i];
    }
    double now = 0.0;
    for (const double r : residual) now += r * r;
    now = std::sqrt(now);
    if (!(now < left)) break;
    const bool enough = now > 0.5 * left || now <= kRoundOff * whole;
    left = now;
    solution = trial;
    if (enough) break;
    if (const Result<void> solved = factor->solve(residual, 3); !solved) {
      return std::unexpected(solved.error());
    }
    for (std::size_t i = 0; i < 3 * n; ++i) trial[i] += residual[i];
  }
  if (!(left <= kMost * whole)) {
    std::ostringstream text;
    text << "consistent integration: the quadratures of volume and surface disagree by "
         << left / whole << " of what they sum; expected 1e-11 at most: remove nodes that crowd at "
         << "one place, or use another node spacing";
    return failure(text.str());
  }
  for (std::size_t i = 0; i < 3 * n; ++i) solution[i] *= scales[i % n];
  return solution;
}

template <int kTerms, int kStresses>
Result<ConsistencyChange> make_consistent(const ShapeFunctions& shape,
                                          const VolumeQuadrature& volume,
                                          const NodeIncidence& incidence,
                                          const SurfaceQuadrature& surface,
                                          const PointFields& surface_fields, PointFields& fields) {
  ConsistencyProblem<kTerms, kStresses> problem(shape, volume, incidence, fields);
  std::vector<double> sizes;
  const std::vector<double> defect = problem.defect(surface, surface_fields, sizes);
  Result<std::vector<double>> multipliers =
      solve_consistency(problem.matrix(), problem.scale(), defect, sizes);
  if (!multipliers) return std::unexpected(multipliers.error());
  // Where few nodes reach, a constraint may be met by changes only that are larger than the
  // gradients themselves. What is left are no fields' gradients, and K is close to singular.
  const double size = problem.correct(*multipliers);
  if (!(size < 1.0)) {
    std::ostringstream text;
    text << "consistent integration: the gradients had to change by " << size
         << " of themselves; expected less than 1 (0.05 is usual): remove nodes that crowd at one "
            "place, or use another node spacing";
    return failure(text.str());
  }
  return ConsistencyChange{size, std::move(*multipliers)};
}

template <int kTerms, int kStresses>
void correct(const ShapeFunctions& shape, const VolumeQuadrature& some,
             const std::vector<double>& multipliers, PointFields& fields) {
  const NodeIncidence incidence(fields, shape.cloud().size());
  ConsistencyProblem<kTerms, kStresses>(shape, some, incidence, fields).correct(multipliers);
}

}  // namespace

Result<ConsistencyChange> make_gradients_consistent(const ShapeFunctions& shape,
                                                    const VolumeQuadrature& volume,
                                                    const NodeIncidence& volume_incidence,
                                                    const SurfaceQuadrature& surface,
                                                    const PointFields& surface_fields,
                                                    PointFields& volume_fields) {
  const auto& make = shape.basis() == Basis::kLinear ? make_consistent<kLinearTerms, 1>
                                                     : make_consistent<kQuadraticTerms, 4>;
  return make(shape, volume, volume_incidence, surface, surface_fields, volume_fields);
}

void correct_gradients(const ShapeFunctions& shape, const VolumeQuadrature& some,
                       const std::vector<double>& multipliers, PointFields& fields) {
  const auto& correct_with =
      shape.basis() == Basis::kLinear ? correct<kLinearTerms, 1> : correct<kQuadraticTerms, 4>;
  correct_with(shape, some, multipliers, fields);
}

}  // namespace viscera
