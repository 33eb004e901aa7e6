#include "kernels/contact/frictional.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace viscera {
namespace {

constexpr double kTolerance = 1e-9;
constexpr int kMostRounds = 80;
constexpr int kHalvings = 4;
/// Sweeps that replace a Newton step which didn't help.
constexpr int kSweeps = 20;

}  // namespace

void FrictionSolver::evaluate(const MatrixX& matrix, const VectorX& b, const VectorX& x,
                              VectorX& gaps, VectorX& residual) const {
  gaps.noalias() = matrix * x;
  gaps -= b;
  contact_residual(conditions_, step_of_, x, gaps, residual);
}

/// The derivative of the residual, one of its branches where it has several.
void FrictionSolver::build_slope(const MatrixX& matrix, const VectorX& x, const VectorX& gaps,
                                 MatrixX& slope) {
  slope.setZero(x.size(), x.size());
  Eigen::Index i = 0;
  for (const ContactCondition& condition : conditions_) {
    const double step = step_of_[i];
    const bool bilateral = condition.kind == ContactCondition::Kind::kBilateral;
    const double pushed = x[i] - step * gaps[i];
    const bool closed = bilateral || pushed > 0.0;
    if (closed) {
      slope.row(i) = step * matrix.row(i);
    } else {
      slope(i, i) = 1.0;
    }
    if (condition.kind == ContactCondition::Kind::kFriction) {
      const Vec2 dragged = x.segment<2>(i + 1) - step * gaps.segment<2>(i + 1);
      const double limit = closed ? condition.friction * pushed : 0.0, length = dragged.norm();
      if (closed && length <= limit) {
        slope.middleRows(i + 1, 2) = step * matrix.middleRows(i + 1, 2);
      } else {
        slope(i + 1, i + 1) = slope(i + 2, i + 2) = 1.0;
        if (closed) {
          const Vec2 along = dragged / length;
          const Eigen::Matrix2d turn =
              limit / length * (Eigen::Matrix2d::Identity() - along * along.transpose());
          slope.block<2, 2>(i + 1, i + 1) -= turn;
          slope.block<2, 1>(i + 1, i) -= condition.friction * along;
          slope.middleRows(i + 1, 2) += step * (turn * matrix.middleRows(i + 1, 2) +
                                                condition.friction * along * matrix.row(i));
        }
      }
    }
    i += condition.unknowns();
  }
}

/// What the residual can't get below, because A x and b are rounded.
double FrictionSolver::round_off(const MatrixX& matrix, const VectorX& b, const VectorX& x) const {
  const VectorX size = matrix.cwiseAbs() * x.cwiseAbs() + b.cwiseAbs();
  return 8.0 * std::numeric_limits<double>::epsilon() * step_of_.cwiseProduct(size).maxCoeff();
}

FrictionFigures FrictionSolver::solve(const MatrixX& matrix, const VectorX& b,
                                      std::span<const ContactCondition> conditions, VectorX& x) {
  FrictionFigures figures;
  conditions_ = conditions;
  if (x.size() != b.size()) x.setZero(b.size());
  const auto give_up = [&] {
    x.setZero();
    return figures;
  };
  if (!b.allFinite() || !matrix.allFinite() || !x.allFinite()) return give_up();
  if (b.size() == 0) {
    figures.converged = true;
    return figures;
  }
  if (matrix.diagonal().minCoeff() <= 0.0) return give_up();
  step_of_ = forces_of_gaps(matrix.diagonal(), conditions);

  evaluate(matrix, b, x, gaps_, residual_);
  for (;; ++figures.rounds) {
    const double worst = residual_.cwiseAbs().maxCoeff();
    const double greatest = x.cwiseAbs().maxCoeff();
    figures.residual = greatest > 0.0 ? worst / greatest : worst > 0.0 ? 1.0 : 0.0;
    if (worst <= kTolerance * greatest || worst <= round_off(matrix, b, x)) {
      figures.converged = true;
      break;
    }
    if (figures.rounds == kMostRounds) return give_up();

    build_slope(matrix, x, gaps_, slope_);
    const VectorX step = slope_.partialPivLu().solve(-residual_);
    bool better = false;
    if (step.allFinite()) {
      double share = 1.0;
      for (int halving = 0; halving <= kHalvings && !better; ++halving, share *= 0.5) {
        trial_ = x + share * step;
        evaluate(matrix, b, trial_, trial_gaps_, trial_residual_);
        better = trial_residual_.norm() < (1.0 - 1e-3 * share) * residual_.norm();
      }
    }
    if (better) {
      x.swap(trial_);
      gaps_.swap(trial_gaps_);
      residual_.swap(trial_residual_);
    } else {
      for (int i = 0; i < kSweeps; ++i) sweep_contact(matrix, conditions, x, gaps_);
      evaluate(matrix, b, x, gaps_, residual_);
      if (!x.allFinite()) return give_up();
    }
  }

  // What is left of the residual may not break the signs and cones.
  into_cones(conditions, x);
  return figures;
}

}  // namespace viscera
