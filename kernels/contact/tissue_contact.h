// Contact of rigid tools with one body through small patches ("cells") at arbitrary places of its
// surface: unilateral where a tool presses, with or without friction; bilateral where a closed jaw
// or a spring holds. The same conditions and the same solvers for every kind of body; how a body
// answers forces on its cells is what its kind brings (PatchContact: a prepared compliance;
// HiveContact: hives alone; FiniteContact: tissue at finite strain, which has a motion of its own).
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "kernels/contact/frictional.h"
#include "kernels/contact/shared_solve.h"
#include "kernels/contact/tissue_contact_state.h"
#include "kernels/contact/unilateral.h"

namespace viscera {

struct FiniteStep;
struct StiffnessUpdate;

/// What a kind of tissue can do beyond being pressed and held; who needs more asks first.
struct TissueAbilities {
  bool springs = false;   ///< other bodies may hang on it by springs (`backing`, anchors)
  bool shapes = false;    ///< it has places whose displacement without forces may be given
  bool stiffens = false;  ///< it follows tissue that stiffens
  bool moves = false;     ///< it has a motion of its own: it swings, sags, and comes to rest
};

/// The body as some of its cells meet it while everything else that touches it stays in touch.
struct OthersHold {
  /// Mean displacement of these cells if they weren't loaded; where sums were asked for, as the
  /// response less what is taken has it [m]                                               (m)
  std::vector<Vec3> free;
  /// Tissue right about the cells may have stiffened since the body was prepared. The logarithm of
  /// its modulus over what that was, put together by shares (c), and the bounds that this keeps to.
  /// Empty: it hasn't.
  VectorX stiffer;
  double least = 0.0, most = 0.0;
  /// What else is taken from these cells' response as prepared, less what is given, once that has
  /// been divided, between two cells, by the root of both moduli: by the others' hold, by strain,
  /// by tissue that has stiffened farther off. Put together by shares, symmetric [m/N];
  /// (3 c) x (3 c). Empty: nothing is.
  MatrixX taken;
  /// Of that what belongs to the division. Empty: nothing has stiffened there.
  MatrixX divided;
};

/// One object a body, one thread. Keeps its work arrays and the last active set between calls.
class TissueContact {
 public:
  using State = TissueContactState;

  virtual ~TissueContact() = default;

  virtual TissueAbilities abilities() const = 0;
  /// Whether tools may press it at `place` (rest, on the surface) [m].
  virtual bool touchable(const Vec3& place) const = 0;

  /// Held cells that never move over the body, as the ends of springs: what they do may be put
  /// together here, once. Part of the state: before restore().
  virtual void anchor(std::span<const ContactCell>) {}
  /// From now on the body is stiffer by this (null: as it was). Where `abilities` say so. Part of
  /// the state: before restore().
  virtual void stiffen(std::shared_ptr<const StiffnessUpdate>) {}
  virtual const StiffnessUpdate* update() const { return nullptr; }

  /// What moves a body at finite strain besides what touches it.
  struct StepDrive {
    Vec3 acceleration = Vec3::Zero();  ///< of its weight [m/s2]
    double swelling = 0.0;             ///< of all of it: length gained over length
    std::vector<Vec3> holds;           ///< how far each that moves has; empty: none does [m]
    std::vector<Vec3> holds_before;    ///< the same as the step begins [m]
  };
  /// From now on solves are of the next step. Of one step any number may be asked for: each begins
  /// where the last step ended.
  virtual void begin_step(const StepDrive&) {}
  /// Whether its shape may change though nothing touches it: a solve without cells then goes on.
  virtual bool moving() const { return false; }
  /// How the last solve's step went; null: it has no motion of its own.
  virtual const FiniteStep* last_step() const { return nullptr; }

  /// Every tool's cells on this body together. u at cell k is free_k + sum_l response_kl f_l ;
  /// pressed cells: f.direction >= 0, u.direction >= depth, complementary, the tangential force
  /// within the cone of friction and against the slip; held cells: u = displacement. What holds the
  /// last cells may yield: `backing`, symmetric, (3 n) x (3 n) for the last n cells, is what it
  /// gives way under their forces [m/N]; for these u + backing f stands in place of u.
  virtual void solve(std::span<const ContactCell> cells, ContactSolution& solution,
                     ContactResponse& response, const MatrixX& backing = {});

  /// The same with forces from elsewhere: the first `own` cells ask for what they say, the others
  /// meet what yields. Cells and both answers outlive it; nothing else is asked of the body
  /// meanwhile. Null: a cell isn't sound.
  virtual std::unique_ptr<SharedSolve> share(std::span<const ContactCell> cells, std::size_t own,
                                             ContactSolution& solution, ContactResponse& response);

  /// The body under these forces on its cells [N], with no condition asked: what the last solve
  /// found, with some of the forces replaced, or forces known from elsewhere. Fills what the forces
  /// alone decide of `solution`, and `response`.
  void load(std::span<const ContactCell> cells, std::span<const Vec3> forces,
            ContactSolution& solution, ContactResponse& response);

  /// Mean displacement of each cell under the forces of the last solve, `free` with it [m]; size as
  /// its `cells`.
  const std::vector<Vec3>& cell_displacements() const { return state_.displacements; }

  /// Mean displacement of each cell of the last solve or load per force on each [m/N]; (3 cells) x
  /// (3 cells).
  const MatrixX& cell_response();

  /// How far each of the last solve's cells [begin, end) lies beside the mean of the places whose
  /// mean displacement is its own, where it doesn't turn as these do: what turns a cell by itself
  /// must turn that with it [m]. Empty: none does, or there was no solve.
  virtual std::vector<Vec3> beside_places(std::size_t /*begin*/, std::size_t /*end*/) const {
    return {};
  }

  /// Of the last solve's cells [begin, end), one tool's: what they would meet alone. Cells that
  /// are held, and pressed ones that touch, stay as they are: the body's answer is linear about
  /// this moment. Of what is taken only c sums over the cells are found, each with its `shares` of
  /// their displacements; c x m. Nothing where there was no solve.
  virtual std::optional<OthersHold> hold_of_others(std::span<const ContactCell> cells,
                                                   std::size_t begin, std::size_t end,
                                                   const MatrixX& shares);

  /// Displacements of the places of the surface under the last solve's forces, which `response`
  /// holds [m]; none where its kind has no places.                                    (3 places)
  virtual void place_displacements(const ContactResponse& response,
                                   std::vector<float>& displacements) = 0;
  /// The drawn surface where places are moved by `displacements` and the cells by the last solve's
  /// forces [m].                                                                             (V)
  virtual void draw(std::span<const float> displacements, std::span<const ContactCell> cells,
                    const ContactSolution& solution, std::vector<Vec3f>& positions) const = 0;

  const State& state() const { return state_; }
  /// What is made from the state is made again by the first call that needs it.
  void restore(State state);
  /// Whether restore() may take it.
  virtual bool fits(const State& state) const = 0;
  /// Lets go of what is made from the state: the next call makes it again, with the same bits.
  void forget();

 protected:
  using Place = State::Place;
  using Way = State::Way;

  /// `symmetric`: forces and displacements may change places.
  explicit TissueContact(bool symmetric) : symmetric_(symmetric) {}
  /// Fills `response_`, `near_fields_` and `beyond_touchable_` for the state's places.
  virtual void make_response() = 0;
  /// The state's places are others than before.
  virtual void places_changed() {}
  /// After restore() and forget(): drops what follows from the state's places.
  virtual void drop_response() {}
  /// What an update has taken from the response of the state's cells [begin, end), as `response_`
  /// is turned: (3 m) x (3 m) [m/N]; empty: there is none.
  virtual MatrixX taken_by_update(std::size_t /*begin*/, std::size_t /*end*/) const { return {}; }
  /// Modulus of the tissue about each of the state's cells over that before the update; empty:
  /// there is none.
  virtual std::span<const double> moduli_by_update() const { return {}; }
  /// One scalar unknown: the force on a cell along a unit vector.
  struct Unknown {
    int cell;
    Vec3 direction;
  };
  /// What holds a body while one tool asks: unknowns of other cells, and how these answer each
  /// other in `response_`, with what yields.
  struct Holding {
    std::vector<Unknown> ways;
    MatrixX response;
  };
  /// Of a deformed body: all that the response of cells [begin, end) has lost since `response_` was
  /// theirs, put together by shares. `by_hold`: what the others' hold takes from that; may be
  /// empty. Nothing: it is as `response_` says.
  virtual std::optional<MatrixX> lost_by_strain(std::size_t /*begin*/, std::size_t /*end*/,
                                                const MatrixX& /*shares*/,
                                                const Holding& /*holding*/,
                                                const MatrixX& /*by_hold*/) {
    return std::nullopt;
  }
  /// What the cells' forces do to the body: the state's response, and the caller's.
  virtual void spread_forces(std::span<const Vec3> forces, ContactResponse& response) = 0;
  /// Stands for cells that aren't sound.
  virtual NearField any_near_field() const = 0;

  /// Forces that were found elsewhere, as if a solve had found them: for cells that lie at
  /// ContactCell::free without them. Null: there were none.
  void take(std::span<const ContactCell> cells, const VectorX* forces, const MatrixX& backing,
            ContactSolution& solution, ContactResponse& response);
  /// Whether all cells are; else there is no answer to them.
  bool begin_answer(std::span<const ContactCell> cells, ContactSolution& solution,
                    ContactResponse& response);
  /// Remembers the cells, and makes what depends on their places alone. `shared`: as the state's.
  void see_places(std::span<const ContactCell> cells, bool one_of_several, bool shared = false);
  /// Where they are at hand, that is all.
  void ensure_response();
  /// `response_` is another one for the same places: the next solve makes its matrix of it.
  void response_changed() { matrix_at_hand_ = false; }
  /// The matrix of the last solve's conditions, of `response_` as it is now.
  void remake_matrix();
  /// The body is another one since: neither places nor conditions hold.
  void forget_conditions();
  std::size_t conditions_memory_bytes() const;

  State state_;
  bool at_hand_ = false;  // response_ and the next two are made
  std::vector<NearField> near_fields_;
  int beyond_touchable_ = 0;
  MatrixX response_;  // mean displacement of each cell per force on each: (3 cells) x (3 cells)

 private:
  class PreparedShare;
  bool remember_places(std::span<const ContactCell> cells);
  bool remember_ways(std::span<const ContactCell> cells, const MatrixX& backing);
  void list_unknowns();
  void assemble(const MatrixX& backing);
  void lift();
  void set_wanted(std::span<const ContactCell> cells);
  void solve_conditions(ContactSolution& solution);
  void apply_forces(std::span<const ContactCell> cells, ContactSolution& solution,
                    ContactResponse& response);
  void measure(std::span<const ContactCell> cells, ContactSolution& solution);
  std::vector<int> held_by_others(std::span<const ContactCell> cells, std::size_t begin,
                                  std::size_t end) const;
  MatrixX as_stiffened(std::size_t begin, std::size_t end, const MatrixX& shares,
                       const MatrixX& fields, OthersHold& hold) const;

  bool symmetric_;
  // What follows from the state's ways; `matrix_at_hand_`: is made.
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
