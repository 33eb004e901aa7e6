// Moving-least-squares shape functions: the point-associated finite fields themselves.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "kernels/points/cloud.h"
#include "kernels/points/neighbours.h"
#include "kernels/points/surface.h"

namespace viscera {

class TrueNeighbours;

/// Quartic spline W(s) = 1 - 6 s^2 + 8 s^3 - 3 s^4 for s < 1, else 0. [De2006] eq. 5.
double quartic_weight(double s);
double quartic_weight_derivative(double s);

/// The polynomials that the fields reproduce exactly: 1, x, y, z; or all up to second degree.
enum class Basis { kLinear, kQuadratic };

/// Shape functions at one point: the nodes that reach it, their values and gradients.
struct ShapeValues {
  std::vector<int> nodes;       ///< ascending                                     (m)
  std::vector<double> values;   ///< phi_J(x), sum 1                                (m)
  std::vector<Vec3> gradients;  ///< [1/m]; empty when not asked for                (m)
  std::vector<double> weights;  ///< W_J(x), what a node shares with its twin apart (m)

  /// The node that has most of the place; -1: there are none.
  int strongest() const;
};

/// Number of polynomials in a basis: the fewest nodes that must reach every place.
constexpr int basis_terms(Basis basis) {
  return basis == Basis::kLinear ? 4 : 10;
}

/// The finite fields of a cloud: phi_J(x) = W_J p(x)^T A(x)^-1 p(x_J), basis shifted to x and
/// scaled by h ([De2006] eq. 3-4; [Lancaster1981]). Supports r_J = support_factor * h_J.
class ShapeFunctions {
 public:
  /// Fields that reach through air as through tissue.
  ShapeFunctions(const PointCloud& cloud, double support_factor, Basis basis = Basis::kLinear);
  /// Fields that stay in the tissue (true_neighbours.h), of the nodes and their twins.
  ShapeFunctions(const TriangleSurface& surface, const PointCloud& cloud, double support_factor,
                 Basis basis = Basis::kLinear);

  /// False when the moment matrix at x is singular (too few nodes, or nodes in a plane).
  bool evaluate(const Vec3& x, bool with_gradients, ShapeValues& out) const;

  Basis basis() const { return basis_; }
  double support_radius(int node) const { return radii_[static_cast<std::size_t>(node)]; }
  /// The nodes that carry the fields: the given ones, then the twins where there are some.
  const PointCloud& cloud() const { return cloud_; }
  /// Null where the fields see all that they reach.
  const std::shared_ptr<const TrueNeighbours>& true_neighbours() const { return neighbours_; }

 private:
  ShapeFunctions(std::shared_ptr<const TrueNeighbours> neighbours, const PointCloud& cloud,
                 double support_factor, Basis basis);
  template <int kTerms>
  bool evaluate_with(const Vec3& x, bool with_gradients, ShapeValues& out) const;
  struct Shadows;
  void find_shadows(const Vec3& x, ShapeValues& out, Shadows& shadows) const;
  void share_with_twins(const Vec3& x, const Shadows& shadows, ShapeValues& out) const;

  std::shared_ptr<const TrueNeighbours> neighbours_;
  PointCloud cloud_;
  Basis basis_;
  std::vector<double> radii_;
  InfluenceGrid grid_;
};

/// Shape-function values at many points in compressed rows: the drawn surface carried by the nodes,
/// or contact patches spread over them.
struct SparseWeights {
  std::vector<int> row_begin{0};  ///< (rows + 1)
  std::vector<int> nodes;         ///< column of each entry
  std::vector<float> values;

  std::size_t rows() const { return row_begin.size() - 1; }
};

}  // namespace viscera
