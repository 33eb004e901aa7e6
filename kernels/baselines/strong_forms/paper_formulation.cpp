// The `paper` formulation: linear moving least squares collocated at the nodes [De2006] eq. 1-10.
#include <array>
#include <sstream>

#include "kernels/baselines/strong_forms/collocation.h"
#include "kernels/paff/moment_matrix.h"

namespace viscera {
namespace {

/// Second derivatives of h_J = W_J P^T(x) A^-1(x) P(x_J) ([De2006] eq. 3) at a node x. With
/// c = A^-1 P and subscripts for derivatives, A c = P gives
///   c_k  = A^-1 (P_k - A_k c)
///   c_kl = A^-1 (-A_kl c - A_k c_l - A_l c_k)          (P is linear: P_kl = 0)
///   h_J,kl = P_J . (W_J,kl c + W_J,k c_l + W_J,l c_k + W_J c_kl).
/// The origin of the basis is put at the node, whose unit is the support radius; then
/// P(x) = (1, 0, 0, 0) and P_k = e_k.
class MovingLeastSquaresAtNodes {
 public:
  explicit MovingLeastSquaresAtNodes(std::shared_ptr<const ShapeFunctions> shape)
      : shape_(std::move(shape)) {}

  Result<void> operator()(int node, NodeStencil& out) const {
    const PointCloud& cloud = shape_->cloud();
    const Vec3& x = cloud.positions[static_cast<std::size_t>(node)];
    ShapeValues at;
    if (!shape_->evaluate(x, true, at)) {
      std::ostringstream text;
      text << "nodes: " << at.nodes.size() << " nodes reach (" << (x * 1e3).transpose()
           << ") mm and carry no linear field there; expected at least 4, not in one plane: use a "
              "smaller node spacing";
      return failure(text.str());
    }
    const std::size_t count = at.nodes.size();
    out.resize(count);
    out.nodes = at.nodes;
    out.values = at.values;
    out.gradients = at.gradients;

    const double unit = shape_->support_radius(node);
    MomentMatrix<kLinearTerms> moments;
    std::array<Eigen::Matrix4d, 3> first;  // A_k
    std::array<std::array<Eigen::Matrix4d, 3>, 3> second;
    for (int k = 0; k < 3; ++k) {
      first[k].setZero();
      for (int l = 0; l <= k; ++l) second[k][l].setZero();
    }
    std::vector<Vec4> basis(count);
    std::vector<Vec3> slope(count);  // of W_J [1]
    std::vector<Mat3> bend(count);
    for (std::size_t j = 0; j < count; ++j) {
      const Vec3 d = (cloud.positions[static_cast<std::size_t>(at.nodes[j])] - x) / unit;
      basis[j] = Vec4(1.0, d.x(), d.y(), d.z());
      differentiate_weight(d, shape_->support_radius(at.nodes[j]) / unit, slope[j], bend[j]);
      moments.add(at.weights[j], basis[j]);
      const Eigen::Matrix4d outer = basis[j] * basis[j].transpose();
      for (int k = 0; k < 3; ++k) {
        first[k] += slope[j][k] * outer;
        for (int l = 0; l <= k; ++l) second[k][l] += bend[j](k, l) * outer;
      }
    }
    moments.factor();  // found regular above
    const Vec4 c = moments.solve(Vec4(1.0, 0.0, 0.0, 0.0));
    std::array<Vec4, 3> ck;
    for (int k = 0; k < 3; ++k) {
      Vec4 right = -first[k] * c;
      right[k + 1] += 1.0;
      ck[k] = moments.solve(right);
    }
    for (int k = 0; k < 3; ++k) {
      for (int l = 0; l <= k; ++l) {
        const Vec4 ckl = moments.solve(-second[k][l] * c - first[k] * ck[l] - first[l] * ck[k]);
        for (std::size_t j = 0; j < count; ++j) {
          const Vec4 sum =
              bend[j](k, l) * c + slope[j][k] * ck[l] + slope[j][l] * ck[k] + at.weights[j] * ckl;
          out.hessians[j](k, l) = out.hessians[j](l, k) = basis[j].dot(sum) / (unit * unit);
        }
      }
    }
    return {};
  }

 private:
  /// W(|x - x_J| / r) differentiated by x, at d = x_J - x: with s = |d| / r,
  /// W'(s)/s = -12 (1 - s)^2 and W''(s) = -12 (1 - s) (1 - 3 s), both regular at s = 0.
  static void differentiate_weight(const Vec3& d, double radius, Vec3& slope, Mat3& bend) {
    const double s = d.norm() / radius, rest = 1.0 - s;
    const double by_s = -12.0 * rest * rest, curvature = -12.0 * rest * (1.0 - 3.0 * s);
    const double r2 = radius * radius;
    slope = -by_s / r2 * d;
    const Vec3 direction = s > 0.0 ? Vec3(d / d.norm()) : Vec3(Vec3::Zero());
    bend = (by_s * Mat3::Identity() + (curvature - by_s) * direction * direction.transpose()) / r2;
  }

  std::shared_ptr<const ShapeFunctions> shape_;
};

class PaperFormulation final : public Formulation {
 public:
  std::string_view name() const override { return "paper"; }
  int version() const override { return 3; }
  double support_factor() const override { return 3.0; }
  std::string_view warning() const override {
    return "formulation \"paper\": it reproduces the published method, which doesn't converge as "
           "nodes are added (second derivatives of its fields are inconsistent), so forces and "
           "shapes may be off by half; use \"galerkin\" where they matter";
  }

  Result<std::unique_ptr<ElasticSolver>> prepare(const ElasticProblem& problem,
                                                 const Progress& progress) const override {
    CollocationRules rules;
    rules.stencils = [this](const PointCloud& cloud) {
      return MovingLeastSquaresAtNodes(std::make_shared<ShapeFunctions>(fields(cloud)));
    };
    return prepare_collocation(*this, problem, rules, progress);
  }
};

}  // namespace

const Formulation& paper_formulation() {
  static const PaperFormulation formulation;
  return formulation;
}

}  // namespace viscera
