#include "kernels/contact/contact_conditions.h"

#include <algorithm>

namespace viscera {

Vec2 onto_disc(const Vec2& y, double radius) {
  const double length = y.norm();
  return length <= radius ? y : Vec2(y * (radius / length));
}

VectorX forces_of_gaps(const VectorX& diagonal, std::span<const ContactCondition> conditions) {
  VectorX step(diagonal.size());
  Eigen::Index at = 0;
  for (const ContactCondition& condition : conditions) {
    const int count = condition.unknowns();
    step.segment(at, count).setConstant(1.0 / diagonal.segment(at, count).mean());
    at += count;
  }
  return step;
}

void contact_residual(std::span<const ContactCondition> conditions, const VectorX& step_of,
                      const VectorX& x, const VectorX& gaps, VectorX& residual) {
  residual.resize(x.size());
  Eigen::Index i = 0;
  for (const ContactCondition& condition : conditions) {
    const double step = step_of[i];
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

void sweep_contact(const MatrixX& matrix, std::span<const ContactCondition> conditions, VectorX& x,
                   VectorX& gaps) {
  const auto move = [&](Eigen::Index i, double value) {
    const double change = value - x[i];
    if (change == 0.0) return;
    x[i] = value;
    gaps += change * matrix.col(i);
  };
  Eigen::Index i = 0;
  for (const ContactCondition& condition : conditions) {
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

void into_cones(std::span<const ContactCondition> conditions, VectorX& x) {
  Eigen::Index i = 0;
  for (const ContactCondition& condition : conditions) {
    if (condition.kind != ContactCondition::Kind::kBilateral) x[i] = std::max(0.0, x[i]);
    if (condition.kind == ContactCondition::Kind::kFriction)
      x.segment<2>(i + 1) = onto_disc(x.segment<2>(i + 1), condition.friction * x[i]);
    i += condition.unknowns();
  }
}

}  // namespace viscera
