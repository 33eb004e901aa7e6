// Point collocation: the equations of equilibrium at the nodes themselves, without integration
// ([De2006] eq. 6-10). What all strong forms share; they differ in how they take derivatives.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "kernels/paff/elasticity.h"

namespace viscera {

/// Value and derivatives at one node of a field given by its nodal unknowns, as weights on them:
/// u(x_i) = sum_j values[j] alpha_nodes[j], and so on.
struct NodeStencil {
  std::vector<int> nodes;
  std::vector<double> values;   ///<                                                     (m)
  std::vector<Vec3> gradients;  ///< [1/m]                                               (m)
  std::vector<Mat3> hessians;   ///< symmetric [1/m2]                                    (m)

  void resize(std::size_t count);
};

/// Fills the stencil of a node; fails, saying what to change, where it has none. Called from
/// several threads at once.
using NodeStencils = std::function<Result<void>(int node, NodeStencil& out)>;

/// How a strong form differs from another.
struct CollocationRules {
  /// The stencils of a cloud that was found sound; the cloud outlives them.
  std::function<NodeStencils(const PointCloud& cloud)> stencils;
  /// Traction rows sigma n = t become the balance of the layer between the surface and half the
  /// spacing below, sigma n - d (div sigma + b) = t (finite increment calculus [Onate2001]), d
  /// being the layer's volume over its area. For mean normal n that is |n|^2 h/2: h/2 on a face,
  /// h/4 at a right-angled edge, h/6 at a corner. With h/2 at edges too, the error of a smooth
  /// solution on a cube is twice as large.
  bool stabilised_tractions = false;
};

/// Rows, for unknowns alpha of a body with nodes i, patches of area A_i and volumes V_i:
///   a surface node in the fixed region      u(x_i) = held displacement
///   another surface node                    sigma(x_i) n_i = mean of the traction t(x_i, n)
///   a node inside                           -div sigma(x_i) = b(x_i)
/// n_i being the mean normal of the patch, so that edges are in balance with all their faces. Rows
/// are scaled (tractions by h / (lambda + 2 mu), balance by h^2 / (lambda + 2 mu)) and factored as
/// an unsymmetric matrix.
///
/// The solver's loads [N] at nodes act as F / A_i in a traction row and F / V_i in a balance row,
/// and not at all on held nodes. Its compliance isn't symmetric, and passes
/// as accept_compliance() says for `formulation`, which outlives it. Fails as Formulation::prepare
/// documents.
Result<std::unique_ptr<ElasticSolver>> prepare_collocation(const Formulation& formulation,
                                                           const ElasticProblem& problem,
                                                           const CollocationRules& rules,
                                                           const Progress& progress);

/// The formulation "paper", as published [De2006] eq. 1-10: moving least squares with linear basis
/// and quartic weights, support radius 3 h, collocated at the nodes. Linear fields are exact.
/// Second derivatives of these fields are inconsistent (those of x^2 come out as 0.75 to 1.66
/// instead of 2), so that it doesn't converge, and its compliance need not be positive.
const Formulation& paper_formulation();

/// The formulation "gfdm": generalised finite differences [Liszka1980] [Benito2001]. The
/// derivatives at a node are those of the quadratic Taylor expansion about it that takes the node's
/// own displacement and fits, weighted, its 40 or more nearest neighbours; traction rows are
/// stabilised. Exact for quadratic fields inside. Refused above Poisson's ratio 0.45.
const Formulation& gfdm_formulation();

}  // namespace viscera
