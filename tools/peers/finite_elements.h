// The hemisphere by finite elements: meshed by gmsh, solved by CalculiX, both as separate programs.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "engine/verification/hemisphere_reference.h"
#include "kernels/base/result.h"

namespace viscera {

/// Tetrahedra of four or ten nodes in the unit hemisphere. Nodes of an element: corners, then the
/// middles of edges 01, 12, 20, 03, 13, 23.
struct TetrahedralMesh {
  std::vector<Vec3> nodes;                    ///< over R
  std::vector<std::array<int, 10>> elements;  ///< the first four, or all
  bool quadratic = false;
  std::vector<std::array<int, 3>> dome;  ///< triangles that cover the curved surface
  std::size_t surface_nodes = 0;
  double mesh_s = 0.0;  ///< wall time of gmsh
};

struct MeshOptions {
  bool quadratic = false;
  double finest = 0.1;     ///< edge, over R
  double slope = 0.0;      ///< growth of the edge away from 0.3 R about the pole; 0: uniform
  double coarsest = 0.25;  ///< edge, over R
  double contact = 0.0;    ///< radius over R of a circle of edges on the dome; 0: the mesh knows
                           ///< nothing of the contact
};

/// True where both programs are in the PATH.
bool finite_elements_installed();

/// Runs gmsh in `folder`.
Result<TetrahedralMesh> mesh_hemisphere(const MeshOptions& options,
                                        const std::filesystem::path& folder);

struct FiniteElementAnswer {
  double force_over_ERdelta = 0.0;
  std::vector<Vec3> displacements;  ///< of the nodes, over R
  double process_s = 0.0;           ///< wall time of CalculiX, input to output
  /// What CalculiX itself says a further solution takes in one process: stiffness, factor, solution
  /// and stresses, without start, input and output.
  std::optional<double> own_s;
  std::size_t peak_memory_bytes = 0;
};

enum class CalculixSolver { kSpooles, kIterativeCholesky };

/// Stuck contact: surface nodes within a of the axis are moved down by the reference's depth, the
/// base is held. The solution is timed once more by a job of several such steps.
Result<FiniteElementAnswer> solve_calculix(const TetrahedralMesh& mesh, double poisson_ratio,
                                           double a_over_R, CalculixSolver solver,
                                           const std::filesystem::path& folder);

/// Relative L2 distance from the profile over the area of the dome.
double dome_error(const TetrahedralMesh& mesh, const std::vector<Vec3>& displacements,
                  const HemisphereProfile& reference);

/// Nodes of the dome within a of the axis, ascending.
std::vector<int> patch_nodes(const TetrahedralMesh& mesh, double a_over_R);
/// Nodes of the flat base, rim included, ascending.
std::vector<int> base_nodes(const TetrahedralMesh& mesh);

}  // namespace viscera
