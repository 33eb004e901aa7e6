// An elongated organ, held on a third of its length and lifted by its other end: what finite strain
// is for, and what its solver is measured on.
#pragma once

#include <memory>
#include <vector>

#include "engine/verification/bodies.h"
#include "kernels/finite/finite_solver.h"
#include "kernels/paff/galerkin.h"

namespace viscera {

struct LiftedBodyOptions {
  double spacing = 5.2e-3;  ///< of nodes [m]; gives some 1,100
  IsotropicMaterial material = {12e3, 0.45};
  FiniteOptions solver;
};

/// An ellipsoid of 90 x 35 x 35 mm along x, about the size of a gallbladder, held where x < -15 mm.
/// A grip of ten points holds the surface at its far end.
class LiftedBody {
 public:
  static Result<std::unique_ptr<LiftedBody>> prepare(const LiftedBodyOptions& options);
  LiftedBody(const LiftedBody&) = delete;
  LiftedBody& operator=(const LiftedBody&) = delete;

  /// The grip moved to this displacement [m], not turned.
  GripTarget target(const Vec3& moved) const;
  /// Sum of the forces on the tissue at the held points [N].
  static Vec3 force(const FiniteStep& step);
  /// The force on the grip of the linear body that is moved so [N].
  Vec3 linear_force(const Vec3& moved) const;

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
  MatrixX linear_rows_;  // Phi K^-1 Phi^T [m/N]
  double prepare_s_ = 0.0;
};

/// Along x and z as an ellipse about the origin, from `rings` rings of triangles between its poles.
TriangleSurface ellipsoid(const Vec3& half_axes, int rings);

/// The way of a lift: up by `height` [m] and a third of it towards the hold, within `duration` [s],
/// as smooth as a hand's.
Vec3 lifted(double time, double height, double duration);

}  // namespace viscera
