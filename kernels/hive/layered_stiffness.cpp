#include "kernels/hive/layered_stiffness.h"

#include <algorithm>
#include <cmath>

#include "kernels/contact/dense_cholesky.h"

namespace viscera {

LayeredStiffness::LayeredStiffness(const HivePattern& pattern, int loads)
    : ring_(pattern.ring_nodes()),
      free_(pattern.free_nodes()),
      layers_(pattern.layers()),
      block_(3 * pattern.free_nodes()),
      loads_(loads) {
  const auto b = static_cast<std::size_t>(block_), n = static_cast<std::size_t>(loads);
  const auto free_layers = static_cast<std::size_t>(layers_ - 1);
  blocks_.resize(free_layers * 2 * b * b);
  sides_.resize(free_layers * b * n);
  front_.resize((2 * b + n) * 2 * b);
}

bool LayeredStiffness::add_wedge(const std::array<int, 6>& nodes, std::span<const Vec3> positions,
                                 const IsotropicMaterial& material, const MatrixX* held) noexcept {
  const double mu = material.shear_modulus();
  const double bulk = material.lame_lambda() + 2.0 / 3.0 * mu;
  const double height = 1.0 / std::sqrt(3.0);
  using Gradients = Eigen::Matrix<double, 3, 6>;
  std::array<Gradients, 2> gradients;
  std::array<double, 2> weights{};
  Gradients mean = Gradients::Zero();
  double volume = 0.0;
  for (std::size_t q = 0; q < 2; ++q) {
    // Corners 0 1 2 lie at the top (zeta = 1), 3 4 5 below them; the point is over the centroid.
    const double zeta = q == 0 ? height : -height;
    const double up = 0.5 * (1.0 + zeta), down = 0.5 * (1.0 - zeta);
    Gradients local;                          // by the two barycentric coordinates and zeta
    local << -up, up, 0.0, -down, down, 0.0,  //
        -up, 0.0, up, -down, 0.0, down,       //
        1.0 / 6, 1.0 / 6, 1.0 / 6, -1.0 / 6, -1.0 / 6, -1.0 / 6;
    Mat3 jacobian = Mat3::Zero();
    for (int a = 0; a < 6; ++a)
      jacobian +=
          local.col(a) *
          positions[static_cast<std::size_t>(nodes[static_cast<std::size_t>(a)])].transpose();
    const double determinant = jacobian.determinant();
    if (!(determinant > 0.0)) return false;
    gradients[q] = jacobian.inverse() * local;
    weights[q] = 0.5 * determinant;
    mean += weights[q] * gradients[q];
    volume += weights[q];
  }
  mean /= volume;
  for (int i = 0; i < 6; ++i) {
    const int node = nodes[static_cast<std::size_t>(i)];
    const int layer = node / ring_, place = node % ring_;
    if (place >= free_ || layer == layers_ - 1) continue;
    for (int j = 0; j < 6; ++j) {
      const int other = nodes[static_cast<std::size_t>(j)];
      const int other_layer = other / ring_, other_place = other % ring_;
      const bool is_held = other_place >= free_ || other_layer == layers_ - 1;
      if (is_held ? held == nullptr : other_layer < layer) continue;
      Mat3 part = (bulk * volume) * mean.col(i) * mean.col(j).transpose();
      for (std::size_t q = 0; q < 2; ++q) {
        const Vec3 g = gradients[q].col(i), h = gradients[q].col(j);
        const double scale = weights[q] * mu;
        part += scale * (h * g.transpose() - (2.0 / 3.0) * g * h.transpose());
        part.diagonal().array() += scale * g.dot(h);
      }
      if (is_held) {
        const auto n = static_cast<std::size_t>(loads_);
        double* side = sides_.data() + static_cast<std::size_t>(layer * block_ + 3 * place) * n;
        for (int a = 0; a < 3; ++a)
          for (std::size_t k = 0; k < n; ++k)
            for (int c = 0; c < 3; ++c)
              side[static_cast<std::size_t>(a) * n + k] -=
                  part(a, c) * (*held)(3 * other + c, static_cast<Eigen::Index>(k));
        continue;
      }
      // D_l, or the block with rows of this layer and columns of the one below.
      double* into = block(layer) + (other_layer > layer ? block_ * block_ : 0);
      for (int c = 0; c < 3; ++c)
        for (int a = 0; a < 3; ++a)
          into[(3 * other_place + c) * block_ + 3 * place + a] += part(a, c);
    }
  }
  return true;
}

bool LayeredStiffness::assemble(const HivePattern& pattern, std::span<const Vec3> positions,
                                const IsotropicMaterial& material, const MatrixX* held) noexcept {
  std::fill(blocks_.begin(), blocks_.end(), 0.0);
  held_ = held != nullptr;
  if (held_) std::fill(sides_.begin(), sides_.end(), 0.0);
  for (int layer = 0; layer + 1 < layers_; ++layer) {
    const int top = layer * ring_, below = top + ring_;
    for (const auto& t : pattern.triangles()) {
      if (!add_wedge({top + t[0], top + t[1], top + t[2], below + t[0], below + t[1], below + t[2]},
                     positions, material, held))
        return false;
    }
  }
  return true;
}

bool LayeredStiffness::solve(Eigen::Ref<MatrixX> loads) noexcept {
  const auto b = static_cast<Eigen::Index>(block_), n = loads.cols();
  const auto sides = held_ ? n : 0;
  const Eigen::Index stride = 2 * b + loads_;
  double* front = front_.data();
  const auto copy_block = [&](const double* from, Eigen::Index row, Eigen::Index column) {
    for (Eigen::Index j = 0; j < b; ++j)
      std::copy_n(from + j * b, b, front + (column + j) * stride + row);
  };
  const auto copy_side = [&](int layer, Eigen::Index column) {
    for (Eigen::Index j = 0; j < b && sides > 0; ++j)
      std::copy_n(sides_.data() + (layer * b + j) * loads_, n,
                  front + (column + j) * stride + 2 * b);
  };
  const int lowest = layers_ - 2;
  copy_block(block(lowest), b, b);
  copy_side(lowest, b);
  for (int layer = lowest - 1; layer >= 0; --layer) {
    // What the last step left becomes the part to eliminate.
    for (Eigen::Index j = 0; j < b; ++j) {
      std::copy_n(front + (b + j) * stride + b, b, front + j * stride);
      std::copy_n(front + (b + j) * stride + 2 * b, sides, front + j * stride + 2 * b);
    }
    copy_block(block(layer) + b * b, b, 0);
    copy_block(block(layer), b, b);
    copy_side(layer, b);
    if (!partial_cholesky(front, stride, 2 * b + sides, 2 * b, b)) return false;
  }
  double* top = front + b * stride + b;
  if (!partial_cholesky(top, stride, b, b, b)) return false;
  for (Eigen::Index k = 0; k < n; ++k) {
    double* x = loads.col(k).data();
    if (sides > 0)
      for (Eigen::Index j = 0; j < b; ++j) x[j] += front[(b + j) * stride + 2 * b + k];
    solve_lower(top, stride, b, x);
    solve_lower_transposed(top, stride, b, x);
  }
  return true;
}

}  // namespace viscera
