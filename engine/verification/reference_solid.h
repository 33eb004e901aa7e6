// Reference solutions by finite elements that share nothing with the formulations they judge:
// nine-node elements turned about the z axis, or pulled up along z into 27-node ones.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <vector>

#include "engine/verification/quad_mesh.h"
#include "kernels/base/result.h"
#include "kernels/base/types.h"

namespace viscera {

/// Lengths in any unit, Young's modulus 1. Functions are of the place at rest; turned bodies are
/// asked on their half plane y = 0, x >= 0, where x is the distance from the axis.
struct SolidConditions {
  /// Which components of displacement are prescribed at a node: those of `displacement`, zero where
  /// that is empty.
  std::function<std::array<bool, 3>(const Vec3&)> held;
  std::function<Vec3(const Vec3&)> displacement;
  /// Of nodes that a tool moves: their reaction is its force. Empty: none.
  std::function<bool(const Vec3&)> is_tool;

  /// Faces of the surface that these two concern, asked at their middles.
  std::function<bool(const Vec3&)> is_loaded;
  /// Along the inward normal. Empty: none.
  std::function<double(const Vec3&)> pressure;
  /// How far the surface must come down, u_z <= -depth, pushed straight down without friction where
  /// it else wouldn't; it isn't pulled. Empty: no such contact.
  std::function<double(const Vec3&)> depth;
};

struct SolidAnswer {
  double force = 0.0;               ///< of tool, pressure and contact on the body, along -z
  std::vector<Vec3> displacements;  ///< of the nodes
  bool converged = true;            ///< which points touch was found
};

/// A body and its stiffness; solves for any conditions.
class ReferenceSolid {
 public:
  virtual ~ReferenceSolid() = default;
  virtual const std::vector<Vec3>& nodes() const = 0;
  /// Fails where the conditions don't hold the body.
  virtual Result<SolidAnswer> solve(const SolidConditions& conditions) const = 0;
};

/// Turned about the z axis: mesh x is the radius, mesh y is z.
std::unique_ptr<ReferenceSolid> turned_solid(QuadMesh mesh, double poisson_ratio);

/// The plane mesh between the levels of z, ascending; loaded faces are those of the top. A mesh of
/// the half y >= 0 is its own other half when `held` holds y on y = 0; forces are those of the
/// half.
std::unique_ptr<ReferenceSolid> raised_solid(const QuadMesh& mesh, const std::vector<double>& z,
                                             double poisson_ratio);

}  // namespace viscera
