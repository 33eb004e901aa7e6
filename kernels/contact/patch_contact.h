// Contact of rigid tools with one body through small patches ("cells") at arbitrary places of its
// surface, on the precomputed compliance. Unilateral where a tool presses, bilateral where a closed
// jaw holds.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "kernels/contact/near_field.h"
#include "kernels/paff/elasticity.h"
#include "kernels/paff/shape_functions.h"
#include "kernels/points/surface.h"

namespace viscera {

/// The touchable part of a body's surface as points with areas and finite fields: what a contact
/// load is spread over. Immutable; built once in pre-processing.
struct TouchableSurface {
  std::vector<Vec3> positions;      ///< rest [m]                                   (S)
  std::vector<double> areas;        ///< [m2]                                       (S)
  std::vector<double> spacings;     ///< local node spacing h [m]                   (S)
  SparseWeights weights;            ///< phi_J at each point; columns are indices into
                                    ///< SurfaceCompliance::touchable               (S rows)
  // Uniform grid over positions for range queries.
  Box box;
  double cell = 1.0;                ///< [m]
  Eigen::Vector3i cells = Eigen::Vector3i::Ones();
  std::vector<int> cell_begin, cell_items;
};

/// Samples the triangles of `surface` for which `is_touchable` holds at the centroid, split to edges
/// of half the local node spacing at most. `touchable_nodes` (out) are the nodes whose fields reach a
/// sample, ascending: the columns to ask of the compliance.
Result<TouchableSurface> sample_touchable_surface(const TriangleSurface& surface,
                                                  const std::function<bool(const Vec3&)>& is_touchable,
                                                  const ShapeFunctions& fields,
                                                  std::vector<int>& touchable_nodes);

/// A small patch of surface that a tool presses or holds as a whole.
struct ContactCell {
  Vec3 position = Vec3::Zero();     ///< rest, on the surface [m]
  Vec3 normal = Vec3::UnitZ();      ///< outward unit surface normal
  double area = 0.0;                ///< [m2]
  bool held = false;                ///< false: pressed, frictionless, can only be pushed

  Vec3 direction = -Vec3::UnitZ();  ///< pressed: unit, the way the tool pushes
  double depth = 0.0;               ///< pressed: u . direction >= depth wanted [m]; may be negative (a gap)
  Vec3 displacement = Vec3::Zero(); ///< held: u wanted [m]
};

struct ContactSolution {
  std::vector<Vec3> forces;         ///< on the tissue, per cell [N]                 (cells)
  int touching = 0;                 ///< cells with force
  int pivots = 0;                   ///< exchanges of the active set
  bool converged = false;
  double smallest_eigenvalue = 0.0; ///< of the contact compliance, relative to its largest; > 0
  double violation = 0.0;           ///< greatest remaining penetration of a free cell [m]
};

/// The body's answer to the forces of a contact: what deformation and drawing need.
struct ContactResponse {
  std::vector<int> touched;         ///< indices into SurfaceCompliance::touchable, ascending
  std::vector<Vec3> loads;          ///< on those nodes' unknowns [N]
};

/// Solves contact on one body. Keeps its work arrays between calls; one object a body, one thread.
class PatchContact {
 public:
  PatchContact(const SurfaceCompliance& compliance, const TouchableSurface& surface,
               const IsotropicMaterial& material);

  /// sigma = spread_factor() * (local spacing at the cells); where it comes from: see the source.
  static double spread_factor();

  /// Every tool's cells on this body together. u at cell k is
  /// sum_l [ S_k C S_l^T + near field ] f_l ; pressed cells: f.direction >= 0, u.direction >= depth,
  /// complementary, no tangential force; held cells: u = displacement.
  void solve(std::span<const ContactCell> cells, ContactSolution& solution,
             ContactResponse& response);

  /// Displacement of the cells under the forces of the last solve, without the near field of the
  /// other cells' self terms: for tests. Size as `cells` of the last solve [m].
  const std::vector<Vec3>& cell_displacements() const { return displacements_; }

 private:
  void spread(const ContactCell& cell, double sigma);

  const SurfaceCompliance& compliance_;
  const TouchableSurface& surface_;
  IsotropicMaterial material_;
  std::vector<Vec3> displacements_;
  MatrixX matrix_, weights_, block_;
  std::vector<int> columns_, column_of_;
};

}  // namespace viscera
