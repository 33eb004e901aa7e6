// Contact of rigid tools with one body through small patches ("cells") at arbitrary places of its
// surface, on the precomputed compliance. Unilateral where a tool presses, with or without
// friction; bilateral where a closed jaw holds.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "kernels/contact/frictional.h"
#include "kernels/contact/patch_contact_state.h"
#include "kernels/contact/stiffness_update.h"
#include "kernels/contact/touchable_surface.h"
#include "kernels/contact/unilateral.h"
#include "kernels/paff/elasticity.h"

namespace viscera {

/// Solves contact on one body. Keeps its work arrays and the last active set between calls; one
/// object a body, one thread. The surface, the compliance and the fields they stand on outlive it.
class PatchContact {
 public:
  using State = PatchContactState;

  PatchContact(const SurfaceCompliance& compliance, const TouchableSurface& surface,
               const IsotropicMaterial& material);

  const State& state() const { return state_; }
  /// Anchors and the update belong to it: anchor() and stiffen() come before. What else is kept is
  /// made again by the first call that needs it.
  void restore(State state);
  /// Whether restore() may take it, with the anchors there are now.
  bool fits(const State& state) const;
  /// Lets go of what is made from the state: the next call makes it again, with the same bits.
  void forget();
  std::size_t memory_bytes() const;  ///< of the state, what is made from it, and anchors; about

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
  const std::vector<Vec3>& cell_displacements() const { return state_.displacements; }

  /// Mean displacement of each cell of the last solve or load per force on each [m/N]; (3 cells) x
  /// (3 cells).
  const MatrixX& cell_response();

 private:
  /// One scalar unknown: the force on a cell along a unit vector.
  struct Unknown {
    int cell;
    Vec3 direction;
  };

  using Place = State::Place;
  using Way = State::Way;
  struct Anchors;

  bool remember_places(std::span<const ContactCell> cells);
  bool ends_in_anchors(std::span<const Place> places) const;
  void couple_anchors();
  std::size_t moving_cells() const;  ///< of the last see_places: those before the anchors
  bool remember_ways(std::span<const ContactCell> cells, const MatrixX& backing);
  void make_response();
  void make_columns();
  void spread_cells(std::span<const Place> places);
  void gather_compliance();
  double stiffness_about(const Vec3& position, const std::vector<LoadShare>& shares) const;
  void take_off_blocks();
  void compress_weights();
  void couple_cells();
  void couple_nearby();
  void list_unknowns();
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
  State state_;

  // What follows from the state's places; `at_hand_`: is made.
  bool at_hand_ = false;
  bool anchored_ = false;  // the last cells are the anchors
  std::vector<NearField> near_fields_;
  std::vector<double> stiffness_;  // of the tissue about each cell, over sound tissue's
  int beyond_touchable_ = 0;
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
  std::vector<float> cell_columns_;  // C S^T: rows x (3 cells), where the patch has stayed
  std::size_t columns_made_ = 0;     // of those that count as built

  // And from its ways; `matrix_at_hand_`: is made.
  bool matrix_at_hand_ = false;
  bool same_matrix_ = false;  // as in the last solve
  std::vector<Unknown> unknowns_;
  std::vector<char> bilateral_;
  std::vector<ContactCondition> conditions_;
  MatrixX backing_, matrix_;
  double lifted_share_ = 0.0;
  std::vector<int> measured_;  // with friction: unknowns whose smallest eigenvalue is known
  double measured_eigenvalue_ = 1.0;

  /// Their work arrays; nothing in them outlasts a solve.
  struct Solvers {
    Eigen::LLT<MatrixX> whole_factor;
    UnilateralSolver unilateral;
    FrictionSolver frictional;
  };
  std::optional<Solvers> solvers_;  // from the first solve on
  VectorX wanted_;
};

}  // namespace viscera
