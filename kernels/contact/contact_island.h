// Bodies that touch each other, solved together: one list of conditions on the forces between them,
// on what every body answers to forces on its cells (its Delassus operator). Where bodies have a
// motion of their own, all stop at the same places of their steps (shared_solve.h) and each
// question of theirs is answered for all at once. Whatever joins two bodies is one force, so that
// both feel the same, opposite.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "kernels/contact/contact_sweeps.h"
#include "kernels/contact/frictional.h"
#include "kernels/contact/island_unknowns.h"
#include "kernels/contact/shared_solve.h"
#include "kernels/contact/unilateral.h"
#include "kernels/contact/yielding_joints.h"

namespace viscera {

/// A body of an island.
struct IslandBody {
  SharedSolve* solve = nullptr;
  Mat3 turn = Mat3::Identity();  ///< from its frame to the world
  /// The first cells, which ask for what they say (tools). The others are met by joints alone.
  std::size_t own = 0;
};

/// Where two bodies meet, or one meets what doesn't move: one force f, world, on a cell of the
/// first, -f on one of the second. With s the motion of the first cell beyond the second's, from
/// where both bodies were prepared, s + softness f stands in place of u in the conditions of
/// ContactCell.
struct Joint {
  struct End {
    int body = -1;  ///< of the island; -1: it doesn't move
    int cell = 0;
  };
  std::array<End, 2> ends;
  bool held = false;                 ///< else it can only push
  Vec3 direction = Vec3::UnitZ();    ///< unit, world: the way the first is pushed
  double depth = 0.0;                ///< s . direction >= depth [m]
  Vec3 displacement = Vec3::Zero();  ///< s wanted; with friction where it clings [m]
  double friction = 0.0;             ///< coefficient
  double softness = 0.0;             ///< [m/N]
};

/// Joints [first, first + size of its softness), at least one, between the same two bodies, which
/// are held and have no softness of their own.
struct JointsThatYield {
  std::size_t first = 0;
  YieldingJoints* joints = nullptr;
};

struct IslandFigures {
  int rows = 0;           ///< unknown force components
  int tried = 0;          ///< of them that took part in the last question
  int questions = 0;      ///< that were answered
  int softer = 0;         ///< how often what yields had another softness for an answer
  int pivots = 0;         ///< of the last: exchanges of the active set; rounds, with friction;
                          ///< sweeps, of many bodies
  double residual = 0.0;  ///< with friction, and of many bodies: greatest violation of a condition
                          ///< over the greatest force
  double lifted = 0.0;    ///< as ContactSolution::lifted
  bool converged = true;  ///< false: no forces, each body went without; as where so many touch
                          ///< (6,000 unknowns), and one of them yields, that their matrix would be
                          ///< too great
};

/// Most of what may meet within a frame doesn't. So a question is answered for the parts that had a
/// force or would be violated without one; parts that the answer violates are tried, too, until
/// there are none. Keeps its work arrays between calls.
class ContactIsland {
 public:
  /// `forces` of the joints, on their first end, world [N]: in: those of before, where the search
  /// begins, or none; out: the answer.                                               (joints)
  /// Ends every body's solve.
  IslandFigures solve(std::span<const IslandBody> bodies, std::span<const Joint> joints,
                      std::vector<Vec3>& forces, std::span<const JointsThatYield> yielding = {});

 private:
  /// What is solved for together: one unknown, or the three of a held or rubbing cell.
  struct Part {
    std::size_t first = 0, count = 1;  ///< of its unknowns
    ContactCondition condition;        ///< that of each, or of all three where they rub
    bool tried = false;                ///< whether it takes part in the problem
    bool held() const { return condition.kind == ContactCondition::Kind::kBilateral; }
  };

  void list_unknowns(std::span<const IslandBody> bodies, std::span<const Joint> joints);
  void guess(std::span<const IslandBody> bodies, std::span<const Joint> joints,
             std::span<const Vec3> forces);
  void choose_tried();
  void list_tried();
  void assemble(std::span<const IslandBody> bodies);
  void add_yielding();
  void solve_tried();
  void sweep_tried(std::span<const IslandBody> bodies);
  void take_tried();
  void spread_forces(std::span<const IslandBody> bodies);
  bool try_violated(std::span<const IslandBody> bodies);
  void set_wanted(std::span<const IslandBody> bodies, std::span<const Joint> joints);
  bool decide(std::span<const IslandBody> bodies, std::span<const Joint> joints);
  bool answer(std::span<const IslandBody> bodies);
  Vec3 force_on(std::span<const Joint> joints, std::size_t joint) const;
  bool follow_yielding(std::span<const Joint> joints);
  MatrixX behind(std::span<const IslandBody> bodies, std::span<const Joint> joints,
                 std::size_t body) const;

  std::vector<IslandUnknown> unknowns_;
  std::vector<Part> parts_;
  std::vector<std::size_t> first_of_joint_;
  std::span<const JointsThatYield> yielding_;
  std::vector<char> active_;
  VectorX wanted_, amounts_;
  // The same of the parts that are tried.
  std::vector<std::size_t> tried_;  // unknowns
  std::vector<char> tried_bilateral_, tried_active_;
  std::vector<ContactCondition> tried_conditions_;
  MatrixX matrix_;
  VectorX tried_wanted_, tried_amounts_;
  std::vector<VectorX> forces_;  // on the bodies' cells, in their frames
  UnilateralSolver unilateral_;
  FrictionSolver frictional_;
  ContactSweeps sweeps_;
  std::vector<IslandUnknown> tried_unknowns_;
  IslandFigures figures_;
};

}  // namespace viscera
