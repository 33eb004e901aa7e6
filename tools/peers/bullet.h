// The hemisphere stepped by Bullet's deformable body, in a program of its own that is built where
// Bullet is installed.
#pragma once

#include "tools/peers/finite_elements.h"

namespace viscera {

/// The program beside this one; empty where it wasn't built.
std::filesystem::path bullet_program();

struct BulletAnswer {
  double force_over_ERdelta = 0.0;  ///< of linear tetrahedra in the shape that Bullet reached
  std::vector<Vec3> displacements;  ///< of the nodes, over R
  double step_s = 0.0;              ///< median time of a step of 1/60 s
  double rest_s = 0.0;              ///< of all steps until the body has come to rest
  double setup_s = 0.0;             ///< body and world
};

/// Bullet's elasticity turns every tetrahedron's strain with it (corotated), as large displacements
/// ask; `linear` doesn't, as the reference.
enum class BulletElasticity { kCorotated, kLinear };

/// Holds the base, moves the patch down by the reference's depth and steps until the body has had
/// `steps` steps to come to rest. Linear tetrahedra alone.
Result<BulletAnswer> step_bullet(const TetrahedralMesh& mesh, double poisson_ratio, double a_over_R,
                                 BulletElasticity elasticity, int steps,
                                 const std::filesystem::path& folder);

/// Force on the nodes from the linear stress of these displacements, over E R^2. (3 per node)
std::vector<Vec3> internal_forces(const TetrahedralMesh& mesh, double poisson_ratio,
                                  const std::vector<Vec3>& displacements);

}  // namespace viscera
