// The elastic problem of one body and the interface that every formulation fills.
#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/base/progress.h"
#include "kernels/base/result.h"
#include "kernels/base/zeroed_pages.h"
#include "kernels/paff/columns_on_demand.h"
#include "kernels/paff/fibres.h"
#include "kernels/paff/shape_functions.h"
#include "kernels/points/cloud.h"
#include "kernels/points/surface.h"

namespace viscera {

struct IsotropicMaterial {
  double youngs_modulus = 0.0;  ///< E [Pa]
  double poisson_ratio = 0.0;

  double shear_modulus() const { return youngs_modulus / (2.0 * (1.0 + poisson_ratio)); }
  double lame_lambda() const {
    return youngs_modulus * poisson_ratio / ((1.0 + poisson_ratio) * (1.0 - 2.0 * poisson_ratio));
  }
  /// E / (1 - nu^2) [Pa]: the modulus of normal contact.
  double contact_modulus() const { return youngs_modulus / (1.0 - poisson_ratio * poisson_ratio); }
};

/// A linear elastic body held on part of its surface, free elsewhere. [De2006] eq. 6-9.
struct ElasticProblem {
  const TriangleSurface* surface = nullptr;  ///< closed, oriented outwards
  const PointCloud* cloud = nullptr;
  IsotropicMaterial material;
  std::function<bool(const Vec3&)> is_fixed;  ///< asked at points of the surface
  /// What eliminating its equations may take [bytes].
  std::size_t most_memory = std::numeric_limits<std::size_t>::max();
  /// Pieces that nothing holds are let be, for a response that needs no hold; their stiffness is
  /// singular. False: they are refused.
  bool may_have_free_pieces = false;
  /// A foundation under the pieces of a body that nothing holds, so much force for each volume and
  /// displacement [N/m3]. What solves stands on it; region and hold (elastic_region.h) don't know
  /// it. 0: none, and such pieces are refused.
  double foundation = 0.0;
  /// Half the quadrature points (SmallCells::kOne), for a response that asks them all each frame.
  bool few_points = false;
  /// Neither stiffness nor factor: the solver knows its region and hold alone (elastic_region.h),
  /// and refuses loads. For large bodies, which are solved otherwise (two_levels.h).
  bool points_alone = false;
  /// Of Formulation::fields, where somebody has made them; null: they are made.
  std::shared_ptr<const ShapeFunctions> fields;
  /// Young's modulus over that of `material`, its mean over a cube of this edge [m] about a place;
  /// Poisson's ratio is one. Null: 1 everywhere. Strong forms don't take it.
  std::function<double(const Vec3& x, double edge)> relative_modulus;
  /// Fibres that it is reinforced by, their mean over such a cube. Null: none. Nor do strong forms
  /// take these.
  std::function<Fibres(const Vec3& x, double edge)> fibres;
};

/// What acts on a body at rest; an empty function means none of it.
struct StaticLoads {
  std::function<Vec3(const Vec3& x)> body_force;                    ///< [N/m3]
  std::function<Vec3(const Vec3& x, const Vec3& normal)> traction;  ///< on the free part [Pa]
  std::function<Vec3(const Vec3& x)> held_displacement;             ///< on the fixed part [m]
};

/// What preparation found out about itself; printed by the report and the benchmarks.
struct PreparationFigures {
  std::size_t unknowns = 0;            ///< 3 N
  std::size_t stiffness_nonzeros = 0;  ///< of K, both triangles
  std::size_t quadrature_points = 0;
  std::size_t twins = 0;  ///< nodes added where fields would reach across air (true_neighbours.h)
  double gradient_correction = 0.0;  ///< relative size of the VCI correction
  double fixed_area = 0.0;           ///< [m2]
  double assemble_s = 0.0, factor_s = 0.0, compliance_s = 0.0;
  std::size_t factor_bytes = 0;
  /// Of the symmetric part of the last compliance's touchable square, relative to its largest; 0
  /// before there is one.
  double smallest_compliance_eigenvalue = 0.0;
};

/// The precomputed response of places on a surface: their displacement per unit force on the
/// touchable ones among them ([De2006] eq. 11, C_un with C_nn in it). A force F at a place p loads
/// unknown J with phi_J(p) F, and the displacement there is sum_J phi_J(p) alpha_J: with Phi the
/// fields at the places, the columns are Phi K^-1 Phi^T, so that reciprocity holds between places.
struct SurfaceCompliance {
  std::size_t places = 0;
  std::vector<int> touchable;  ///< place of each column triple, ascending
  /// Column-major, (3 places) x (3 touchable) [m/N]. Those that aren't made yet are zero, and take
  /// no memory.
  std::vector<float, ZeroedPages<float>> columns;
  /// False: the square of the touchable places isn't its own mirror (strong forms), and must not be
  /// made so: a force could change its sign.
  bool symmetric = true;
  /// Makes columns when they are asked for; null: all are there. It belongs to these columns: a
  /// compliance that has one may be moved, not copied.
  std::shared_ptr<ColumnsOnDemand> on_demand;

  std::size_t rows() const { return 3 * places; }
  /// To be called before columns of these are read, by their indices among the touchable ones.
  /// Makes those that are missing. From any thread.
  void need(std::span<const int> places_needed) const {
    if (on_demand) on_demand->need(places_needed, const_cast<float*>(columns.data()));
  }
  void need_all() const {
    if (on_demand) on_demand->need_all(const_cast<float*>(columns.data()));
  }
  /// Row of each touchable unknown: the rows of the touchable square    (3 touchable).
  std::vector<std::size_t> touchable_rows() const;
};

class StiffnessFactor;

/// A prepared (assembled and factored) body: answers loads, many at a time. Not thread-safe.
class ElasticSolver {
 public:
  virtual ~ElasticSolver() = default;
  /// K alpha = loads in place; `loads` is column-major (3 N x columns), node-major, [N] -> [m].
  virtual Result<void> solve(std::span<double> loads, int columns) = 0;
  /// Nodal unknowns (3 N) [m] under loads given as functions of place.
  virtual Result<std::vector<double>> solve_static(const StaticLoads& loads) = 0;
  /// Rows for all `places`, columns for the `touchable` ones (ascending). `places` holds phi_J at
  /// each place (P rows, columns are nodes). Fails, saying what to change, unless it is positive or
  /// the formulation's warning() says that it isn't to be trusted (see accept_compliance in
  /// compliance_checks.h).
  virtual Result<SurfaceCompliance> compliance(const SparseWeights& places,
                                               std::vector<int> touchable,
                                               const Progress& progress) = 0;
  /// The factor that answers, from which columns can be made later; null where there is none to
  /// keep.
  virtual std::shared_ptr<const StiffnessFactor> factor() const { return nullptr; }
  virtual const PreparationFigures& figures() const = 0;
};

/// How far apart nodes may be that have an entry of the stiffness in common.
struct Coupling {
  double support_factor = 0.0;  ///< rho of the fields
  bool averaged = false;        ///< the dilatation is averaged over cells of several nodes
};

/// A way to discretise the elastic problem; immutable, one object each.
class Formulation {
 public:
  virtual ~Formulation() = default;
  virtual std::string_view name() const = 0;  ///< "galerkin"
  virtual int version() const = 0;  ///< raised when its results change: part of cache keys
  virtual double support_factor() const = 0;  ///< rho: support radius over spacing
  virtual Basis basis() const { return Basis::kLinear; }
  /// True: the nodal unknowns are the displacements at the nodes. False: only sums of fields are.
  virtual bool interpolates() const { return false; }
  /// Materials above it are refused: its error would grow without bound. 0.5: none is.
  virtual double highest_poisson_ratio() const { return 0.5; }
  /// Which nodes of a body of that material its equations couple; for preparation_cost.
  virtual Coupling coupling(const IsotropicMaterial&) const {
    return {.support_factor = support_factor()};
  }
  /// Whether its solver gives a factor() that columns can be made from later.
  virtual bool keeps_factor() const { return false; }
  /// What its user should know, said once; empty: nothing.
  virtual std::string_view warning() const { return {}; }
  /// Whether its fields stay in the tissue (true_neighbours.h), or reach through air.
  virtual bool stays_in_tissue() const { return false; }
  /// The fields that carry displacement to any place, and loads back to the nodes: of these nodes
  /// alone, through air as through tissue.
  ShapeFunctions fields(const PointCloud& cloud) const {
    return ShapeFunctions(cloud, support_factor(), basis());
  }
  /// The same for a body as it was prepared, with the twins of its nodes.
  ShapeFunctions fields(const TriangleSurface& surface, const PointCloud& cloud) const {
    return stays_in_tissue() ? ShapeFunctions(surface, cloud, support_factor(), basis())
                             : fields(cloud);
  }
  /// Fails, saying what to change, for a fixed region that holds no surface, Poisson's ratio
  /// outside [0, 0.5), too few nodes, a singular or indefinite stiffness, or cancellation.
  virtual Result<std::unique_ptr<ElasticSolver>> prepare(const ElasticProblem& problem,
                                                         const Progress& progress) const = 0;
};

/// One-shot: prepare, and solve for one set of loads. Nodal unknowns (3 N) [m].
Result<std::vector<double>> solve_static(const Formulation& formulation,
                                         const ElasticProblem& problem, const StaticLoads& loads);

/// The formulation of that name, or nullptr; `formulation_names` lists those there are.
const Formulation* find_formulation(std::string_view name);
std::vector<std::string> formulation_names();

}  // namespace viscera
