#include "kernels/contact/contact_island.h"

#include <Eigen/Cholesky>
#include <algorithm>

#include "kernels/base/parallel.h"
#include "kernels/contact/rise_to_positive.h"

namespace viscera {
namespace {

/// Added to the diagonal, relative, as TissueContact does: two joints may end in one cell.
constexpr double kRidge = 1e-6;
/// A part that doesn't take part isn't violated by less [m].
constexpr double kUnfelt = 1e-9;
/// More bodies with more unknowns than these are solved for by pairs of bodies, but where something
/// yields.
constexpr std::size_t kFewBodies = 5, kFewTried = 200;
/// What sweeps over pairs leave of the greatest force, in a body's last question and before.
constexpr double kLeft = 1e-6, kLeftMeanwhile = 1e-4;
/// What they may leave; more, and there are no forces.
constexpr double kMostLeft = 1e-2;
/// A step at finite strain asks some ten times; more than this would be a step without an end.
constexpr int kMostQuestions = 1000;
/// Answers to one question by another softness each. What hasn't settled by then goes on at the
/// body's next question, or in the next step.
constexpr int kMostSofter = 6;

Eigen::Index at(std::size_t cell) {
  return static_cast<Eigen::Index>(3 * cell);
}

bool rubs(std::span<const ContactCondition> conditions) {
  return std::ranges::any_of(conditions, [](const ContactCondition& condition) {
    return condition.kind == ContactCondition::Kind::kFriction;
  });
}

/// Directions of the unknown amounts of one force.
struct Ways {
  std::array<Vec3, 3> along;
  std::size_t count = 0;
};
Ways ways_of(bool held, const Vec3& direction, double friction) {
  if (held) return {{Vec3::UnitX(), Vec3::UnitY(), Vec3::UnitZ()}, 3};
  if (friction == 0.0) return {{direction}, 1};
  const Vec3 across = direction.unitOrthogonal();
  return {{direction, across, direction.cross(across)}, 3};
}

}  // namespace

void ContactIsland::list_unknowns(std::span<const IslandBody> bodies,
                                  std::span<const Joint> joints) {
  unknowns_.clear();
  parts_.clear();
  first_of_joint_.clear();
  using Kind = ContactCondition::Kind;
  const auto add = [&](const Ways& ways, bool held, double friction, const auto& terms_of,
                       double softness) {
    const Kind kind =
        held ? Kind::kBilateral : (friction == 0.0 ? Kind::kUnilateral : Kind::kFriction);
    parts_.push_back(
        {.first = unknowns_.size(), .count = ways.count, .condition = {kind, friction}});
    for (std::size_t w = 0; w < ways.count; ++w)
      unknowns_.push_back({terms_of(ways.along[w]), softness});
  };
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const std::vector<ContactCell>& cells = bodies[b].solve->question().cells;
    for (std::size_t k = 0; k < bodies[b].own; ++k)
      add(
          ways_of(cells[k].held, cells[k].direction, cells[k].friction), cells[k].held,
          cells[k].friction,
          [&](const Vec3& along) {
            return std::array<IslandTerm, 2>{
                IslandTerm{static_cast<int>(b), static_cast<int>(k), along}, IslandTerm{}};
          },
          0.0);
  }
  for (const Joint& joint : joints) {
    first_of_joint_.push_back(unknowns_.size());
    add(
        ways_of(joint.held, joint.direction, joint.friction), joint.held, joint.friction,
        [&](const Vec3& along) {
          std::array<IslandTerm, 2> terms;
          for (std::size_t e = 0; e < 2; ++e) {
            const Joint::End& end = joint.ends[e];
            if (end.body < 0) continue;
            const Mat3& turn = bodies[static_cast<std::size_t>(end.body)].turn;
            terms[e] = {end.body, end.cell, (e == 0 ? 1.0 : -1.0) * (turn.transpose() * along)};
          }
          return terms;
        },
        joint.softness);
  }
}

/// Amounts that begin where the joints' forces of before are.
void ContactIsland::guess(std::span<const IslandBody> bodies, std::span<const Joint> joints,
                          std::span<const Vec3> forces) {
  amounts_.setZero(static_cast<Eigen::Index>(unknowns_.size()));
  active_.assign(unknowns_.size(), false);
  std::size_t u = 0;
  for (const IslandBody& body : bodies) {
    const std::vector<ContactCell>& cells = body.solve->question().cells;
    for (std::size_t k = 0; k < body.own; ++k) {
      const std::size_t count = ways_of(cells[k].held, cells[k].direction, cells[k].friction).count;
      active_[u] = cells[k].held || cells[k].depth > 0.0;
      u += count;
    }
  }
  for (std::size_t j = 0; j < joints.size() && forces.size() == joints.size(); ++j) {
    const Ways ways = ways_of(joints[j].held, joints[j].direction, joints[j].friction);
    for (std::size_t w = 0; w < ways.count; ++w)
      amounts_[static_cast<Eigen::Index>(first_of_joint_[j] + w)] = ways.along[w].dot(forces[j]);
    active_[first_of_joint_[j]] = amounts_[static_cast<Eigen::Index>(first_of_joint_[j])] > 0.0;
  }
}

/// Parts that have a force, and those that would be violated without any. What was tried for one
/// question is for the next.
void ContactIsland::choose_tried() {
  for (Part& part : parts_) {
    const auto first = static_cast<Eigen::Index>(part.first);
    part.tried = part.tried || part.held() || amounts_[first] > 0.0 || wanted_[first] > 0.0;
  }
}

void ContactIsland::list_tried() {
  tried_.clear();
  tried_bilateral_.clear();
  tried_active_.clear();
  tried_conditions_.clear();
  for (const Part& part : parts_) {
    if (!part.tried) continue;
    for (std::size_t u = part.first; u < part.first + part.count; ++u) {
      tried_.push_back(u);
      tried_bilateral_.push_back(part.held());
      tried_active_.push_back(active_[u]);
    }
    tried_conditions_.insert(tried_conditions_.end(), part.held() ? part.count : 1, part.condition);
  }
  const auto count = static_cast<Eigen::Index>(tried_.size());
  tried_wanted_.resize(count);
  tried_amounts_.resize(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto u = static_cast<Eigen::Index>(tried_[static_cast<std::size_t>(i)]);
    tried_wanted_[i] = wanted_[u];
    tried_amounts_[i] = amounts_[u];
  }
}

/// What each amount that is tried moves along each: sums over the bodies that both touch.
void ContactIsland::assemble(std::span<const IslandBody> bodies) {
  const auto count = static_cast<Eigen::Index>(tried_.size());
  matrix_.setZero(count, count);
  std::vector<std::vector<std::pair<Eigen::Index, const IslandTerm*>>> of_body(bodies.size());
  for (Eigen::Index i = 0; i < count; ++i)
    for (const IslandTerm& term : unknowns_[tried_[static_cast<std::size_t>(i)]].terms)
      if (term.body >= 0) of_body[static_cast<std::size_t>(term.body)].push_back({i, &term});
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    if (of_body[b].empty()) continue;
    const MatrixX& response = *bodies[b].solve->question().response;
    for (const auto& [i, row] : of_body[b])
      for (const auto& [j, column] : of_body[b]) {
        if (j > i) continue;
        matrix_(i, j) +=
            row->along.dot(response.block<3, 3>(3 * row->cell, 3 * column->cell) * column->along);
      }
  }
  for (Eigen::Index i = 0; i < count; ++i)
    for (Eigen::Index j = 0; j < i; ++j) matrix_(j, i) = matrix_(i, j);
  for (Eigen::Index i = 0; i < count; ++i)
    matrix_(i, i) =
        (1.0 + kRidge) * matrix_(i, i) + unknowns_[tried_[static_cast<std::size_t>(i)]].softness;
  add_yielding();
}

/// Held joints have three unknowns each, and are always tried.
void ContactIsland::add_yielding() {
  for (const JointsThatYield& part : yielding_) {
    const MatrixX& softness = part.joints->softness();
    std::vector<Eigen::Index> rows;  // of each joint's first unknown in what is tried
    for (std::size_t j = part.first; j < part.first + static_cast<std::size_t>(softness.rows());
         ++j)
      rows.push_back(std::ranges::lower_bound(tried_, first_of_joint_[j]) - tried_.begin());
    for (std::size_t i = 0; i < rows.size(); ++i)
      for (std::size_t j = 0; j < rows.size(); ++j)
        matrix_.block<3, 3>(rows[i], rows[j]).diagonal().array() +=
            softness(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
  }
}

void ContactIsland::set_wanted(std::span<const IslandBody> bodies, std::span<const Joint> joints) {
  wanted_.resize(static_cast<Eigen::Index>(unknowns_.size()));
  const auto free_along = [&](const IslandUnknown& unknown) {
    double sum = 0.0;
    for (const IslandTerm& term : unknown.terms)
      if (term.body >= 0)
        sum += term.along.dot(
            bodies[static_cast<std::size_t>(term.body)].solve->question().free.segment<3>(
                at(static_cast<std::size_t>(term.cell))));
    return sum;
  };
  std::size_t u = 0;
  const auto set = [&](const Ways& ways, bool held, double depth, const Vec3& displacement) {
    for (std::size_t w = 0; w < ways.count; ++w, ++u)
      wanted_[static_cast<Eigen::Index>(u)] =
          (!held && w == 0 ? depth : ways.along[w].dot(displacement)) - free_along(unknowns_[u]);
  };
  for (const IslandBody& body : bodies) {
    const std::vector<ContactCell>& cells = body.solve->question().cells;
    for (std::size_t k = 0; k < body.own; ++k) {
      const ContactCell& cell = cells[k];
      set(ways_of(cell.held, cell.direction, cell.friction), cell.held, cell.depth,
          cell.displacement);
    }
  }
  for (const Joint& joint : joints)
    set(ways_of(joint.held, joint.direction, joint.friction), joint.held, joint.depth,
        joint.displacement);
}

void ContactIsland::solve_tried() {
  if (tried_.empty()) return;
  const Eigen::LLT<MatrixX> factor(matrix_);
  if (factor.info() != Eigen::Success) {
    const Rise rise = rise_to_positive(matrix_, kRidge);
    if (rise.matrix.size() > 0) matrix_ += rise.matrix;
    figures_.lifted = std::max(figures_.lifted, rise.share);
  }
  if (rubs(tried_conditions_)) {
    const FrictionFigures solved =
        frictional_.solve(matrix_, tried_wanted_, tried_conditions_, tried_amounts_);
    figures_.converged = solved.converged;
    figures_.pivots = solved.rounds;
    figures_.residual = solved.residual;
  } else {
    const UnilateralFigures solved =
        unilateral_.solve(matrix_, tried_wanted_, tried_bilateral_, tried_active_, tried_amounts_);
    figures_.converged = solved.converged;
    figures_.pivots = solved.pivots;
  }
}

/// By pairs of bodies, of which there are many.
void ContactIsland::sweep_tried(std::span<const IslandBody> bodies) {
  std::vector<const MatrixX*> responses;
  for (const IslandBody& body : bodies) responses.push_back(body.solve->question().response);
  tried_unknowns_.clear();
  for (const std::size_t u : tried_) tried_unknowns_.push_back(unknowns_[u]);
  const bool last = std::ranges::all_of(
      bodies, [](const IslandBody& body) { return body.solve->question().last; });
  const double tolerance = last ? kLeft : kLeftMeanwhile;
  const SweepFigures solved = sweeps_.solve(responses, tried_unknowns_, tried_conditions_, kRidge,
                                            tolerance, tried_wanted_, tried_amounts_);
  figures_.pivots = solved.sweeps;
  figures_.residual = solved.residual;
  figures_.lifted = std::max(figures_.lifted, solved.lifted);
  figures_.converged = solved.converged || solved.residual < kMostLeft;
  for (std::size_t i = 0; i < tried_.size(); ++i)
    tried_active_[i] = tried_amounts_[static_cast<Eigen::Index>(i)] > 0.0;
}

void ContactIsland::take_tried() {
  for (std::size_t i = 0; i < tried_.size(); ++i) {
    amounts_[static_cast<Eigen::Index>(tried_[i])] = tried_amounts_[static_cast<Eigen::Index>(i)];
    active_[tried_[i]] = tried_active_[i];
  }
}

void ContactIsland::spread_forces(std::span<const IslandBody> bodies) {
  forces_.resize(bodies.size());
  for (std::size_t b = 0; b < bodies.size(); ++b)
    forces_[b].setZero(bodies[b].solve->question().free.size());
  for (const std::size_t u : tried_)
    for (const IslandTerm& term : unknowns_[u].terms)
      if (term.body >= 0)
        forces_[static_cast<std::size_t>(term.body)].segment<3>(
            at(static_cast<std::size_t>(term.cell))) +=
            amounts_[static_cast<Eigen::Index>(u)] * term.along;
}

/// Whether there are parts that these forces violate; they are tried from now on.
bool ContactIsland::try_violated(std::span<const IslandBody> bodies) {
  std::vector<VectorX> moved(bodies.size());
  for (std::size_t b = 0; b < bodies.size(); ++b)
    moved[b] = *bodies[b].solve->question().response * forces_[b];
  bool any = false;
  for (Part& part : parts_) {
    if (part.tried) continue;
    double along = 0.0;
    for (const IslandTerm& term : unknowns_[part.first].terms)
      if (term.body >= 0)
        along += term.along.dot(moved[static_cast<std::size_t>(term.body)].segment<3>(
            at(static_cast<std::size_t>(term.cell))));
    part.tried = wanted_[static_cast<Eigen::Index>(part.first)] - along > kUnfelt;
    any = any || part.tried;
  }
  return any;
}

/// The forces that answer all open questions; false: there are none.
bool ContactIsland::decide(std::span<const IslandBody> bodies, std::span<const Joint> joints) {
  ++figures_.questions;
  set_wanted(bodies, joints);
  choose_tried();
  bool known = answer(bodies);
  for (int pass = 0; pass < kMostSofter && known && follow_yielding(joints); ++pass) {
    known = answer(bodies);
    ++figures_.softer;
  }
  return known;
}

bool ContactIsland::answer(std::span<const IslandBody> bodies) {
  do {
    list_tried();
    figures_.tried = static_cast<int>(tried_.size());
    figures_.converged = true;
    if (bodies.size() > kFewBodies && tried_.size() > kFewTried && yielding_.empty()) {
      sweep_tried(bodies);
    } else if (tried_.size() > kMostDenseUnknowns) {
      return figures_.converged = false;
    } else {
      assemble(bodies);
      solve_tried();
    }
    take_tried();
    spread_forces(bodies);
  } while (figures_.converged && try_violated(bodies));
  return figures_.converged;
}

Vec3 ContactIsland::force_on(std::span<const Joint> joints, std::size_t joint) const {
  const Joint& one = joints[joint];
  const Ways ways = ways_of(one.held, one.direction, one.friction);
  Vec3 force = Vec3::Zero();
  for (std::size_t w = 0; w < ways.count; ++w)
    force += amounts_[static_cast<Eigen::Index>(first_of_joint_[joint] + w)] * ways.along[w];
  return force;
}

/// What forces on the first ends pull together has come apart by as much.
bool ContactIsland::follow_yielding(std::span<const Joint> joints) {
  bool other = false;
  for (const JointsThatYield& part : yielding_) {
    const MatrixX& softness = part.joints->softness();
    Eigen::MatrixX3d forces(softness.cols(), 3);
    for (Eigen::Index j = 0; j < forces.rows(); ++j)
      forces.row(j) = force_on(joints, part.first + static_cast<std::size_t>(j)).transpose();
    const Eigen::MatrixX3d moved = -(softness * forces);
    std::vector<Vec3> apart;
    for (Eigen::Index j = 0; j < moved.rows(); ++j) apart.push_back(moved.row(j).transpose());
    other = part.joints->follow(apart) || other;
  }
  return other;
}

/// What stands behind a body's joined cells: the bodies that these meet, in its own frame, as if
/// nothing else touched them.
MatrixX ContactIsland::behind(std::span<const IslandBody> bodies, std::span<const Joint> joints,
                              std::size_t body) const {
  const std::size_t own = bodies[body].own;
  const auto cells = static_cast<std::size_t>(forces_[body].size()) / 3;
  MatrixX backing = MatrixX::Zero(at(cells - own), at(cells - own));
  /// A joined cell, and the cell of another body that it meets.
  struct Met {
    std::size_t cell = 0;
    Joint::End other;
    double softness = 0.0;
  };
  std::vector<Met> met;
  const auto is_met = [&](const Joint& joint, std::size_t e) {
    return joint.ends[e].body == static_cast<int>(body) &&
           static_cast<std::size_t>(joint.ends[e].cell) >= own;
  };
  for (const Joint& joint : joints)
    for (std::size_t e = 0; e < 2; ++e)
      if (is_met(joint, e))
        met.push_back({static_cast<std::size_t>(joint.ends[e].cell) - own, joint.ends[1 - e],
                       joint.softness});
  const Mat3& turn = bodies[body].turn;
  for (const Met& one : met)
    for (const Met& two : met) {
      Mat3 block = Mat3::Zero();
      if (&one == &two) block.diagonal().array() += one.softness;
      if (one.other.body >= 0 && one.other.body == two.other.body) {
        const IslandBody& other = bodies[static_cast<std::size_t>(one.other.body)];
        const Mat3 between = turn.transpose() * other.turn;
        block +=
            between *
            other.solve->question().response->block<3, 3>(3 * one.other.cell, 3 * two.other.cell) *
            between.transpose();
      }
      backing.block<3, 3>(at(one.cell), at(two.cell)) += block;
    }
  for (const JointsThatYield& part : yielding_) {
    const MatrixX& softness = part.joints->softness();
    const std::size_t side = is_met(joints[part.first], 0) ? 0 : 1;
    if (!is_met(joints[part.first], side)) continue;
    const auto row = [&](Eigen::Index j) {
      return at(static_cast<std::size_t>(
                    joints[part.first + static_cast<std::size_t>(j)].ends[side].cell) -
                own);
    };
    for (Eigen::Index i = 0; i < softness.rows(); ++i)
      for (Eigen::Index j = 0; j < softness.cols(); ++j)
        backing.block<3, 3>(row(i), row(j)).diagonal().array() += softness(i, j);
  }
  return 0.5 * (backing + backing.transpose());
}

IslandFigures ContactIsland::solve(std::span<const IslandBody> bodies,
                                   std::span<const Joint> joints, std::vector<Vec3>& forces,
                                   std::span<const JointsThatYield> yielding) {
  figures_ = {};
  yielding_ = yielding;
  list_unknowns(bodies, joints);
  guess(bodies, joints, forces);
  figures_.rows = static_cast<int>(unknowns_.size());
  const auto is_open = [](const IslandBody& body) { return !body.solve->question().last; };
  bool known = true;
  while (std::ranges::any_of(bodies, is_open) && figures_.questions < kMostQuestions) {
    known = decide(bodies, joints) && known;
    parallel_for_each_index(bodies.size(), 1, [&](std::size_t b) {
      if (is_open(bodies[b])) bodies[b].solve->answer(known ? &forces_[b] : nullptr);
    });
  }
  known = decide(bodies, joints) && known;
  figures_.converged = known;
  std::vector<MatrixX> backings;
  for (std::size_t b = 0; b < bodies.size(); ++b) backings.push_back(behind(bodies, joints, b));
  parallel_for_each_index(bodies.size(), 1, [&](std::size_t b) {
    bodies[b].solve->end(known ? &forces_[b] : nullptr, backings[b]);
  });
  forces.assign(joints.size(), Vec3::Zero());
  for (std::size_t j = 0; known && j < joints.size(); ++j) forces[j] = force_on(joints, j);
  return figures_;
}

}  // namespace viscera
