// A body held at one end and lifted by the other, prepared as organs are: what the solver of finite
// strain is measured on.
#pragma once

#include <memory>
#include <vector>

#include "engine/verification/bodies.h"
#include "engine/verification/lift_shapes.h"
#include "kernels/finite/finite_solver.h"
#include "kernels/paff/galerkin.h"

namespace viscera {

struct LiftedBodyOptions {
  LiftedShape shape = LiftedShape::kGallbladder;
  double spacing = 4e-3;  ///< of nodes [m]; gives some 1,100 of the gallbladder
  IsotropicMaterial material = {12e3, 0.45};
  FiniteOptions solver;
  bool in_levels = false;  ///< as large bodies are (two_levels.h)
};

class LiftedBody {
 public:
  static Result<std::unique_ptr<LiftedBody>> prepare(const LiftedBodyOptions& options);
  LiftedBody(const LiftedBody&) = delete;
  LiftedBody& operator=(const LiftedBody&) = delete;

  /// The grip moved to this displacement [m], not turned.
  GripTouch held_at(const Vec3& moved, const FiniteStep& last = {}) const;
  /// Sum of the forces on the tissue at the held points [N].
  static Vec3 force(const FiniteStep& step);
  /// The force on the grip of the linear body that is moved so [N].
  Vec3 linear_force(const Vec3& moved) const;
  /// Of its nodes then [m]                                                                 (3 N)
  VectorX linear_displacements(const Vec3& moved) const;

  const FiniteSolver& solver() const { return *solver_; }
  const GalerkinSystem& system() const { return *system_; }
  const NodedBody& body() const { return body_; }
  const Grip& grip() const { return grip_; }
  double prepare_s() const { return prepare_s_; }

 private:
  LiftedBody() = default;

  NodedBody body_;
  std::unique_ptr<GalerkinSystem> system_;
  std::unique_ptr<FiniteSolver> solver_;
  Grip grip_;
  VectorX linear_grip_forces(const Vec3& moved) const;

  MatrixX linear_columns_, linear_rows_;  // K^-1 Phi^T, Phi K^-1 Phi^T [m/N]
  double prepare_s_ = 0.0;
};

/// The way of a lift: up by `height` [m] and a third of it towards the hold, within `duration` [s],
/// as smooth as a hand's.
Vec3 lifted(double time, double height, double duration);

}  // namespace viscera
