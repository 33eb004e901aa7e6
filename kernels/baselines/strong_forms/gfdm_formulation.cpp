// The `gfdm` formulation: generalised finite differences [Liszka1980] [Benito2001], collocated.
#include <Eigen/QR>
#include <algorithm>
#include <sstream>

#include "kernels/baselines/strong_forms/collocation.h"
#include "kernels/paff/problem_checks.h"
#include "kernels/points/kd_tree.h"

namespace viscera {
namespace {

/// Fewer than 40 neighbours do on lattices, not on scattered nodes.
constexpr int kNeighbours = 40;
/// Where those don't determine a quadratic (nodes on two planes), more are asked.
constexpr int kMostNeighbours = 160;
/// Radius of the weight over the distance of the farthest neighbour.
constexpr double kRadiusFactor = 1.05;

/// The fit: u(x_i + d) - u_i = g . d + d^T H d / 2 for the neighbours j, each equation weighted by
/// the square root of W(|d_j| / r), least squares by QR. Its solution is linear in u_j - u_i, so
/// that u(x_i) = u_i exactly.
class TaylorFit {
 public:
  explicit TaylorFit(const PointCloud& cloud)
      : positions_(cloud.positions), tree_(std::make_shared<KdTree>(cloud.positions)) {}

  Result<void> operator()(int node, NodeStencil& out) const {
    const int others = static_cast<int>(positions_.size()) - 1;
    for (int k = std::min(kNeighbours, others);; k = std::min(2 * k, others)) {
      if (k >= 9 && fit(node, k, out)) return {};
      if (k >= std::min(kMostNeighbours, others)) break;
    }
    std::ostringstream text;
    text << "nodes: the neighbours of node " << node << " at ("
         << (positions_[static_cast<std::size_t>(node)] * 1e3).transpose()
         << ") mm determine no quadratic field; expected at least 9 others, not all on a plane or "
            "on two: use a smaller node spacing, or \"galerkin\"";
    return failure(text.str());
  }

 private:
  bool fit(int node, int neighbours, NodeStencil& out) const {
    const Vec3& x = positions_[static_cast<std::size_t>(node)];
    std::vector<KdTree::Found> found;
    tree_->nearest(x, neighbours, node, found);
    const double unit = std::sqrt(found.back().distance2);
    if (!(unit > 0.0)) return false;
    const auto rows = static_cast<Eigen::Index>(found.size());
    MatrixX taylor(rows, 9);
    VectorX weights(rows);
    for (Eigen::Index j = 0; j < rows; ++j) {
      const Vec3 d = (positions_[index(found, j)] - x) / unit;
      weights[j] = std::sqrt(quartic_weight(d.norm() / kRadiusFactor));
      taylor.row(j) << d.x(), d.y(), d.z(), 0.5 * d.x() * d.x(), 0.5 * d.y() * d.y(),
          0.5 * d.z() * d.z(), d.x() * d.y(), d.y() * d.z(), d.z() * d.x();
      taylor.row(j) *= weights[j];
    }
    Eigen::ColPivHouseholderQR<MatrixX> qr(taylor);
    qr.setThreshold(1e-6);
    if (qr.rank() < 9) return false;
    const MatrixX derivatives = qr.solve(MatrixX(weights.asDiagonal()));  // 9 x neighbours

    // Neighbours first, then the node itself, which takes what they add up to.
    out.resize(found.size() + 1);
    Vec3 gradient_sum = Vec3::Zero();
    Mat3 hessian_sum = Mat3::Zero();
    for (Eigen::Index j = 0; j < rows; ++j) {
      const auto at = static_cast<std::size_t>(j);
      const auto c = derivatives.col(j);
      out.nodes[at] = found[at].index;
      out.values[at] = 0.0;
      out.gradients[at] = c.head<3>() / unit;
      out.hessians[at] << c[3], c[6], c[8], c[6], c[4], c[7], c[8], c[7], c[5];
      out.hessians[at] /= unit * unit;
      gradient_sum += out.gradients[at];
      hessian_sum += out.hessians[at];
    }
    out.nodes.back() = node;
    out.values.back() = 1.0;
    out.gradients.back() = -gradient_sum;
    out.hessians.back() = -hessian_sum;
    return true;
  }

  static std::size_t index(const std::vector<KdTree::Found>& found, Eigen::Index j) {
    return static_cast<std::size_t>(found[static_cast<std::size_t>(j)].index);
  }

  std::span<const Vec3> positions_;
  std::shared_ptr<const KdTree> tree_;
};

class GfdmFormulation final : public Formulation {
 public:
  std::string_view name() const override { return "gfdm"; }
  int version() const override { return 3; }
  double support_factor() const override { return 1.8; }
  bool interpolates() const override { return true; }
  double highest_poisson_ratio() const override { return 0.45; }

  Result<std::unique_ptr<ElasticSolver>> prepare(const ElasticProblem& problem,
                                                 const Progress& progress) const override {
    if (auto accepted = accept_material(*this, problem.material); !accepted)
      return std::unexpected(accepted.error());
    CollocationRules rules;
    rules.stabilised_tractions = true;
    rules.stencils = [](const PointCloud& cloud) { return TaylorFit(cloud); };
    return prepare_collocation(*this, problem, rules, progress);
  }
};

}  // namespace

const Formulation& gfdm_formulation() {
  static const GfdmFormulation formulation;
  return formulation;
}

}  // namespace viscera
