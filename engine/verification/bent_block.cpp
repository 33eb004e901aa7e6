#include "engine/verification/bent_block.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

namespace viscera {
namespace {

constexpr std::array<double, 3> kPlace{-0.7745966692414834, 0.0, 0.7745966692414834};
constexpr std::array<double, 3> kWeight{5.0 / 9.0, 8.0 / 9.0, 5.0 / 9.0};
constexpr int kMostIterations = 30;
constexpr double kResidual = 1e-9;  // of the force

std::array<double, 3> quadratic(double x) {
  return {0.5 * x * (x - 1.0), 1.0 - x * x, 0.5 * x * (x + 1.0)};
}
std::array<double, 3> slopes(double x) {
  return {x - 0.5, -2.0 * x, x + 0.5};
}

using Slopes = Eigen::Matrix<double, 3, 27>;

/// Of the 27 functions of an element with these edges [1/m].
Slopes slopes_at(const std::array<double, 3>& xi, const Vec3& edges) {
  std::array<std::array<double, 3>, 3> values, derivatives;
  for (std::size_t axis = 0; axis < 3; ++axis)
    values[axis] = quadratic(xi[axis]), derivatives[axis] = slopes(xi[axis]);
  Slopes out;
  for (int a = 0; a < 27; ++a) {
    const std::array<std::size_t, 3> at{static_cast<std::size_t>(a % 3),
                                        static_cast<std::size_t>(a / 3 % 3),
                                        static_cast<std::size_t>(a / 9)};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      double product = 2.0 / edges[static_cast<Eigen::Index>(axis)];
      for (std::size_t other = 0; other < 3; ++other)
        product *= other == axis ? derivatives[other][at[other]] : values[other][at[other]];
      out(static_cast<Eigen::Index>(axis), a) = product;
    }
  }
  return out;
}

Mat3 cofactor(const Mat3& f) {
  Mat3 c;
  c.col(0) = f.col(1).cross(f.col(2));
  c.col(1) = f.col(2).cross(f.col(0));
  c.col(2) = f.col(0).cross(f.col(1));
  return c;
}

/// The derivative of the cofactor along d.
Mat3 cofactor_change(const Mat3& f, const Mat3& d) {
  Mat3 c;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    c.col(i) = d.col(j).cross(f.col(k)) + f.col(j).cross(d.col(k));
  }
  return c;
}

using Lines = std::array<std::vector<double>, 3>;

/// From `first` to `last`, closer at the last, and at the first where `both`.
std::vector<double> graded(double first, double last, int parts, bool both) {
  std::vector<double> lines;
  for (int i = 0; i <= parts; ++i) {
    const double share = static_cast<double>(i) / parts;
    lines.push_back(first + (last - first) * (both ? 0.5 - 0.5 * std::cos(std::numbers::pi * share)
                                                   : std::sin(0.5 * std::numbers::pi * share)));
  }
  return lines;
}

/// Lays out the half y >= 0, and finds equilibria of it.
class Half {
 public:
  Half(const BentBlockOptions& options, const Lines& lines)
      : lines_(lines),
        mu_(options.material.shear_modulus()),
        lambda_(options.material.lame_lambda()) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      elements_[axis] = static_cast<int>(lines[axis].size()) - 1;
      nodes_[axis] = 2 * elements_[axis] + 1;
    }
    n_ = 3 * nodes_[0] * nodes_[1] * nodes_[2];
    u_ = VectorX::Zero(n_);
    held_.assign(static_cast<std::size_t>(n_), 0);
    for (int z = 0; z < nodes_[2]; ++z)
      for (int y = 0; y < nodes_[1]; ++y)
        for (int x = 0; x < nodes_[0]; ++x)
          for (int k = 0; k < 3; ++k)
            held_[static_cast<std::size_t>(3 * number(x, y, z) + k)] =
                x == 0 || x == nodes_[0] - 1 || (k == 1 && y == 0);
  }

  /// The end is moved so far in all; the body between follows evenly at first.
  bool move_end(const Vec3& moved) {
    const Vec3 more = moved - moved_;
    for (int z = 0; z < nodes_[2]; ++z)
      for (int y = 0; y < nodes_[1]; ++y)
        for (int x = 0; x < nodes_[0]; ++x)
          u_.segment<3>(3 * number(x, y, z)) += more * x / (nodes_[0] - 1.0);
    moved_ = moved;
    for (int iteration = 0; iteration < kMostIterations; ++iteration) {
      assemble();
      const double size = free_residual_.norm();
      if (size <= kResidual * force().norm()) return true;
      Eigen::SparseMatrix<double> matrix(n_, n_);
      matrix.setFromTriplets(entries_.begin(), entries_.end());
      if (!analysed_) solver_.analyzePattern(matrix), analysed_ = true;
      solver_.factorize(matrix);
      if (solver_.info() != Eigen::Success) return false;
      const VectorX step = solver_.solve(free_residual_);
      if (!step.allFinite()) return false;
      const VectorX from = u_;
      double share = 1.0;
      for (int back = 0; back < 8; ++back, share *= 0.5) {
        u_ = from - share * step;
        assemble();
        if (free_residual_.norm() < size) break;
      }
    }
    return false;
  }

  /// Of both halves, on the moved end [N].
  Vec3 force() const {
    Vec3 sum = Vec3::Zero();
    for (int z = 0; z < nodes_[2]; ++z)
      for (int y = 0; y < nodes_[1]; ++y)
        sum += residual_.segment<3>(3 * number(nodes_[0] - 1, y, z));
    return {2.0 * sum.x(), 0.0, 2.0 * sum.z()};
  }

  std::vector<Vec3> displacements() const {
    std::vector<Vec3> out;
    for (Eigen::Index at = 0; at < n_; at += 3) out.emplace_back(u_.segment<3>(at));
    return out;
  }

 private:
  double edge(std::size_t axis, int element) const {
    const auto at = static_cast<std::size_t>(element);
    return lines_[axis][at + 1] - lines_[axis][at];
  }
  int number(int x, int y, int z) const { return x + nodes_[0] * (y + nodes_[1] * z); }

  void assemble() {
    entries_.clear();
    residual_ = VectorX::Zero(n_);
    for (int z = 0; z < elements_[2]; ++z)
      for (int y = 0; y < elements_[1]; ++y)
        for (int x = 0; x < elements_[0]; ++x) add_element(x, y, z);
    free_residual_ = residual_;
    for (int i = 0; i < n_; ++i)
      if (held_[static_cast<std::size_t>(i)]) {
        entries_.emplace_back(i, i, mu_);
        free_residual_[i] = 0.0;
      }
  }

  void add_element(int x, int y, int z) {
    std::array<int, 27> at;
    Eigen::Matrix<double, 3, 27> u;
    for (int a = 0; a < 27; ++a) {
      at[static_cast<std::size_t>(a)] = number(2 * x + a % 3, 2 * y + a / 3 % 3, 2 * z + a / 9);
      u.col(a) = u_.segment<3>(3 * at[static_cast<std::size_t>(a)]);
    }
    const Vec3 edges(edge(0, x), edge(1, y), edge(2, z));
    Eigen::Matrix<double, 81, 81> stiffness = Eigen::Matrix<double, 81, 81>::Zero();
    Eigen::Matrix<double, 3, 27> forces = Eigen::Matrix<double, 3, 27>::Zero();
    for (std::size_t p = 0; p < 27; ++p) {
      const Slopes slope = slopes_at({kPlace[p % 3], kPlace[p / 3 % 3], kPlace[p / 9]}, edges);
      const double weight =
          0.125 * edges.prod() * kWeight[p % 3] * kWeight[p / 3 % 3] * kWeight[p / 9];
      const Mat3 f = Mat3::Identity() + u * slope.transpose();
      const Mat3 cof = cofactor(f);
      const double volume = (lambda_ + mu_) * (f.determinant() - 1.0) - mu_;
      forces += weight * (mu_ * f + volume * cof) * slope;
      for (int a = 0; a < 27; ++a)
        for (int i = 0; i < 3; ++i) {
          Mat3 d = Mat3::Zero();
          d.row(i) = slope.col(a).transpose();
          const Mat3 stress = mu_ * d + volume * cofactor_change(f, d) +
                              (lambda_ + mu_) * cof.cwiseProduct(d).sum() * cof;
          const Eigen::Matrix<double, 3, 27> row = weight * stress * slope;
          stiffness.row(3 * a + i) += Eigen::Map<const Eigen::Matrix<double, 1, 81>>(row.data());
        }
    }
    for (int a = 0; a < 27; ++a) {
      const int row = 3 * at[static_cast<std::size_t>(a)];
      residual_.segment<3>(row) += forces.col(a);
      for (int b = 0; b < 27; ++b)
        for (int i = 0; i < 3; ++i)
          for (int j = 0; j < 3; ++j) {
            const int to = row + i, from = 3 * at[static_cast<std::size_t>(b)] + j;
            if (to >= from && !held_[static_cast<std::size_t>(to)] &&
                !held_[static_cast<std::size_t>(from)])
              entries_.emplace_back(to, from, stiffness(3 * a + i, 3 * b + j));
          }
    }
  }

  const Lines& lines_;
  std::array<int, 3> elements_{}, nodes_{};
  Vec3 moved_ = Vec3::Zero();
  double mu_, lambda_;
  int n_ = 0;
  std::vector<char> held_;
  VectorX u_, residual_, free_residual_;
  std::vector<Eigen::Triplet<double>> entries_;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver_;
  bool analysed_ = false;
};

}  // namespace

Result<BentBlock> BentBlock::solve(const BentBlockOptions& options) {
  BentBlock block;
  const Vec3 half_size = 0.5 * options.size;
  const int across = std::max(2, options.elements / 3);
  block.lines_ = {graded(-half_size.x(), half_size.x(), options.elements, true),
                  graded(0.0, half_size.y(), std::max(1, across / 2), false),
                  graded(-half_size.z(), half_size.z(), across, true)};
  Half half(options, block.lines_);
  for (int step = 1; step <= options.steps; ++step)
    if (!half.move_end(options.moved * step / options.steps))
      return failure("bent block: found no equilibrium in step " + std::to_string(step) + " of " +
                     std::to_string(options.steps) + ", expected smaller steps to have one");
  block.displacements_ = half.displacements();
  block.force_ = half.force();
  return block;
}

Vec3 BentBlock::at(const Vec3& place) const {
  // The other half mirrors this one.
  const Vec3 here(place.x(), std::abs(place.y()), place.z());
  std::array<int, 3> element;
  std::array<std::array<double, 3>, 3> values;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double at = here[static_cast<Eigen::Index>(axis)];
    const std::vector<double>& lines = lines_[axis];
    const auto above = std::upper_bound(lines.begin() + 1, lines.end() - 1, at);
    element[axis] = static_cast<int>(above - lines.begin()) - 1;
    values[axis] = quadratic(2.0 * (at - *(above - 1)) / (*above - *(above - 1)) - 1.0);
  }
  const int nx = 2 * static_cast<int>(lines_[0].size()) - 1,
            ny = 2 * static_cast<int>(lines_[1].size()) - 1;
  Vec3 sum = Vec3::Zero();
  for (int a = 0; a < 27; ++a) {
    const int x = a % 3, y = a / 3 % 3, z = a / 9;
    const auto node = static_cast<std::size_t>(
        2 * element[0] + x + nx * (2 * element[1] + y + ny * (2 * element[2] + z)));
    sum += values[0][static_cast<std::size_t>(x)] * values[1][static_cast<std::size_t>(y)] *
           values[2][static_cast<std::size_t>(z)] * displacements_[node];
  }
  if (place.y() < 0.0) sum.y() = -sum.y();
  return sum;
}

}  // namespace viscera
