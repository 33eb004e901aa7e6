// Contact on tissue at finite strain (kernels/finite): the conditions and their solvers are those
// of every body (tissue_contact.h), solved between the quasi-Newton steps of a frame.
//
// Cells load the same places as on a prepared compliance, and what is finer than places is the same
// near field, turned with the tissue about them. Two factors answer: that of a step (stiff against
// what is quick, by mass and viscosity) within it; that of the body at rest between steps, for what
// a hand and the next step's search meet.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "kernels/contact/cell_answers.h"
#include "kernels/contact/column_sums.h"
#include "kernels/contact/patch_contact.h"
#include "kernels/contact/surface_places.h"
#include "kernels/finite/finite_solver.h"
#include "kernels/finite/tangent_answer.h"

namespace viscera {

/// What a body at finite strain answers by; all of it outlives the contact.
struct FiniteResponse {
  const SurfaceCompliance& still;  ///< of the body at rest, with columns for all of `surface`
  /// Of FiniteSolver::factor; after the rows of the places one for each node's unknowns.
  const SurfaceCompliance& step;
  const TouchableSurface& surface;
  const SurfacePlaces& places;
  const FiniteSolver& solver;
  /// Forces on the nodes per way of each hold that moves, along x, y, z (3 N x 3 holds) [N/m]
  const MatrixX& moved_holds;
};

class FiniteContact final : public PatchContact, private FiniteTouch {
 public:
  FiniteContact(const FiniteResponse& body, const IsotropicMaterial& material);

  TissueAbilities abilities() const override {
    return {.springs = true, .stiffens = true, .moves = true};
  }
  bool fits(const State& state) const override;

  /// From now on this is the body that another one was, as after a cut: it moves on as that did.
  void go_on_from(const FiniteContact& before, const Continuation& continuation);

  /// Nothing is put together: the body is another one at each step.
  void anchor(std::span<const ContactCell>) override {}

  /// The energy follows; so do near fields.
  void stiffen(std::shared_ptr<const StiffnessUpdate> update) override;

  void begin_step(const StepDrive& drive) override;
  bool moving() const override;
  const FiniteStep* last_step() const override { return &told_; }
  /// What the last solve's forces have stored under its cells in what is finer than places [J]; the
  /// body's own energy (FiniteBody::energy) knows nothing of it. Of tissue without a memory.
  double near_energy() const;
  /// How often a hand was answered by the body at rest, since the tangent isn't positive.
  std::size_t tangents_refused() const { return tangents_refused_; }

  void solve(std::span<const ContactCell> cells, ContactSolution& solution,
             ContactResponse& response, const MatrixX& backing = {}) override;
  std::unique_ptr<SharedSolve> share(std::span<const ContactCell> cells, std::size_t own,
                                     ContactSolution& solution, ContactResponse& response) override;
  std::optional<OthersHold> hold_of_others(std::span<const ContactCell> cells, std::size_t begin,
                                           std::size_t end, const MatrixX& shares) override;

  void place_displacements(const ContactResponse& response,
                           std::vector<float>& displacements) override;
  std::vector<Vec3> beside_places(std::size_t begin, std::size_t end) const override;
  void draw(std::span<const float> displacements, std::span<const ContactCell> cells,
            const ContactSolution& solution, std::vector<Vec3f>& positions) const override;

 private:
  /// Cells whose nodes meet, as those of one tool: they are turned as one.
  struct Group {
    std::vector<int> cells;
    int first_node = 0;
    Mat3 rotation = Mat3::Identity();
  };

  class Share;
  /// Before a step on these cells, and after.
  void begin_solve(std::span<const ContactCell> cells, std::size_t own, bool shared,
                   ContactSolution& solution, ContactResponse& response);
  void end_solve(std::size_t cells);
  /// The cells as this question asks for them, and `response_` as it has that.
  void pose(const TouchQuestion& question);
  void note_changes();
  void make_response() override;
  void drop_response() override;
  MatrixX taken_by_update(std::size_t begin, std::size_t end) const override;
  std::optional<MatrixX> lost_by_strain(std::size_t begin, std::size_t end, const MatrixX& shares,
                                        const Holding& holding, const MatrixX& by_hold) override;
  std::optional<TangentAnswer> answer_at_foot(std::size_t begin, std::size_t end,
                                              const MatrixX& shares, const HeldBody& held);
  HeldBody held_body(const Holding& holding, std::size_t begin, std::size_t end,
                     const MatrixX& shares, const MatrixX& near) const;
  VectorX moved_cells(const VectorX& u) const;
  MatrixX answers_to(const MatrixX& forces) const;
  MatrixX coupled_by_step();
  MatrixX coupled_by_basis(Eigen::Index a, Eigen::Index b) const;
  void gather_nodes();
  void gather_offsets();
  void gather_groups();
  void list_answers();
  MatrixX turned(const MatrixX& response) const;
  void turn_into(const MatrixX& response, MatrixX& turned) const;
  void relax();
  VectorX in_one(std::span<const Vec3> ways) const;
  void pull_by_holds(const VectorX& ways);
  double energy_left_behind() const;
  double energy_of_holds(const VectorX& ways) const;
  void pull_at_once();
  void relax_holds();
  bool is_driven() const;
  void remember_cells();
  std::vector<Vec3> without_relaxation(std::span<const Vec3> forces) const;
  bool remembers() const {
    return !state_.remembered.empty() &&
           state_.remembered.size() == terms().size() * state_.places.size();
  }
  const std::vector<SteppedTerm>& terms() const { return body_.solver.terms(); }
  /// Whether what meets a cell yields: the end of a spring, another body.
  bool yields(std::size_t cell) const { return cell >= own_; }
  const Mat3& rotation_of_cell(std::size_t cell) const;
  ColumnTriples nodal_columns() const;

  std::size_t cells() const override { return cells_.size(); }
  std::int32_t held() const override;
  std::span<const int> groups() const override {
    return cells_.empty() ? ungrouped_ : group_of_node_;
  }
  const ChangedTissue& changed() const override { return changed_; }
  void turn(const NodalRotations& rotations) override;
  const MatrixX& response() const override { return turned_step_; }
  const Overstress& overstress() const override { return overstress_; }
  VectorX displaced(const VectorX& u) const override;
  VectorX answer_to(const VectorX& forces) const override;
  void add_loads(const VectorX& forces, VectorX& loads) const override;
  std::optional<VectorX> standing() const override;
  double begin(const VectorX& displaced) override;
  std::optional<VectorX> solve(const TouchQuestion& question) override;

  FiniteResponse body_;
  std::vector<Mat3> whole_pulls_;  // of each hold that moves: its forces' sum per way [N/m]
  StepDrive drive_;
  BodyLoad load_;
  ChangedTissue changed_;
  // Where the step began.
  FiniteState start_;
  std::vector<Place> start_places_;
  std::vector<Vec3> start_displacements_, start_forces_, start_remembered_;
  Overstress overstress_;
  std::size_t tangents_refused_ = 0;
  bool relaxed_ = false;  // the memory has gone on by the last step
  VectorX near_loads_;    // of what is finer than places, that are still felt; empty: none
  // Where it has come, if anything touched it, and on which cells.
  std::optional<StepSoFar> so_far_;
  std::vector<Place> so_far_places_;
  FiniteStep told_;

  // What follows from the state's places; seen from the tissue, unturned.
  MatrixX still_, step_, near_;  // responses (3 cells) x (3 cells)
  std::vector<int> nodes_;       // that cells reach, ascending                             (n)
  MatrixX fields_;               // of these nodes at the cells                      (cells x n)
  /// From the mean place of what a cell's fields move to the cell's own, at rest: in a piece that
  /// turns freely it turns with that. Empty: all is held.                             (cells)
  std::vector<Vec3> beside_;
  std::vector<Group> groups_;
  std::vector<int> group_of_cell_, group_of_node_;
  std::vector<int> ungrouped_;  // of a body without cells                                   (N)
  MatrixX shares_;              // of touched places in the cells                   (cells x m)
  TouchedCompliance step_on_touched_;
  /// What forces on cells do to the nodes, by a step's factor (3 N x 3 each); made as they are
  /// asked for.
  mutable CellAnswers answers_;
  // And from the rotations of this step.
  NodalRotations rotations_;
  MatrixX turned_step_, turned_near_;  // near: as the step meets it
  VectorX near_before_;                // where what is finer lies without forces; empty: at rest
  bool stands_ = false;                // `response_` and the matrix are those between steps

  // Of the solve that is under way.
  std::span<const ContactCell> cells_;
  std::size_t own_ = 0;      // of them that meet what doesn't yield
  MatrixX backing_;          // of the others
  std::vector<Vec3> begun_;  // where they were
  std::vector<ContactCell> asked_;
  ContactSolution* solution_ = nullptr;
  ContactResponse* answer_ = nullptr;
};

}  // namespace viscera
