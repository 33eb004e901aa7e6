#include "kernels/paff/consistent_gradients.h"

#include <algorithm>
#include <cmath>

#include "kernels/base/parallel.h"
#include "kernels/paff/moment_matrix.h"
#include "kernels/paff/sparse_cholesky.h"

namespace viscera {
namespace {

// Volume points y_q with weights w_q, surface points with weights w_b and normals n_b, nodes x_I.
// p_Iq = (1, (x_I − y_q)/s_q), s_q a length, W_Iq the weight of node I at y_q, M_q = Σ_I W p pᵀ.
//
// Why. A stress that is constant must balance its own tractions: Σ_q w_q ∇φ_I = Σ_b w_b φ_I n_b,
// the integration constraint of [Chen2013]. The gradients g_Iq of rational fields miss it by
//   r_I = Σ_b w_b φ_I n_b − Σ_q w_q g_Iq.                                                       (1)
// With trial gradients that still give linear fields exactly, Σ_I g_Iq p_Iqᵀ = (0, identity/s_q), K
// then maps every linear field to its own loads: the patch test holds to round-off.
//
// Derivation. The change c_Iq of least Σ_q w_q Σ_I |c_Iq|² / W_Iq with Σ_q w_q c_Iq = r_I for each
// I and Σ_I c_Iq p_Iqᵀ = 0 for each q: with multipliers ξ_I and Λ_q it is c = W (ξ_I − Λ_q p_Iq),
// and the second condition gives Λ_q M_q = Σ_J W_Jq ξ_J p_Jqᵀ, so that
//   c_Iq = W_Iq (ξ_I − p_Iqᵀ M_q⁻¹ Σ_J W_Jq p_Jq ξ_J),                                          (2)
// the part of ξ that no linear field carries. The first condition is then S ξ = r, one N × N matrix
// for the three components,
//   S_IJ = Σ_q w_q (W_Iq δ_IJ − W_Iq p_Iqᵀ M_q⁻¹ p_Jq W_Jq).                                    (3)
//
// S is symmetric and positive semidefinite: ξᵀ S ξ sums the weighted squared distances of ξ from
// the linear fields at each point. So its kernel is the linear polynomials of x_I, on any body
// whose fields overlap. r is orthogonal to them: Σ_I r_I = Σ_b w_b n_b vanishes because the surface
// is closed, and Σ_I x_I r_Iᵀ = Σ_b w_b y_b n_bᵀ − Σ_q w_q identity vanishes because the cut cells
// measure the volume that the surface points enclose.
//
// With M = L Lᵀ and v_I = W_I L⁻¹ p_I, (2) reads W_I ξ_I − v_Iᵀ Σ_J v_J ξ_J, and in (3) the bracket
// is W_Iq δ_IJ − v_Iqᵀ v_Jq.

constexpr std::size_t kChunk = 512;

/// v of every entry                                                               (entries).
std::vector<Vec4> reduced_basis(const ShapeFunctions& shape, const VolumeQuadrature& volume,
                                const PointFields& fields) {
  std::vector<Vec4> reduced(fields.nodes.size());
  parallel_for_each_index(volume.size(), kChunk, [&](std::size_t q) {
    const std::size_t first = fields.begin[q], last = fields.begin[q + 1];
    const double scale = shape.support_radius(fields.nodes[first]);
    const auto offset = [&](std::size_t e) -> Vec3 {
      const Vec3& node = shape.cloud().positions[static_cast<std::size_t>(fields.nodes[e])];
      return (node - volume.positions[q]) / scale;
    };
    MomentMatrix moments;
    for (std::size_t e = first; e < last; ++e) moments.add(fields.weights[e], offset(e));
    moments.factor();  // the shape functions there were found regular already
    for (std::size_t e = first; e < last; ++e) {
      const Vec3 d = offset(e);
      reduced[e] = fields.weights[e] * moments.forward(Vec4(1.0, d.x(), d.y(), d.z()));
    }
  });
  return reduced;
}

/// S of (3).
SymmetricBlockMatrix consistency_matrix(const VolumeQuadrature& volume, const PointFields& fields,
                                        const NodeIncidence& incidence,
                                        const std::vector<Vec4>& reduced, std::size_t node_count) {
  SymmetricBlockMatrix matrix;
  matrix.pattern = symmetric_pattern(node_count, {{fields, incidence}});
  matrix.blocks.assign(matrix.pattern.columns.size(), 0.0);
  for_each_row(matrix.pattern, [&](std::size_t row, std::span<const std::size_t> slot) {
    double* values = matrix.blocks.data();
    for (const NodeIncidence::Entry& at : incidence.of(row)) {
      const std::size_t q = static_cast<std::size_t>(at.point);
      const Vec4 own = volume.weights[q] * reduced[at.entry];
      values[slot[row]] += volume.weights[q] * fields.weights[at.entry];
      for (std::size_t e = at.entry; e < fields.begin[q + 1]; ++e) {
        values[slot[static_cast<std::size_t>(fields.nodes[e])]] -= own.dot(reduced[e]);
      }
    }
  });
  return matrix;
}

/// r of (1) as three columns of N numbers.
std::vector<double> constraint_defect(const VolumeQuadrature& volume, const PointFields& fields,
                                      const NodeIncidence& incidence,
                                      const SurfaceQuadrature& surface,
                                      const PointFields& surface_fields, std::size_t node_count) {
  const NodeIncidence on_surface(surface_fields, node_count);
  std::vector<double> defect(3 * node_count);
  parallel_for_each_index(node_count, 64, [&](std::size_t node) {
    Vec3 sum = Vec3::Zero();
    for (const NodeIncidence::Entry& at : on_surface.of(node)) {
      const std::size_t b = static_cast<std::size_t>(at.point);
      sum += surface.weights[b] * surface_fields.values[at.entry] * surface.normals[b];
    }
    for (const NodeIncidence::Entry& at : incidence.of(node)) {
      sum -= volume.weights[static_cast<std::size_t>(at.point)] * fields.gradients[at.entry];
    }
    for (std::size_t k = 0; k < 3; ++k) defect[k * node_count + node] = sum[static_cast<int>(k)];
  });
  return defect;
}

/// S ξ = r. S is singular and r orthogonal to its kernel, so a slightly shifted factor, refined
/// with S itself, finds a solution; what it holds of the kernel drops out of (2).
Result<std::vector<double>> solve_consistency(const SymmetricBlockMatrix& matrix,
                                              const std::vector<double>& defect) {
  const std::size_t n = matrix.pattern.rows();
  double largest = 0.0;
  for (std::size_t row = 0; row < n; ++row) {
    largest = std::max(largest, matrix.blocks[matrix.pattern.row_begin[row]]);
  }
  Result<SparseCholesky> factor =
      SparseCholesky::factor(matrix, 1e-9 * largest, "consistent integration");
  if (!factor) return std::unexpected(factor.error());

  std::vector<double> solution(3 * n, 0.0), residual(defect), product(n);
  constexpr int kRefinements = 4;
  for (int step = 0; step <= kRefinements; ++step) {
    if (const Result<void> solved = factor->solve(residual, 3); !solved) {
      return std::unexpected(solved.error());
    }
    for (std::size_t i = 0; i < solution.size(); ++i) solution[i] += residual[i];
    if (step == kRefinements) break;
    for (std::size_t k = 0; k < 3; ++k) {
      matrix.multiply(std::span(solution).subspan(k * n, n), product);
      for (std::size_t i = 0; i < n; ++i) residual[k * n + i] = defect[k * n + i] - product[i];
    }
  }
  return solution;
}

}  // namespace

Result<double> make_gradients_consistent(const ShapeFunctions& shape,
                                         const VolumeQuadrature& volume,
                                         const NodeIncidence& volume_incidence,
                                         const SurfaceQuadrature& surface,
                                         const PointFields& surface_fields,
                                         PointFields& volume_fields) {
  const std::size_t n = shape.cloud().size();
  const std::vector<Vec4> reduced = reduced_basis(shape, volume, volume_fields);
  Result<std::vector<double>> solved = solve_consistency(
      consistency_matrix(volume, volume_fields, volume_incidence, reduced, n),
      constraint_defect(volume, volume_fields, volume_incidence, surface, surface_fields, n));
  if (!solved) return std::unexpected(solved.error());
  const std::vector<double>& solution = *solved;

  const auto multiplier = [&](std::size_t e) {
    const std::size_t node = static_cast<std::size_t>(volume_fields.nodes[e]);
    return Vec3(solution[node], solution[n + node], solution[2 * n + node]);
  };
  using Sizes = Eigen::Array2d;  // of the change and of the gradients, squared and integrated
  const Sizes sizes = parallel_sum<Sizes>(
      volume.size(), kChunk, Sizes::Zero(), [&](std::size_t first, std::size_t last) -> Sizes {
        Sizes sum = Sizes::Zero();
        for (std::size_t q = first; q < last; ++q) {
          const std::size_t begin = volume_fields.begin[q], end = volume_fields.begin[q + 1];
          Eigen::Matrix<double, 3, 4> linear_part = Eigen::Matrix<double, 3, 4>::Zero();
          for (std::size_t e = begin; e < end; ++e) {
            linear_part += multiplier(e) * reduced[e].transpose();
          }
          for (std::size_t e = begin; e < end; ++e) {
            Vec3& gradient = volume_fields.gradients[e];
            const Vec3 change = volume_fields.weights[e] * multiplier(e) - linear_part * reduced[e];
            sum += volume.weights[q] * Sizes(change.squaredNorm(), gradient.squaredNorm());
            gradient += change;
          }
        }
        return sum;
      });
  return std::sqrt(sizes[0] / sizes[1]);
}

}  // namespace viscera
