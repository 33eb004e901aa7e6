// The paper's Laplacian: kept for comparison, so written for reading.
#include <Eigen/Dense>

#include "kernels/base/parallel.h"
#include "kernels/smoke/viscosity.h"

namespace viscera {
namespace {

using Mat4 = Eigen::Matrix4d;
using Moments = Eigen::Matrix<double, 4, 3>;  // basis by component of velocity

/// Sums over the neighbours of a particle; lengths in units of h, so that the basis is well scaled.
struct Neighbour {
  Vec3 offset;  // x_j - x_i, over h
  Vec3 velocity;
  double q;  // 1 - offset^2
};

Eigen::Vector4d basis(const Neighbour& n) {
  return {1.0, n.offset.x(), n.offset.y(), n.offset.z()};
}

/// lap v in units of 1/h^2; false where the moment matrix is singular.
bool laplacian(const std::vector<Neighbour>& neighbours, Vec3& result) {
  Mat4 a = Mat4::Zero();
  Moments f = Moments::Zero();
  for (const Neighbour& n : neighbours) {
    const Eigen::Vector4d p = n.q * n.q * n.q * basis(n);
    a += p * basis(n).transpose();
    f += p * n.velocity.transpose();
  }
  const Eigen::LLT<Mat4> factor(a);
  if (factor.info() != Eigen::Success || !(factor.rcond() > kLeastCondition)) return false;
  const Mat4 inverse = factor.solve(Mat4::Identity());
  const Moments c = inverse * f;

  // Weights move with x: dW/dx_k = 6 q^2 d_k and lap W = -18 q^2 + 24 q d^2, d = x_j - x.
  std::array<Mat4, 3> a_k = {Mat4::Zero(), Mat4::Zero(), Mat4::Zero()};
  std::array<Moments, 3> r_k = {Moments::Zero(), Moments::Zero(), Moments::Zero()};
  Moments r_kk = Moments::Zero();
  for (const Neighbour& n : neighbours) {
    const Eigen::Vector4d p = basis(n);
    const Vec3 misfit = n.velocity - c.transpose() * p;
    const Moments pe = p * misfit.transpose();
    const Mat4 pp = p * p.transpose();
    for (int k = 0; k < 3; ++k) {
      const double weight = 6.0 * n.q * n.q * n.offset[k];
      a_k[k] += weight * pp;
      r_k[k] += weight * pe;
    }
    r_kk += (-18.0 * n.q * n.q + 24.0 * n.q * n.offset.squaredNorm()) * pe;
  }
  Moments right = r_kk;
  result.setZero();
  for (int k = 0; k < 3; ++k) {
    const Moments c_k = inverse * r_k[k];
    right -= 2.0 * a_k[k] * c_k;
    result += 2.0 * c_k.row(k + 1).transpose();
  }
  result += (inverse * right).row(0).transpose();
  return true;
}

}  // namespace

void add_paper_viscosity(std::span<const Float4> positions, std::span<const Float4> velocities,
                         std::span<const float> strength, const SmokeBins& bins,
                         const ViscosityParameters& parameters, std::span<Float4> accelerations) {
  const double inverse_h = std::sqrt(static_cast<double>(parameters.inverse_square));
  const double factor = parameters.viscosity * static_cast<double>(parameters.inverse_square);
  const double dt = parameters.step;
  parallel_chunks(bins.occupied.size(), 16, [&](std::size_t begin, std::size_t end) {
    std::vector<Neighbour> neighbours;
    for (std::size_t o = begin; o < end; ++o) {
      const auto [first, last] = bins.own(bins.occupied[o]);
      const std::array<SmokeBins::Run, 9> runs = bins.runs(bins.occupied[o]);
      for (std::size_t i = first; i < last; ++i) {
        if (strength[i] == 0.0f) continue;
        neighbours.clear();
        Vec3 low = velocities[i].xyz().cast<double>(), high = low;
        for (const auto& [run_first, run_last] : runs) {
          for (std::size_t j = run_first; j < run_last; ++j) {
            if (strength[j] == 0.0f) continue;
            const Vec3 offset =
                inverse_h * (positions[j].xyz() - positions[i].xyz()).cast<double>();
            const double q = 1.0 - offset.squaredNorm();
            if (q <= 0.0) continue;
            const Vec3 velocity = velocities[j].xyz().cast<double>();
            neighbours.push_back({offset, velocity, q});
            low = low.cwiseMin(velocity);
            high = high.cwiseMax(velocity);
          }
        }
        Vec3 change;
        if (!laplacian(neighbours, change)) continue;
        const Vec3 now = velocities[i].xyz().cast<double>();
        const Vec3 then = (now + dt * factor * change).cwiseMax(low).cwiseMin(high);
        accelerations[i].set_xyz(accelerations[i].xyz() + ((then - now) / dt).cast<float>());
      }
    }
  });
}

}  // namespace viscera
