// Contact of rigid tools with one body through small patches ("cells") at arbitrary places of its
// surface, on the precomputed compliance. Unilateral where a tool presses, with or without
// friction; bilateral where a closed jaw holds.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "kernels/contact/frictional.h"
#include "kernels/contact/near_field.h"
#include "kernels/contact/stiffness_update.h"
#include "kernels/contact/touchable_surface.h"
#include "kernels/contact/unilateral.h"
#include "kernels/paff/elasticity.h"

namespace viscera {

/// A small patch of surface that a tool presses or holds as a whole.
struct ContactCell {
  Vec3 position = Vec3::Zero();  ///< rest, on the surface [m]
  Vec3 normal = Vec3::UnitZ();   ///< outward unit surface normal
  double area = 0.0;             ///< [m2]
  bool held = false;             ///< false: pressed, can only be pushed

  Vec3 direction = -Vec3::UnitZ();  ///< pressed: unit, the way the tool pushes
  double depth = 0.0;  ///< pressed: u . direction >= depth wanted [m]; may be negative (a gap)
  /// Held: u wanted [m]. Pressed with friction: the part of it across `direction` is the u that
  /// keeps the cell where it clings to the tool, zero where the tool first touched it.
  Vec3 displacement = Vec3::Zero();
  /// u where no force acts, which the forces add to: what gravity has moved the body [m].
  Vec3 free = Vec3::Zero();
  /// Pressed: coefficient of Coulomb friction. Where the cell slips it clings to another place of
  /// the tool: for the next step add ContactSolution::slips to `displacement`.
  double friction = 0.0;
};

struct ContactSolution {
  std::vector<Vec3> forces;  ///< on the tissue, per cell [N]              (cells)
  std::vector<Vec3> slips;   ///< how far each cell with friction is from `displacement`, across
                             ///< `direction` [m]; 0 where it sticks             (cells)
  std::vector<NearField> near_fields;  ///< of each cell: what is finer than nodes   (cells)
  int touching = 0;                    ///< cells with force
  int beyond_touchable = 0;            ///< cells with no touchable surface in reach; they load the
                                       ///< nearest sample
  int pivots = 0;                      ///< exchanges of the active set; rounds, with friction
  bool converged = false;  ///< false: no forces. A cell isn't finite, has no area or a negative
                           ///< friction; the compliance isn't positive; or, with friction or an
                           ///< unsymmetric compliance, no solution was found
  double smallest_eigenvalue = 0.0;  ///< of the touching cells' compliance (its symmetric half),
                                     ///< relative to its largest; > 0 where C is symmetric
  double lifted = 0.0;               ///< greatest eigenvalue added to make the compliance positive,
                                     ///< relative to its largest; 0 but for tools of several
                                     ///< sizes at one spot, and around edges
  double residual = 0.0;             ///< with friction: greatest violation of a condition, as a
                                     ///< force over the greatest one
  double violation = 0.0;            ///< greatest remaining penetration of a free cell [m]
};

/// The body's answer to the forces of a contact: what deformation and drawing need.
struct ContactResponse {
  std::vector<int> touched;  ///< indices into SurfaceCompliance::touchable, ascending
  std::vector<Vec3> loads;   ///< on those places [N]
};

/// Solves contact on one body. Keeps its work arrays and the last active set between calls; one
/// object a body, one thread. The surface, the compliance and the fields they stand on outlive it.
class PatchContact {
 public:
  PatchContact(const SurfaceCompliance& compliance, const TouchableSurface& surface,
               const IsotropicMaterial& material);

  /// sigma = spread_factor() * (local spacing at the cell); where it comes from: see the source.
  static double spread_factor();

  /// Held cells that never move over the body, as the ends of springs: what they do to every place
  /// and to each other is put together here, once. Wherever a later solve's last cells are these,
  /// with `backing`, they cost a product with the other cells' weights.
  void anchor(std::span<const ContactCell> cells);

  /// From now on the body is stiffer by this (null: as it was prepared): its compliance, and the
  /// near field about each cell by the tissue there. Only for a symmetric compliance.
  void stiffen(std::shared_ptr<const StiffnessUpdate> update);
  const StiffnessUpdate* update() const { return update_.get(); }

  /// Every tool's cells on this body together. u at cell k is
  /// free_k + sum_l [ S_k C S_l^T + near field ] f_l ; pressed cells: f.direction >= 0, u.direction
  /// >= depth, complementary, the tangential force within the cone of friction and against the
  /// slip; held cells: u = displacement. What holds the last cells may yield: `backing`, symmetric,
  /// (3 n) x (3 n) for the last n cells, all held, is what it gives way under their forces [m/N];
  /// for these u + backing f = displacement.
  void solve(std::span<const ContactCell> cells, ContactSolution& solution,
             ContactResponse& response, const MatrixX& backing = {});

  /// The body under these forces on its cells [N], with no condition asked: what the last solve
  /// found, with some of the forces replaced, or forces known from elsewhere. Fills what the forces
  /// alone decide of `solution`, and `response`.
  void load(std::span<const ContactCell> cells, std::span<const Vec3> forces,
            ContactSolution& solution, ContactResponse& response);

  /// Displacements of all places under the last solve's forces, as the function of that name
  /// (deformation.h) gives them from its response, up to round-off of the sums. While the same
  /// patch stays where it is, the columns of its cells are put together, a few a call, and then
  /// replace those of the places under it where that is fewer to read.
  void place_displacements(std::vector<float>& displacements);

  /// Mean displacement of each cell under the forces of the last solve, `free` with it [m]; size as
  /// its `cells`.
  const std::vector<Vec3>& cell_displacements() const { return displacements_; }

  /// Mean displacement of each cell of the last solve or load per force on each [m/N]; (3 cells) x
  /// (3 cells).
  const MatrixX& cell_response() const { return response_; }

 private:
  /// One scalar unknown: the force on a cell along a unit vector.
  struct Unknown {
    int cell;
    Vec3 direction;
  };

  /// Where a cell is: all that its response depends on.
  struct Place {
    Vec3 position, normal;
    double area;
    bool operator==(const Place&) const = default;
  };
  /// What turns the response into equations.
  struct Way {
    Vec3 direction;
    double friction;
    bool held;
    bool operator==(const Way&) const = default;
  };

  struct Anchors;

  bool remember_places(std::span<const ContactCell> cells);
  bool ends_in_anchors(std::span<const ContactCell> cells) const;
  void couple_anchors(std::span<const ContactCell> cells);
  std::size_t moving_cells() const;  ///< of the last see_places: those before the anchors
  bool remember_ways(std::span<const ContactCell> cells, const MatrixX& backing);
  void build_columns();
  void spread_cells(std::span<const ContactCell> cells);
  void gather_compliance();
  double stiffness_about(const Vec3& position, const std::vector<LoadShare>& shares) const;
  void take_off_blocks();
  void compress_weights();
  void couple_cells();
  void couple_nearby(std::span<const ContactCell> cells);
  void list_unknowns(std::span<const ContactCell> cells);
  void assemble(const MatrixX& backing);
  void see_places(std::span<const ContactCell> cells, bool one_of_several);
  void apply_forces(std::span<const ContactCell> cells, ContactSolution& solution,
                    ContactResponse& response);
  void set_wanted(std::span<const ContactCell> cells);
  void solve_conditions(ContactSolution& solution);
  void measure(std::span<const ContactCell> cells, ContactSolution& solution);
  void lift();

  IsotropicMaterial material_of(double stiffness) const;
  void take_off_columns(std::span<const double> weights, float* columns) const;

  const SurfaceCompliance& compliance_;
  const TouchableSurface& surface_;
  IsotropicMaterial material_;
  std::shared_ptr<const StiffnessUpdate> update_;

  std::shared_ptr<const Anchors> anchors_;
  bool anchored_ = false;  // the last solve's last cells are the anchors

  std::vector<Place> places_;  // of the last solve's cells
  std::vector<Way> ways_;
  MatrixX backing_;
  std::vector<NearField> near_fields_;
  std::vector<double> stiffness_;  // of the tissue about each cell, over sound tissue's
  int beyond_touchable_ = 0;
  bool same_matrix_ = false;  // as in the last solve

  std::vector<int> touched_;                    // touchable places under the cells, ascending (m)
  std::vector<int> gathered_;                   // those whose compliance block is at hand
  std::vector<int> local_of_;                   // touchable place -> index in touched_, or -1
  std::vector<std::vector<LoadShare>> spread_;  // per cell
  MatrixX weights_;                             // S: cells x m
  MatrixX basis_, coefficients_;                // S ~ coefficients (cells x r) basis (r x m)
  // Components xx, xy, xz, yx, ... of C on touched places, m x m each; yx, zx and zy stay empty
  // where C is symmetric, being the transposes of xy, xz and yz.
  std::array<Eigen::MatrixXf, 9> block_;
  MatrixX response_;  // mean displacement of each cell per force on each: (3 cells) x (3 cells)

  std::vector<Unknown> unknowns_;
  MatrixX matrix_;
  double lifted_share_ = 0.0;
  MatrixX lifted_;  // what was added to make it positive; empty: nothing
  Eigen::LLT<MatrixX> whole_factor_;
  VectorX wanted_, amounts_;
  std::vector<char> bilateral_, active_;
  UnilateralSolver unilateral_;
  std::vector<ContactCondition> conditions_;
  FrictionSolver frictional_;
  std::vector<int> measured_;  // with friction: unknowns whose smallest eigenvalue is known
  double measured_eigenvalue_ = 1.0;
  std::vector<Vec3> displacements_;

  ContactResponse response_of_forces_;
  std::vector<Vec3> forces_;
  std::vector<float> cell_columns_;  // C S^T: rows x (3 cells), where the patch has stayed
  std::size_t columns_built_ = 0;    // cells
  int stayed_ = 0;                   // solves in a row at these places; several of one frame that
  bool counted_ = false;             // are told as such count once
};

}  // namespace viscera
