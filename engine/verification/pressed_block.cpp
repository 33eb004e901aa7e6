#include "engine/verification/pressed_block.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "kernels/hive/hyperelastic.h"

namespace viscera {
namespace {

/// Where the block ends [radii of the ball], and how much longer each element is than the last.
constexpr double kFar = 200.0, kGrowth = 1.5;
/// The ball yields by this much under the pressure E [radii].
constexpr double kYield = 5e-4;
constexpr int kLeastSteps = 12;
constexpr std::array<double, 3> kPlace{-0.7745966692414834, 0.0, 0.7745966692414834};
constexpr std::array<double, 3> kWeight{5.0 / 9.0, 8.0 / 9.0, 5.0 / 9.0};

std::array<double, 3> quadratic(double x) {
  return {0.5 * x * (x - 1.0), 1.0 - x * x, 0.5 * x * (x + 1.0)};
}
std::array<double, 3> slopes(double x) {
  return {x - 0.5, -2.0 * x, x + 0.5};
}

/// Element borders from 0: even up to `even`, then growing.
std::vector<double> borders(double step, double even) {
  std::vector<double> out{0.0};
  while (out.back() < even - 1e-9) out.push_back(out.back() + step);
  while (out.back() < kFar) out.push_back(out.back() + (step *= kGrowth));
  return out;
}

class Block {
 public:
  explicit Block(const PressedBlockOptions& options)
      : options_(options),
        radii_(borders(1.0 / options.elements, 1.25)),
        depths_(borders(1.0 / options.elements, 0.75)),
        wide_(static_cast<int>(radii_.size()) - 1),
        deep_(static_cast<int>(depths_.size()) - 1),
        rows_(2 * deep_ + 1),
        n_(2 * (2 * wide_ + 1) * rows_),
        lambda_(options.material.lame_lambda() / options.material.youngs_modulus),
        mu_(options.material.shear_modulus() / options.material.youngs_modulus) {
    u_ = VectorX::Zero(n_);
    held_.assign(static_cast<std::size_t>(n_), 0);
    for (int c = 0; c <= 2 * wide_; ++c)
      for (int k = 0; k < rows_; ++k) {
        const bool far = c == 2 * wide_ || k == rows_ - 1;
        held_[static_cast<std::size_t>(dof(c, k, 0))] = far || c == 0;
        held_[static_cast<std::size_t>(dof(c, k, 1))] = far;
      }
  }

  /// In units of E and the ball's radius.
  bool press(double depth, double& force) {
    const VectorX before = u_;
    for (int iteration = 0; iteration < 60; ++iteration) {
      assemble(depth);
      const double size = residual_.norm();
      if (force_ > 0.0 && size < 1e-6 * force_) {
        force = force_;
        return true;
      }
      Eigen::SparseMatrix<double> matrix(n_, n_);
      matrix.setFromTriplets(entries_.begin(), entries_.end());
      if (iteration == 0) solver_.analyzePattern(matrix);
      solver_.factorize(matrix);
      if (solver_.info() != Eigen::Success) break;
      VectorX step = solver_.solve(residual_);
      if (!step.allFinite()) break;
      // Backtracking on the energy.
      const VectorX from = u_;
      const double energy = energy_;
      double share = std::min(1.0, 0.3 / step.cwiseAbs().maxCoeff());
      for (int back = 0; back < 12; ++back, share *= 0.5) {
        u_ = from + share * step;
        assemble(depth);
        if (energy_ <= energy + 1e-12 * std::abs(energy) || residual_.norm() < size) break;
      }
    }
    u_ = before;
    return false;
  }

 private:
  int dof(int c, int k, int component) const { return 2 * (c * rows_ + k) + component; }

  void assemble(double depth) {
    entries_.clear();
    residual_ = VectorX::Zero(n_);
    energy_ = force_ = 0.0;
    for (int c = 0; c < wide_; ++c)
      for (int k = 0; k < deep_; ++k) add_element(c, k);
    for (int c = 0; c < wide_; ++c) add_contact(c, depth);
    for (int i = 0; i < n_; ++i)
      if (held_[static_cast<std::size_t>(i)]) {
        entries_.emplace_back(i, i, 1.0);
        residual_[i] = 0.0;
      }
  }

  void add_entry(int i, int j, double value) {
    if (!held_[static_cast<std::size_t>(i)] && !held_[static_cast<std::size_t>(j)])
      entries_.emplace_back(i, j, value);
  }

  void add_element(int c, int k) {
    const double r0 = radii_[static_cast<std::size_t>(c)],
                 r1 = radii_[static_cast<std::size_t>(c + 1)];
    const double z0 = -depths_[static_cast<std::size_t>(k)],
                 z1 = -depths_[static_cast<std::size_t>(k + 1)];
    std::array<int, 18> at;
    for (int a = 0; a < 9; ++a)
      for (int i = 0; i < 2; ++i)
        at[static_cast<std::size_t>(2 * a + i)] = dof(2 * c + a / 3, 2 * k + a % 3, i);
    Eigen::Matrix<double, 18, 18> stiffness = Eigen::Matrix<double, 18, 18>::Zero();
    Eigen::Matrix<double, 18, 1> force = Eigen::Matrix<double, 18, 1>::Zero();
    for (std::size_t p = 0; p < 3; ++p)
      for (std::size_t q = 0; q < 3; ++q) {
        const auto nr = quadratic(kPlace[p]), nz = quadratic(kPlace[q]);
        const auto dr = slopes(kPlace[p]), dz = slopes(kPlace[q]);
        const double r = 0.5 * (r0 + r1) + 0.5 * kPlace[p] * (r1 - r0);
        const double weight =
            2.0 * std::numbers::pi * r * kWeight[p] * kWeight[q] * 0.25 * (r1 - r0) * (z0 - z1);
        // Rows of F that each unknown moves, as F column after column.
        Eigen::Matrix<double, 9, 18> b = Eigen::Matrix<double, 9, 18>::Zero();
        for (int a = 0; a < 9; ++a) {
          const auto i = static_cast<std::size_t>(a / 3), j = static_cast<std::size_t>(a % 3);
          const double by_r = dr[i] * nz[j] * 2.0 / (r1 - r0),
                       by_z = nr[i] * dz[j] * 2.0 / (z1 - z0);
          b(0, 2 * a) = by_r;
          b(6, 2 * a) = by_z;
          b(4, 2 * a) = nr[i] * nz[j] / r;
          b(2, 2 * a + 1) = by_r;
          b(8, 2 * a + 1) = by_z;
        }
        Eigen::Matrix<double, 18, 1> u;
        for (int a = 0; a < 18; ++a) u[a] = u_[at[static_cast<std::size_t>(a)]];
        const Eigen::Matrix<double, 9, 1> change = b * u;
        const Mat3 f = Mat3::Identity() + change.reshaped(3, 3);
        HyperelasticLaw law(options_.model, options_.material);
        law.lambda = lambda_;
        law.mu = mu_;
        energy_ += weight * law.energy(f);
        force += weight * b.transpose() * law.stress(f).reshaped();
        stiffness += weight * b.transpose() * law.tangent(f) * b;
      }
    for (int i = 0; i < 18; ++i) {
      residual_[at[static_cast<std::size_t>(i)]] -= force[i];
      for (int j = 0; j < 18; ++j)
        add_entry(at[static_cast<std::size_t>(i)], at[static_cast<std::size_t>(j)],
                  stiffness(i, j));
    }
  }

  /// Points of the surface inside the ball are pushed out, stiffly.
  void add_contact(int c, double depth) {
    const double r0 = radii_[static_cast<std::size_t>(c)],
                 r1 = radii_[static_cast<std::size_t>(c + 1)];
    const Vec2 centre(0.0, 1.0 - depth);
    constexpr int kParts = 4;  // so that the contact's edge moves in small steps
    for (int part = 0; part < kParts; ++part)
      for (std::size_t p = 0; p < 3; ++p) {
        const double x = -1.0 + (2.0 * part + 1.0 + kPlace[p]) / kParts;
        const auto n = quadratic(x);
        const double r = 0.5 * (r0 + r1) + 0.5 * x * (r1 - r0);
        Vec2 place(r, 0.0);
        for (int a = 0; a < 3; ++a)
          place += n[static_cast<std::size_t>(a)] *
                   Vec2(u_[dof(2 * c + a, 0, 0)], u_[dof(2 * c + a, 0, 1)]);
        const Vec2 away = place - centre;
        const double distance = away.norm(), gap = distance - 1.0;
        if (gap >= 0.0 || place.y() > centre.y()) continue;
        const double weight =
            2.0 * std::numbers::pi * r * kWeight[p] * 0.5 * (r1 - r0) / kParts / kYield;
        const Vec2 out = away / distance;
        Eigen::Matrix2d k = weight * out * out.transpose();
        k += weight * (gap / distance) * (Eigen::Matrix2d::Identity() - out * out.transpose());
        energy_ += 0.5 * weight * gap * gap;
        const Vec2 push = -weight * gap * out;
        force_ -= push.y();
        for (int a = 0; a < 3; ++a)
          for (int i = 0; i < 2; ++i) {
            residual_[dof(2 * c + a, 0, i)] += n[static_cast<std::size_t>(a)] * push[i];
            for (int b = 0; b < 3; ++b)
              for (int j = 0; j < 2; ++j)
                add_entry(
                    dof(2 * c + a, 0, i), dof(2 * c + b, 0, j),
                    n[static_cast<std::size_t>(a)] * n[static_cast<std::size_t>(b)] * k(i, j));
          }
      }
  }

  const PressedBlockOptions& options_;
  std::vector<double> radii_, depths_;
  int wide_, deep_, rows_, n_;
  double lambda_, mu_;
  VectorX u_, residual_;
  std::vector<char> held_;
  std::vector<Eigen::Triplet<double>> entries_;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver_;
  double energy_ = 0.0, force_ = 0.0;
};

}  // namespace

std::vector<double> press_block(const PressedBlockOptions& options) {
  Block block(options);
  const double unit = options.material.youngs_modulus * options.ball_radius * options.ball_radius;
  std::vector<double> forces;
  double reached = 0.0, force = 0.0;
  for (const double depth : options.depths) {
    const double wanted = depth / options.ball_radius;
    double step = std::max(wanted - reached, 1e-12) /
                  std::max(1, static_cast<int>(std::ceil((wanted - reached) * kLeastSteps)));
    while (reached < wanted - 1e-12) {
      const double next = std::min(wanted, reached + step);
      if (block.press(next, force)) {
        reached = next;
      } else if ((step *= 0.5) < 1e-3) {
        return forces;
      }
    }
    forces.push_back(unit * force);
  }
  return forces;
}

}  // namespace viscera
