#include "kernels/contact/tissue_contact.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <type_traits>

#include "kernels/base/archive.h"
#include "kernels/contact/rise_to_positive.h"

namespace viscera {
namespace {

/// Added to the diagonal, relative: two tools may press the very same spot. Also the least
/// eigenvalue of the scaled matrix, see lift().
constexpr double kRidge = 1e-6;

/// Where a tool presses the very tissue that a jaw holds, hardly any of its compliance is left, and
/// a hive's own, which differs by per cents, would turn negative: at most this share is taken.
constexpr double kMostTaken = 0.85;

/// How much of what a hold takes, mixed others^-1 mixed^T, leaves the response positive enough, at
/// most 1: by a few steps of the power method on R^-1 T.
double bearable(const MatrixX& response, const MatrixX& mixed, const Eigen::LLT<MatrixX>& others) {
  const Eigen::LLT<MatrixX> factor(response);
  if (factor.info() != Eigen::Success) return 1.0;
  constexpr int kSteps = 8;
  VectorX x = mixed.rowwise().squaredNorm();
  double most = 0.0;
  for (int i = 0; i < kSteps && x.norm() > 0.0; ++i) {
    x.normalize();
    const VectorX forces = others.solve(mixed.transpose() * x);
    const VectorX next = factor.solve(mixed * forces);
    most = next.norm();
    x = next;
  }
  return most > kMostTaken ? kMostTaken / most : 1.0;
}

/// Of a deformed body, whose answer is known better, so much; it counts as at most so many times as
/// soft again as at rest.
constexpr double kMostLost = 0.95, kMostGiven = 9.0;

/// Values of single cells put together by `shares`, the same for each axis: (3 c) x (3 m).
MatrixX for_axes(const MatrixX& shares) {
  MatrixX wide = MatrixX::Zero(3 * shares.rows(), 3 * shares.cols());
  for (Eigen::Index c = 0; c < shares.rows(); ++c)
    for (Eigen::Index k = 0; k < shares.cols(); ++k)
      wide.block<3, 3>(3 * c, 3 * k).diagonal().setConstant(shares(c, k));
  return wide;
}

/// Of what a first-order field takes from cells' response (symmetric; put together by shares, which
/// `fields` turns back into cells' values) as much as leaves it positive, and gives no more than so
/// many times that response. With R the response and P the fields, P T P^T stays below a share of R
/// where T does of (P^T R^-1 P)^-1.
MatrixX bearable_change(const MatrixX& response, const MatrixX& fields, const MatrixX& taken,
                        double most_given) {
  const Eigen::LLT<MatrixX> factor(response);
  if (factor.info() != Eigen::Success) return MatrixX::Zero(taken.rows(), taken.cols());
  const MatrixX half = factor.matrixL().solve(for_axes(fields));
  MatrixX stiffness = half.transpose() * half;
  constexpr double kNoField = 1e-12;  // shares may know of no slope
  stiffness.diagonal().array() += kNoField * stiffness.trace();
  const Eigen::LLT<MatrixX> root(stiffness);
  const MatrixX lower = root.matrixL();
  const Eigen::SelfAdjointEigenSolver<MatrixX> modes(lower.transpose() * taken * lower);
  if (root.info() != Eigen::Success || modes.info() != Eigen::Success)
    return MatrixX::Zero(taken.rows(), taken.cols());
  if (modes.eigenvalues().maxCoeff() <= kMostLost && modes.eigenvalues().minCoeff() >= -most_given)
    return taken;
  const VectorX kept = modes.eigenvalues().array().max(-most_given).min(kMostLost);
  const MatrixX back = root.matrixU().solve(modes.eigenvectors());
  return back * kept.asDiagonal() * back.transpose();
}

}  // namespace

bool TissueContact::remember_places(std::span<const ContactCell> cells) {
  std::vector<Place>& places = state_.places;
  bool same = cells.size() == places.size();
  places.resize(cells.size());
  for (std::size_t k = 0; k < cells.size(); ++k) {
    const Place place{cells[k].position, cells[k].normal, cells[k].area, cells[k].bell};
    same = same && place == places[k];
    places[k] = place;
  }
  return same;
}

bool TissueContact::remember_ways(std::span<const ContactCell> cells, const MatrixX& backing) {
  std::vector<Way>& ways = state_.ways;
  bool same = cells.size() == ways.size() && backing.rows() == backing_.rows() &&
              (backing.array() == backing_.array()).all();
  backing_ = backing;
  ways.resize(cells.size());
  for (std::size_t k = 0; k < cells.size(); ++k) {
    const Way way{cells[k].direction, cells[k].friction, cells[k].held};
    same = same && way == ways[k];
    ways[k] = way;
  }
  return same;
}

/// One unknown a pressed cell, along its direction; two more across it with friction; three along
/// the axes for a held one.
void TissueContact::list_unknowns() {
  unknowns_.clear();
  bilateral_.clear();
  conditions_.clear();
  for (std::size_t k = 0; k < state_.ways.size(); ++k) {
    const Way& cell = state_.ways[k];
    const auto add = [&](const Vec3& direction) {
      unknowns_.push_back({static_cast<int>(k), direction});
      bilateral_.push_back(cell.held);
    };
    if (cell.held) {
      for (int a = 0; a < 3; ++a) add(Vec3::Unit(a));
      conditions_.insert(conditions_.end(), 3, {ContactCondition::Kind::kBilateral, 0.0});
      continue;
    }
    add(cell.direction);
    if (cell.friction == 0.0) {
      conditions_.push_back({ContactCondition::Kind::kUnilateral, 0.0});
      continue;
    }
    conditions_.push_back({ContactCondition::Kind::kFriction, cell.friction});
    const Vec3 first = cell.direction.unitOrthogonal();
    add(first);
    add(cell.direction.cross(first));
  }
}

void TissueContact::assemble(const MatrixX& backing) {
  const auto count = static_cast<Eigen::Index>(unknowns_.size());
  matrix_.resize(count, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Unknown& row = unknowns_[static_cast<std::size_t>(i)];
    for (Eigen::Index j = 0; j < (symmetric_ ? i + 1 : count); ++j) {
      const Unknown& column = unknowns_[static_cast<std::size_t>(j)];
      matrix_(i, j) = row.direction.dot(response_.block<3, 3>(3 * row.cell, 3 * column.cell) *
                                        column.direction);
      if (symmetric_) matrix_(j, i) = matrix_(i, j);
    }
  }
  const auto behind = static_cast<int>(state_.ways.size()) - static_cast<int>(backing.rows() / 3);
  for (Eigen::Index i = 0; backing.rows() > 0 && i < count; ++i) {
    const Unknown& row = unknowns_[static_cast<std::size_t>(i)];
    for (Eigen::Index j = 0; row.cell >= behind && j < count; ++j) {
      const Unknown& column = unknowns_[static_cast<std::size_t>(j)];
      if (column.cell < behind) continue;
      matrix_(i, j) += row.direction.dot(
          backing.block<3, 3>(3 * (row.cell - behind), 3 * (column.cell - behind)) *
          column.direction);
    }
  }
  matrix_.diagonal() *= 1.0 + kRidge;
}

void TissueContact::set_wanted(std::span<const ContactCell> cells) {
  wanted_.resize(static_cast<Eigen::Index>(unknowns_.size()));
  for (std::size_t i = 0; i < unknowns_.size(); ++i) {
    const Unknown& unknown = unknowns_[i];
    const ContactCell& cell = cells[static_cast<std::size_t>(unknown.cell)];
    // The first unknown of a pressed cell is along its direction.
    const bool pushes = !cell.held && (i == 0 || unknowns_[i - 1].cell != unknown.cell);
    wanted_[static_cast<Eigen::Index>(i)] =
        (pushes ? cell.depth : unknown.direction.dot(cell.displacement)) -
        unknown.direction.dot(cell.free);
  }
}

/// Amounts of the unknowns, by the solver that the conditions need.
void TissueContact::solve_conditions(ContactSolution& solution) {
  const bool rubs = std::any_of(conditions_.begin(), conditions_.end(), [](const auto& condition) {
    return condition.kind == ContactCondition::Kind::kFriction;
  });
  if (rubs) {
    const FrictionFigures figures =
        solvers_->frictional.solve(matrix_, wanted_, conditions_, state_.amounts);
    solution.pivots = figures.rounds;
    solution.converged = figures.converged;
    solution.residual = figures.residual;
    std::vector<int> loaded;
    for (Eigen::Index i = 0; i < state_.amounts.size(); ++i) {
      if (state_.amounts[i] != 0.0) loaded.push_back(static_cast<int>(i));
    }
    if (!same_matrix_ || loaded != measured_ || loaded.empty()) {
      const MatrixX part = matrix_(loaded, loaded);
      measured_eigenvalue_ =
          symmetric_ ? estimated_eigenvalue_ratio(part) : smallest_eigenvalue_ratio(part);
      measured_ = loaded;
    }
    solution.smallest_eigenvalue = measured_eigenvalue_;
    if (symmetric_ && solution.smallest_eigenvalue <= 0.0) {
      solution.converged = false;
      state_.amounts.setZero();
    }
    return;
  }
  if (state_.active.size() != unknowns_.size()) {
    state_.active.resize(unknowns_.size());
    for (std::size_t i = 0; i < state_.active.size(); ++i) {
      state_.active[i] = wanted_[static_cast<Eigen::Index>(i)] > 0.0;
    }
  }
  const UnilateralFigures figures = solvers_->unilateral.solve(
      matrix_, wanted_, bilateral_, state_.active, state_.amounts, symmetric_);
  solution.pivots = figures.pivots;
  solution.converged = figures.converged;
  solution.smallest_eigenvalue = figures.smallest_eigenvalue;
}

/// Where the forces took each cell, and what that leaves.
void TissueContact::measure(std::span<const ContactCell> cells, ContactSolution& solution) {
  const Eigen::Map<const VectorX> forces(solution.forces.front().data(),
                                         static_cast<Eigen::Index>(3 * cells.size()));
  Eigen::Map<VectorX>(state_.displacements.front().data(), forces.size()).noalias() =
      response_ * forces;
  if (state_.lifted.size() > 0) {
    const VectorX more = state_.lifted * state_.amounts;
    for (std::size_t i = 0; i < unknowns_.size(); ++i) {
      state_.displacements[static_cast<std::size_t>(unknowns_[i].cell)] +=
          more[static_cast<Eigen::Index>(i)] * unknowns_[i].direction;
    }
  }
  for (std::size_t k = 0; k < cells.size(); ++k) state_.displacements[k] += cells[k].free;
  solution.slips.assign(cells.size(), Vec3::Zero());
  solution.violation = 0.0;
  for (std::size_t k = 0; k < cells.size(); ++k) {
    const ContactCell& cell = cells[k];
    if (cell.held) continue;
    const Vec3& way = cell.direction;
    solution.violation =
        std::max(solution.violation, cell.depth - state_.displacements[k].dot(way));
    if (cell.friction == 0.0) continue;
    // Inside its cone a cell sticks; what is left between the two is round-off.
    const Vec3& force = solution.forces[k];
    const double pushed = force.dot(way);
    const double dragged = (force - pushed * way).norm();
    if (pushed > 0.0 && dragged < (1.0 - 1e-9) * cell.friction * pushed) continue;
    const Vec3 off = state_.displacements[k] - cell.displacement;
    solution.slips[k] = off - way.dot(off) * way;
  }
}

void TissueContact::lift() {
  state_.lifted.resize(0, 0);
  lifted_share_ = 0.0;
  if (!symmetric_) return;
  solvers_->whole_factor.compute(matrix_);
  if (solvers_->whole_factor.info() == Eigen::Success) return;
  Rise rise = rise_to_positive(matrix_, kRidge);
  if (rise.matrix.size() == 0) return;
  lifted_share_ = rise.share;
  state_.lifted = std::move(rise.matrix);
  matrix_ += state_.lifted;
}

void TissueContact::see_places(std::span<const ContactCell> cells, bool one_of_several,
                               bool shared) {
  same_matrix_ = remember_places(cells) && shared == state_.shared;
  state_.shared = shared;
  const bool counts = !one_of_several || !state_.counted;
  state_.counted = one_of_several;
  if (!same_matrix_) {
    state_.stayed = 0;
    state_.columns_built = 0;
    at_hand_ = false;
    places_changed();
  } else if (counts) {
    ++state_.stayed;
  }
  ensure_response();
}

void TissueContact::ensure_response() {
  if (at_hand_) return;
  at_hand_ = true;
  make_response();
}

const MatrixX& TissueContact::cell_response() {
  if (!state_.places.empty()) ensure_response();
  return response_;
}

void TissueContact::remake_matrix() {
  if (!solvers_) solvers_.emplace();
  assemble(backing_);
  lift();
}

void TissueContact::restore(State state) {
  forget();
  state_ = std::move(state);
  drop_response();
  list_unknowns();
}

void TissueContact::forget() {
  at_hand_ = matrix_at_hand_ = false;
  // Assigning {} would keep a vector's memory.
  std::vector<NearField>().swap(near_fields_);
  std::vector<int>().swap(measured_);
  response_ = backing_ = matrix_ = MatrixX();
  solvers_.reset();
  drop_response();
}

void TissueContact::forget_conditions() {
  state_.places.clear();
  state_.ways.clear();
  state_.lifted.resize(0, 0);
  measured_.clear();
  state_.columns_built = 0;
  state_.stayed = 0;
  places_changed();
}

std::size_t TissueContact::conditions_memory_bytes() const {
  const auto of = [](const auto& values) { return values.capacity() * sizeof(values[0]); };
  std::size_t bytes = saved_bytes(state_) + of(near_fields_) + of(unknowns_) + of(conditions_);
  for (const MatrixX* matrix : {&response_, &backing_, &matrix_})
    bytes += static_cast<std::size_t>(matrix->size()) * sizeof(double);
  return bytes;
}

/// What follows from solution.forces.
void TissueContact::apply_forces(std::span<const ContactCell> cells, ContactSolution& solution,
                                 ContactResponse& response) {
  solution.touching = 0;
  for (const Vec3& force : solution.forces) solution.touching += force.isZero(0.0) ? 0 : 1;
  if (solution.touching > 0) {
    spread_forces(solution.forces, response);
    state_.forces = solution.forces;
  } else {
    response.touched.clear();
    response.loads.clear();
    state_.response = response;
    state_.forces.clear();
  }
  measure(cells, solution);
}

bool TissueContact::begin_answer(std::span<const ContactCell> cells, ContactSolution& solution,
                                 ContactResponse& response) {
  solution.touching = solution.pivots = 0;
  solution.violation = solution.residual = solution.lifted = 0.0;
  solution.beyond_touchable = 0;
  solution.converged = true;
  solution.smallest_eigenvalue = 1.0;
  solution.near_fields.clear();
  solution.forces.assign(cells.size(), Vec3::Zero());
  solution.slips.assign(cells.size(), Vec3::Zero());
  response.touched.clear();
  response.loads.clear();
  state_.response = response;
  state_.forces.clear();
  state_.displacements.assign(cells.size(), Vec3::Zero());
  if (std::ranges::all_of(cells, [](const ContactCell& cell) { return is_sound(cell); }))
    return true;
  solution.converged = false;
  solution.smallest_eigenvalue = 0.0;
  solution.near_fields.assign(cells.size(), any_near_field());
  return false;
}

void TissueContact::solve(std::span<const ContactCell> cells, ContactSolution& solution,
                          ContactResponse& response, const MatrixX& backing) {
  if (!begin_answer(cells, solution, response) || cells.empty()) return;
  if (!solvers_) solvers_.emplace();
  see_places(cells, backing.rows() > 0);
  same_matrix_ = remember_ways(cells, backing) && same_matrix_ && matrix_at_hand_;
  if (!same_matrix_) {
    list_unknowns();
    assemble(backing);
    lift();
    matrix_at_hand_ = true;
  }
  set_wanted(cells);
  solve_conditions(solution);

  solution.lifted = lifted_share_;
  solution.near_fields = near_fields_;
  solution.beyond_touchable = beyond_touchable_;
  for (std::size_t i = 0; i < unknowns_.size(); ++i) {
    solution.forces[static_cast<std::size_t>(unknowns_[i].cell)] +=
        state_.amounts[static_cast<Eigen::Index>(i)] * unknowns_[i].direction;
  }
  apply_forces(cells, solution, response);
}

class TissueContact::PreparedShare final : public SharedSolve {
 public:
  PreparedShare(TissueContact& tissue, std::span<const ContactCell> cells,
                ContactSolution& solution, ContactResponse& response)
      : tissue_(tissue), cells_(cells), solution_(solution), response_(response) {
    question_.cells.assign(cells.begin(), cells.end());
    question_.response = &tissue.response_;
    question_.last = true;
    question_.free.resize(static_cast<Eigen::Index>(3 * cells.size()));
    for (std::size_t k = 0; k < cells.size(); ++k)
      question_.free.segment<3>(static_cast<Eigen::Index>(3 * k)) = cells[k].free;
  }
  const SharedQuestion& question() const override { return question_; }
  void answer(const VectorX*) override {}
  void end(const VectorX* forces, const MatrixX& backing) override {
    tissue_.take(cells_, forces, backing, solution_, response_);
  }

 private:
  TissueContact& tissue_;
  std::span<const ContactCell> cells_;
  ContactSolution& solution_;
  ContactResponse& response_;
  SharedQuestion question_;
};

std::unique_ptr<SharedSolve> TissueContact::share(std::span<const ContactCell> cells,
                                                  std::size_t /*own*/, ContactSolution& solution,
                                                  ContactResponse& response) {
  if (!begin_answer(cells, solution, response)) return nullptr;
  if (!cells.empty()) see_places(cells, true);
  return std::make_unique<PreparedShare>(*this, cells, solution, response);
}

void TissueContact::take(std::span<const ContactCell> cells, const VectorX* forces,
                         const MatrixX& backing, ContactSolution& solution,
                         ContactResponse& response) {
  // What these conditions were solved with stays where it was: others' matrix.
  state_.active.clear();
  state_.lifted.resize(0, 0);
  lifted_share_ = 0.0;
  matrix_at_hand_ = false;
  remember_ways(cells, backing);
  list_unknowns();
  solution.converged = forces != nullptr;
  state_.displacements.assign(cells.size(), Vec3::Zero());
  if (cells.empty()) return;
  for (std::size_t k = 0; k < cells.size(); ++k)
    solution.forces[k] =
        forces ? Vec3(forces->segment<3>(static_cast<Eigen::Index>(3 * k))) : Vec3::Zero();
  assemble(backing);
  state_.amounts.resize(static_cast<Eigen::Index>(unknowns_.size()));
  for (std::size_t i = 0; i < unknowns_.size(); ++i)
    state_.amounts[static_cast<Eigen::Index>(i)] =
        unknowns_[i].direction.dot(solution.forces[static_cast<std::size_t>(unknowns_[i].cell)]);
  solution.near_fields = near_fields_;
  solution.beyond_touchable = beyond_touchable_;
  apply_forces(cells, solution, response);
}

void TissueContact::load(std::span<const ContactCell> cells, std::span<const Vec3> forces,
                         ContactSolution& solution, ContactResponse& response) {
  see_places(cells, true, state_.shared);
  if (!same_matrix_) {
    // The matrix of the conditions belongs to other places now.
    state_.ways.clear();
    unknowns_.clear();
    state_.lifted.resize(0, 0);
    lifted_share_ = 0.0;
  }
  if (state_.lifted.size() > 0)
    for (std::size_t i = 0; i < unknowns_.size(); ++i)
      state_.amounts[static_cast<Eigen::Index>(i)] =
          unknowns_[i].direction.dot(forces[static_cast<std::size_t>(unknowns_[i].cell)]);
  solution.forces.assign(forces.begin(), forces.end());
  solution.converged = true;
  solution.near_fields = near_fields_;
  solution.beyond_touchable = beyond_touchable_;
  state_.displacements.assign(cells.size(), Vec3::Zero());
  apply_forces(cells, solution, response);
}

/// With A the response of everything that others hold, in the ways in which it is held, and B what
/// forces there do to these cells: without this tool's forces f the others' would be g + A^-1 B^T
/// f, so that these cells' response to f is R - B A^-1 B^T.
std::optional<OthersHold> TissueContact::hold_of_others(std::span<const ContactCell> cells,
                                                        std::size_t begin, std::size_t end,
                                                        const MatrixX& shares) {
  const std::vector<Vec3>& moved = state_.displacements;
  if (begin >= end || end > cells.size() || moved.size() != cells.size() ||
      state_.places.size() != cells.size() ||
      shares.cols() != static_cast<Eigen::Index>(end - begin))
    return std::nullopt;
  ensure_response();
  const auto m = static_cast<Eigen::Index>(3 * (end - begin));
  const auto first = static_cast<Eigen::Index>(3 * begin);
  VectorX forces = VectorX::Zero(m);
  if (!state_.forces.empty())
    for (std::size_t k = begin; k < end; ++k)
      forces.segment<3>(static_cast<Eigen::Index>(3 * (k - begin))) = state_.forces[k];
  OthersHold hold;
  VectorX by_itself = response_.block(first, first, m, m) * forces;
  VectorX given_back = VectorX::Zero(m);
  // What made the matrix positive is part of the answer, as in measure().
  const bool lifted = state_.lifted.rows() == static_cast<Eigen::Index>(unknowns_.size());
  const auto is_mine = [&](const Unknown& one) {
    const auto cell = static_cast<std::size_t>(one.cell);
    return cell >= begin && cell < end;
  };
  const auto lift_by = [&](Eigen::Index unknown, double amount, Eigen::Ref<VectorX> moved_by) {
    for (std::size_t i = 0; lifted && i < unknowns_.size(); ++i)
      if (is_mine(unknowns_[i]))
        moved_by.segment<3>(3 * unknowns_[i].cell - first) +=
            state_.lifted(static_cast<Eigen::Index>(i), unknown) * amount * unknowns_[i].direction;
  };
  for (std::size_t i = 0; lifted && i < unknowns_.size(); ++i)
    if (is_mine(unknowns_[i]))
      lift_by(static_cast<Eigen::Index>(i), state_.amounts[static_cast<Eigen::Index>(i)],
              by_itself);
  const std::vector<int> held = held_by_others(cells, begin, end);
  Holding holding;
  for (const int unknown : held)
    holding.ways.push_back(unknowns_[static_cast<std::size_t>(unknown)]);
  if (!held.empty()) {
    const auto count = static_cast<Eigen::Index>(held.size());
    MatrixX& others = holding.response;
    others.resize(count, count);
    MatrixX mixed(m, count);
    for (Eigen::Index j = 0; j < count; ++j) {
      const auto unknown = static_cast<std::size_t>(held[static_cast<std::size_t>(j)]);
      for (Eigen::Index i = 0; i < count; ++i)
        others(i, j) =
            matrix_(held[static_cast<std::size_t>(i)], held[static_cast<std::size_t>(j)]);
      mixed.col(j) =
          response_.block(first, 3 * unknowns_[unknown].cell, m, 3) * unknowns_[unknown].direction;
      lift_by(static_cast<Eigen::Index>(unknown), 1.0, mixed.col(j));
    }
    const Eigen::LLT<MatrixX> factor(others);
    if (factor.info() != Eigen::Success) return std::nullopt;
    // Nobody's own compliance stands in for the response where only `free` is asked for: a body
    // that others hold nearly alone would seem to fly by what is left of its way without them.
    double share = 1.0;
    if (shares.rows() > 0) {
      share = bearable(response_.block(first, first, m, m), mixed, factor);
      const MatrixX solved = factor.matrixL().solve((for_axes(shares) * mixed).transpose());
      hold.taken.noalias() = share * (solved.transpose() * solved);
    }
    const VectorX answers = factor.solve(mixed.transpose() * forces);
    given_back.noalias() = share * (mixed * answers);
  }
  if (shares.rows() > 0) {
    const MatrixX fields = shares.completeOrthogonalDecomposition().pseudoInverse();
    const MatrixX stiffened = as_stiffened(begin, end, shares, fields, hold);
    const auto lost = lost_by_strain(begin, end, shares, holding, hold.taken);
    const bool changed = stiffened.size() > 0;
    if (lost || changed) {
      const MatrixX response = response_.block(first, first, m, m);
      const MatrixX& met = changed ? stiffened : response;
      const MatrixX wide = for_axes(shares);
      if (lost) hold.taken = *lost;
      if (hold.taken.size() == 0) hold.taken.setZero(wide.rows(), wide.rows());
      if (changed) {
        hold.divided = wide * (stiffened - response) * wide.transpose();
        hold.taken += hold.divided;
      }
      // Over what the tissue about the cells gave before it stiffened.
      const double most_given = (1.0 + kMostGiven) * std::exp(hold.most) - 1.0;
      hold.taken = bearable_change(met, fields, hold.taken, most_given);
      // As a hand has it: to first order.
      const MatrixX over = for_axes(fields);
      by_itself += (met - response) * forces;
      given_back = over * (hold.taken * (over.transpose() * forces));
    }
  }
  for (std::size_t k = begin; k < end; ++k) {
    const auto at = static_cast<Eigen::Index>(3 * (k - begin));
    hold.free.push_back(moved[k] - by_itself.segment<3>(at) + given_back.segment<3>(at));
  }
  return hold;
}

/// The response of cells [begin, end) before an update, but between two of them divided by the root
/// of what the tissue about both has stiffened by since, which `hold` is told; (3 m) x (3 m).
/// Nothing: there was no update. What is finer than places stiffens so (PatchContact), and of what
/// lies farther off too little is left rather than too much, which is given back to first order.
MatrixX TissueContact::as_stiffened(std::size_t begin, std::size_t end, const MatrixX& shares,
                                    const MatrixX& fields, OthersHold& hold) const {
  const MatrixX taken = taken_by_update(begin, end);
  const std::span<const double> moduli = moduli_by_update();
  if (taken.size() == 0 || moduli.size() < end) return {};
  const Eigen::Index m = taken.rows() / 3;
  const VectorX stiffer =
      Eigen::Map<const VectorX>(moduli.data() + begin, m).array().log().matrix();
  hold.least = stiffer.minCoeff();
  hold.most = stiffer.maxCoeff();
  hold.stiffer = shares * stiffer;
  const VectorX give =
      (-0.5 * (fields * hold.stiffer).array().max(hold.least).min(hold.most)).exp().matrix();
  const VectorX by_axis = give.replicate(1, 3).transpose().reshaped();
  const auto first = static_cast<Eigen::Index>(3 * begin);
  return by_axis.asDiagonal() * (response_.block(first, first, 3 * m, 3 * m) + taken) *
         by_axis.asDiagonal();
}

/// Unknowns of other cells that keep what they touch: held ones, and where a pressed cell touches
/// its push, its drag too where it sticks.
std::vector<int> TissueContact::held_by_others(std::span<const ContactCell> cells,
                                               std::size_t begin, std::size_t end) const {
  std::vector<int> held;
  if (matrix_.rows() != static_cast<Eigen::Index>(unknowns_.size()) ||
      state_.amounts.size() != matrix_.rows())
    return held;
  for (std::size_t i = 0; i < unknowns_.size();) {
    const auto cell = static_cast<std::size_t>(unknowns_[i].cell);
    std::size_t next = i + 1;
    while (next < unknowns_.size() && static_cast<std::size_t>(unknowns_[next].cell) == cell)
      ++next;
    const double push = state_.amounts[static_cast<Eigen::Index>(i)];
    const bool mine = cell >= begin && cell < end;
    std::size_t count = 0;
    if (!mine && cells[cell].held)
      count = next - i;
    else if (!mine && push > 0.0) {
      const double dragged =
          next - i == 3 ? state_.amounts.segment<2>(static_cast<Eigen::Index>(i) + 1).norm() : 0.0;
      count = next - i == 3 && dragged < (1.0 - 1e-9) * cells[cell].friction * push ? 3 : 1;
    }
    for (std::size_t u = i; u < i + count; ++u) held.push_back(static_cast<int>(u));
    i = next;
  }
  return held;
}

}  // namespace viscera
