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

/// The point of the disc of this radius that is nearest to y.
Vec2 onto_disc(const Vec2& y, double radius) {
  const double length = y.norm();
  return length <= radius ? y : Vec2(y * (radius / length));
}

}  // namespace

/// gaps = A x - b; residual = x - (projection of x - step * gap on what the condition allows), zero
/// exactly where the conditions hold.
void FrictionSolver::evaluate(const MatrixX& matrix, const VectorX& b, const VectorX& x,
                              VectorX& gaps, VectorX& residual) const {
  gaps.noalias() = matrix * x;
  gaps -= b;
  residual.resize(x.size());
  Eigen::Index i = 0;
  for (const ContactCondition& condition : conditions_) {
    const double step = step_of_[i];
    if (condition.kind == ContactCondition::Kind::kBilateral) {
      residual[i] = step * gaps[i];
    } else {
      const double pushed = std::max(0.0, x[i] - step * gaps[i]);
      residual[i] = x[i] - pushed;
      if (condition.kind == ContactCondition::Kind::kFriction) {
        const Vec2 dragged = x.segment<2>(i + 1) - step * gaps.segment<2>(i + 1);
        residual.segment<2>(i + 1) =
            x.segment<2>(i + 1) - onto_disc(dragged, condition.friction * pushed);
      }
    }
    i += condition.unknowns();
  }
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

/// One Gauss-Seidel pass, cell after cell; keeps `gaps` up to date.
void FrictionSolver::sweep(const MatrixX& matrix, VectorX& x, VectorX& gaps) const {
  const auto move = [&](Eigen::Index i, double value) {
    const double change = value - x[i];
    if (change == 0.0) return;
    x[i] = value;
    gaps += change * matrix.col(i);
  };
  Eigen::Index i = 0;
  for (const ContactCondition& condition : conditions_) {
    const double target = x[i] - gaps[i] / matrix(i, i);
    move(i, condition.kind == ContactCondition::Kind::kBilateral ? target : std::max(0.0, target));
    if (condition.kind == ContactCondition::Kind::kFriction) {
      const double stiffest = std::max(matrix(i + 1, i + 1), matrix(i + 2, i + 2));
      const Vec2 dragged = onto_disc(x.segment<2>(i + 1) - gaps.segment<2>(i + 1) / stiffest,
                                     condition.friction * x[i]);
      move(i + 1, dragged.x());
      move(i + 2, dragged.y());
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
  step_of_.resize(b.size());
  Eigen::Index at = 0;
  for (const ContactCondition& condition : conditions) {
    const int count = condition.unknowns();
    step_of_.segment(at, count).setConstant(1.0 / matrix.diagonal().segment(at, count).mean());
    at += count;
  }

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
      for (int i = 0; i < kSweeps; ++i) sweep(matrix, x, gaps_);
      evaluate(matrix, b, x, gaps_, residual_);
      if (!x.allFinite()) return give_up();
    }
  }

  // What is left of the residual may not break the signs and cones.
  Eigen::Index i = 0;
  for (const ContactCondition& condition : conditions) {
    if (condition.kind != ContactCondition::Kind::kBilateral) x[i] = std::max(0.0, x[i]);
    if (condition.kind == ContactCondition::Kind::kFriction) {
      x.segment<2>(i + 1) = onto_disc(x.segment<2>(i + 1), condition.friction * x[i]);
    }
    i += condition.unknowns();
  }
  return figures;
}

}  // namespace viscera
