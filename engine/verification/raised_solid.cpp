#include <algorithm>

#include "engine/verification/reference_solid.h"
#include "kernels/paff/block_matrix.h"
#include "kernels/paff/stiffness_factor.h"

namespace viscera {
namespace {

class RaisedSolid final : public ReferenceSolid {
 public:
  RaisedSolid(const QuadMesh& mesh, const std::vector<double>& z, double poisson_ratio)
      : plane_(mesh.nodes.size()), faces_(mesh.elements) {
    const std::vector<double> levels = with_middles(z);
    for (const double height : levels)
      for (const Vec2& x : mesh.nodes) nodes_.emplace_back(x.x(), x.y(), height);
    top_ = static_cast<int>((levels.size() - 1) * plane_);
    for (std::size_t layer = 0; layer + 1 < z.size(); ++layer)
      for (const auto& quad : mesh.elements) {
        std::array<int, 27> element{};
        for (std::size_t k = 0; k < 27; ++k)
          element[k] = static_cast<int>((2 * layer + k / 9) * plane_) + quad[k % 9];
        elements_.push_back(element);
      }
    make_pattern();
    assemble(poisson_ratio);
  }

  const std::vector<Vec3>& nodes() const override { return nodes_; }

  Result<SolidAnswer> solve(const SolidConditions& conditions) const override {
    if (conditions.depth) return failure("reference solid: found contact, expected a turned solid");
    const std::size_t count = 3 * nodes_.size();
    std::vector<char> held(count, 0);
    std::vector<double> wanted(count, 0.0), load(count, 0.0);
    for (std::size_t n = 0; n < nodes_.size(); ++n) {
      const auto components = conditions.held(nodes_[n]);
      const Vec3 to = conditions.displacement ? conditions.displacement(nodes_[n]) : Vec3::Zero();
      for (std::size_t c = 0; c < 3; ++c) {
        held[3 * n + c] = components[c];
        if (components[c]) wanted[3 * n + c] = to[static_cast<Eigen::Index>(c)];
      }
    }
    SolidAnswer answer;
    if (conditions.pressure) add_pressure(conditions, load, answer.force);
    auto solved = solve_linear(held, wanted, load);
    if (!solved) return std::unexpected(solved.error());
    const std::vector<double>& u = *solved;
    if (conditions.is_tool) {
      std::vector<double> reaction(count);
      stiffness_.multiply(u, reaction);
      for (std::size_t n = 0; n < nodes_.size(); ++n)
        if (conditions.is_tool(nodes_[n])) answer.force -= reaction[3 * n + 2];
    }
    for (std::size_t n = 0; n < nodes_.size(); ++n)
      answer.displacements.emplace_back(u[3 * n], u[3 * n + 1], u[3 * n + 2]);
    return answer;
  }

 private:
  std::size_t top_node(std::size_t face, std::size_t k) const {
    return static_cast<std::size_t>(top_ + faces_[face][k]);
  }

  void add_pressure(const SolidConditions& conditions, std::vector<double>& load,
                    double& force) const {
    constexpr int kParts = 2;
    for (std::size_t face = 0; face < faces_.size(); ++face) {
      if (!conditions.is_loaded || !conditions.is_loaded(nodes_[top_node(face, 4)])) continue;
      for (std::size_t cell = 0; cell < 9 * kParts * kParts; ++cell) {
        const std::size_t p = cell % 3, q = cell / 3 % 3, i = cell / 9 % kParts,
                          j = cell / 9 / kParts;
        const double s = -1.0 + (2.0 * static_cast<double>(i) + 1.0 + kGaussPlaces[p]) / kParts;
        const double t = -1.0 + (2.0 * static_cast<double>(j) + 1.0 + kGaussPlaces[q]) / kParts;
        const auto ns = quadratics(s), nt = quadratics(t);
        const auto ds = quadratic_slopes(s), dt = quadratic_slopes(t);
        Vec3 x = Vec3::Zero(), along = Vec3::Zero(), across = Vec3::Zero();
        for (std::size_t k = 0; k < 9; ++k) {
          const Vec3& node = nodes_[top_node(face, k)];
          x += ns[k / 3] * nt[k % 3] * node;
          along += ds[k / 3] * nt[k % 3] * node;
          across += ns[k / 3] * dt[k % 3] * node;
        }
        const double area =
            along.cross(across).norm() * kGaussWeights[p] * kGaussWeights[q] / (kParts * kParts);
        const double f = area * conditions.pressure(x);
        for (std::size_t k = 0; k < 9; ++k)
          load[3 * top_node(face, k) + 2] -= f * ns[k / 3] * nt[k % 3];
        force += f;
      }
    }
  }

  Result<std::vector<double>> solve_linear(const std::vector<char>& held,
                                           const std::vector<double>& wanted,
                                           const std::vector<double>& load) const {
    SymmetricBlockMatrix matrix = stiffness_;
    std::vector<double> right(load.size());
    matrix.multiply(wanted, right);
    for (std::size_t i = 0; i < right.size(); ++i) right[i] = load[i] - right[i];
    // Held unknowns stand alone: zero beside a diagonal of about the right size.
    const SymmetricPattern& pattern = matrix.pattern;
    for (std::size_t row = 0; row < pattern.rows(); ++row)
      for (std::size_t e = pattern.row_begin[row]; e < pattern.row_begin[row + 1]; ++e) {
        const auto column = static_cast<std::size_t>(pattern.columns[e]);
        for (std::size_t i = 0; i < 3; ++i)
          for (std::size_t j = 0; j < 3; ++j)
            if ((held[3 * row + i] || held[3 * column + j]) && !(row == column && i == j))
              matrix.blocks[9 * e + 3 * i + j] = 0.0;
      }
    for (std::size_t i = 0; i < right.size(); ++i)
      if (held[i]) right[i] = 0.0;
    const auto factor = StiffnessFactor::factor(matrix, nodes_, FactorPrecision::kFull);
    if (!factor) return failure("reference solid: " + factor.error().text());
    if (auto solved = factor->solve(matrix, right, 1); !solved)
      return std::unexpected(solved.error());
    for (std::size_t i = 0; i < right.size(); ++i) right[i] += wanted[i];
    return right;
  }

  void make_pattern() {
    std::vector<std::vector<int>> columns(nodes_.size());
    for (const auto& element : elements_)
      for (const int row : element)
        for (const int column : element)
          if (column >= row) columns[static_cast<std::size_t>(row)].push_back(column);
    SymmetricPattern& pattern = stiffness_.pattern;
    for (auto& row : columns) {
      std::sort(row.begin(), row.end());
      row.erase(std::unique(row.begin(), row.end()), row.end());
      pattern.columns.insert(pattern.columns.end(), row.begin(), row.end());
      pattern.row_begin.push_back(pattern.columns.size());
    }
    stiffness_.width = 3;
    stiffness_.blocks.assign(9 * pattern.columns.size(), 0.0);
  }

  std::size_t slot(std::size_t row, std::size_t column) const {
    const SymmetricPattern& pattern = stiffness_.pattern;
    const auto begin =
        pattern.columns.begin() + static_cast<std::ptrdiff_t>(pattern.row_begin[row]);
    const auto end =
        pattern.columns.begin() + static_cast<std::ptrdiff_t>(pattern.row_begin[row + 1]);
    return static_cast<std::size_t>(std::lower_bound(begin, end, static_cast<int>(column)) -
                                    pattern.columns.begin());
  }

  void assemble(double poisson_ratio) {
    const double lambda = poisson_ratio / ((1.0 + poisson_ratio) * (1.0 - 2.0 * poisson_ratio));
    const double mu = 0.5 / (1.0 + poisson_ratio);
    for (const auto& element : elements_) {
      Eigen::Matrix<double, 81, 81> whole = Eigen::Matrix<double, 81, 81>::Zero();
      for (std::size_t point = 0; point < 27; ++point) {
        const std::size_t p = point / 9, q = point / 3 % 3, s = point % 3;
        const auto nz = quadratics(kGaussPlaces[p]), nu = quadratics(kGaussPlaces[q]),
                   nv = quadratics(kGaussPlaces[s]);
        const auto dz = quadratic_slopes(kGaussPlaces[p]), du = quadratic_slopes(kGaussPlaces[q]),
                   dv = quadratic_slopes(kGaussPlaces[s]);
        Eigen::Matrix<double, 3, 27> local;
        Mat3 jacobian = Mat3::Zero();
        for (std::size_t k = 0; k < 27; ++k) {
          const std::size_t c = k / 9, a = k / 3 % 3, b = k % 3;
          local.col(static_cast<Eigen::Index>(k)) =
              Vec3(nz[c] * du[a] * nv[b], nz[c] * nu[a] * dv[b], dz[c] * nu[a] * nv[b]);
          jacobian += local.col(static_cast<Eigen::Index>(k)) *
                      nodes_[static_cast<std::size_t>(element[k])].transpose();
        }
        const double weight = std::abs(jacobian.determinant()) * kGaussWeights[p] *
                              kGaussWeights[q] * kGaussWeights[s];
        const Eigen::Matrix<double, 3, 27> slope = jacobian.inverse() * local;
        // lambda (div u)(div v) + mu (grad u : grad v + grad u : grad v^T)
        const Eigen::Matrix<double, 27, 27> product = slope.transpose() * slope;
        for (Eigen::Index k = 0; k < 27; ++k)
          for (Eigen::Index l = 0; l < 27; ++l)
            whole.block<3, 3>(3 * k, 3 * l) +=
                weight * (lambda * slope.col(k) * slope.col(l).transpose() +
                          mu * slope.col(l) * slope.col(k).transpose() +
                          mu * product(k, l) * Mat3::Identity());
      }
      for (std::size_t k = 0; k < 27; ++k)
        for (std::size_t l = 0; l < 27; ++l) {
          if (element[l] < element[k]) continue;
          const std::size_t at =
              slot(static_cast<std::size_t>(element[k]), static_cast<std::size_t>(element[l]));
          for (std::size_t i = 0; i < 3; ++i)
            for (std::size_t j = 0; j < 3; ++j)
              stiffness_.blocks[9 * at + 3 * i + j] +=
                  whole(static_cast<Eigen::Index>(3 * k + i), static_cast<Eigen::Index>(3 * l + j));
        }
    }
  }

  std::size_t plane_;
  std::vector<std::array<int, 9>> faces_;
  std::vector<Vec3> nodes_;
  std::vector<std::array<int, 27>> elements_;
  int top_ = 0;
  SymmetricBlockMatrix stiffness_;
};

}  // namespace

std::unique_ptr<ReferenceSolid> raised_solid(const QuadMesh& mesh, const std::vector<double>& z,
                                             double poisson_ratio) {
  return std::make_unique<RaisedSolid>(mesh, z, poisson_ratio);
}

}  // namespace viscera
