// What a hand meets of a deformed body: its tangent at the hand's foot, in place of the response of
// the body at rest.
//
// Exact are the answers to a mean force on the foot, along each axis: where they take its mean, and
// how they slope it. What couples is small for a foot that is small against the body, so that
// slopes among themselves stay as at rest.
#include <algorithm>
#include <memory>

#include "kernels/contact/finite_contact.h"

namespace viscera {
namespace {

/// Rounds of a foot that is new, and of one whose answer of the last frame is at hand: of that a
/// round leaves a third of the error of displacements or less. In every frame: what is refined by
/// turns is stiffer and softer by turns, and gives a hand energy.
constexpr int kRoundsAnew = 4, kRoundsOn = 2;
/// A foot that has gone no farther within a frame is the same [m].
constexpr double kSameFoot = 8e-3;

Eigen::Index at(std::size_t cell) {
  return static_cast<Eigen::Index>(3 * cell);
}

/// A mean force along each axis on cells [begin, begin + shares.cols()).
MatrixX mean_forces(std::size_t cells, std::size_t begin, const MatrixX& shares) {
  MatrixX forces = MatrixX::Zero(at(cells), 3);
  for (Eigen::Index k = 0; k < shares.cols(); ++k)
    forces.block<3, 3>(at(begin) + 3 * k, 0).diagonal().setConstant(shares(0, k));
  return forces;
}

}  // namespace

/// As a step's factor answers it, turned: what is finer than nodes stays as at rest.
HeldBody FiniteContact::held_body(const Holding& holding, std::size_t begin, std::size_t end,
                                  const MatrixX& shares, const MatrixX& near) const {
  HeldBody held;
  held.rows = holding.ways.size();
  if (held.rows == 0) return held;
  const std::size_t cells = group_of_cell_.size();
  const auto ways = std::make_shared<const std::vector<Unknown>>(holding.ways);
  const auto rows = static_cast<Eigen::Index>(held.rows);
  const auto on_cells = [cells, ways](const auto& forces) {
    VectorX all = VectorX::Zero(at(cells));
    for (std::size_t i = 0; i < ways->size(); ++i)
      all.segment<3>(3 * (*ways)[i].cell) +=
          forces[static_cast<Eigen::Index>(i)] * (*ways)[i].direction;
    return all;
  };
  held.moved = [this, ways](const MatrixX& x) {
    MatrixX moved(static_cast<Eigen::Index>(ways->size()), x.cols());
    for (Eigen::Index c = 0; c < x.cols(); ++c) {
      const VectorX all = moved_cells(x.col(c));
      for (std::size_t i = 0; i < ways->size(); ++i)
        moved(static_cast<Eigen::Index>(i), c) =
            (*ways)[i].direction.dot(all.segment<3>(3 * (*ways)[i].cell));
    }
    return moved;
  };
  held.loads = [this, on_cells](const MatrixX& f) {
    MatrixX loads(at(rotations_.size() / 9), f.cols());
    for (Eigen::Index c = 0; c < f.cols(); ++c) {
      VectorX load = VectorX::Zero(loads.rows());
      add_loads(on_cells(f.col(c)), load);
      loads.col(c) = load;
    }
    return loads;
  };
  held.answers = [this, cells, on_cells](const MatrixX& f) {
    MatrixX forces(at(cells), f.cols());
    for (Eigen::Index c = 0; c < f.cols(); ++c) forces.col(c) = on_cells(f.col(c));
    return answers_to(forces);
  };
  const auto between = [&](const MatrixX& response, std::size_t i, Eigen::Index column) -> Vec3 {
    return response.block<3, 3>(3 * (*ways)[i].cell, column).transpose() * (*ways)[i].direction;
  };
  held.response.resize(rows, rows);
  held.beyond.resize(rows, rows);
  held.apart = MatrixX::Zero(rows, 3);
  for (std::size_t i = 0; i < held.rows; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    for (std::size_t j = 0; j < held.rows; ++j) {
      const auto column = static_cast<Eigen::Index>(j);
      const Unknown& other = (*ways)[j];
      const Vec3 by_nodes =
          between(response_, i, 3 * other.cell) - between(near, i, 3 * other.cell);
      held.beyond(row, column) = holding.response(row, column) - by_nodes.dot(other.direction);
      held.response(row, column) =
          held.beyond(row, column) + between(turned_step_, i, 3 * other.cell).dot(other.direction);
    }
    for (std::size_t k = begin; k < end; ++k)
      held.apart.row(row) +=
          shares(0, static_cast<Eigen::Index>(k - begin)) * between(near, i, at(k)).transpose();
  }
  return held;
}

std::optional<TangentAnswer> FiniteContact::answer_at_foot(std::size_t begin, std::size_t end,
                                                           const MatrixX& shares,
                                                           const HeldBody& held) {
  const std::vector<double>& u = state_.motion.displacements;
  const auto n = static_cast<Eigen::Index>(u.size());
  const MatrixX forces = mean_forces(group_of_cell_.size(), begin, shares);
  TangentLoads asked;
  asked.loads = MatrixX::Zero(n, 3);
  for (Eigen::Index c = 0; c < 3; ++c) {
    VectorX load = asked.loads.col(c);
    add_loads(forces.col(c), load);
    asked.loads.col(c) = load;
  }
  asked.precondition = [this](std::span<const double> g, std::span<double> z) {
    body_.solver.precondition(rotations_, g, z);
  };
  Vec3 place = Vec3::Zero();
  for (std::size_t k = begin; k < end; ++k) place += state_.places[k].position;
  place /= static_cast<double>(end - begin);
  const auto far = [&](const State::FootAnswer& one) { return (one.place - place).norm(); };
  auto last = std::ranges::min_element(state_.felt, {}, far);
  if (last != state_.felt.end() && !(far(*last) < kSameFoot)) last = state_.felt.end();
  const auto rows = static_cast<Eigen::Index>(held.rows);
  if (last != state_.felt.end()) {
    asked.guess = Eigen::Map<const MatrixX>(last->displacements.data(), n, 3);
    if (rows > 0 && last->forces.size() == 3 * held.rows)
      asked.guessed_forces = Eigen::Map<const MatrixX>(last->forces.data(), rows, 3);
  } else {
    asked.guess = answers_to(forces);
  }
  auto answer = answer_of_tangent(body_.solver.body(), u, changed_, asked, held,
                                  last != state_.felt.end() ? kRoundsOn : kRoundsAnew);
  if (!answer) {
    if (last != state_.felt.end()) state_.felt.erase(last);
    return answer;
  }
  if (last == state_.felt.end()) last = state_.felt.insert(last, State::FootAnswer());
  *last = {place,
           {answer->displacements.data(), answer->displacements.data() + 3 * n},
           {answer->forces.data(), answer->forces.data() + 3 * rows},
           true};
  return answer;
}

std::optional<MatrixX> FiniteContact::lost_by_strain(std::size_t begin, std::size_t end,
                                                     const MatrixX& shares, const Holding& holding,
                                                     const MatrixX& by_hold) {
  const std::vector<double>& u = state_.motion.displacements;
  if (std::ranges::all_of(u, [](double one) { return one == 0.0; })) return std::nullopt;
  const MatrixX near = turned(near_);
  const HeldBody held = held_body(holding, begin, end, shares, near);
  const auto answer = answer_at_foot(begin, end, shares, held);
  if (!answer) {
    ++tangents_refused_;
    return std::nullopt;
  }
  const auto own = static_cast<Eigen::Index>(3 * (end - begin));
  const Eigen::Index sums = 3 * shares.rows();
  MatrixX wide = MatrixX::Zero(sums, own);  // the shares of each axis
  for (Eigen::Index c = 0; c < shares.rows(); ++c)
    for (Eigen::Index k = 0; k < shares.cols(); ++k)
      wide.block<3, 3>(3 * c, 3 * k).diagonal().setConstant(shares(c, k));
  MatrixX moved(own, 3);
  for (Eigen::Index c = 0; c < 3; ++c) {
    moved.col(c) = moved_cells(answer->displacements.col(c)).segment(at(begin), own);
    for (std::size_t i = 0; i < held.rows; ++i)
      moved.col(c) +=
          answer->forces(static_cast<Eigen::Index>(i), c) *
          (near.block(at(begin), 3 * holding.ways[i].cell, own, 3) * holding.ways[i].direction);
  }
  MatrixX lost = MatrixX::Zero(sums, sums);
  if (by_hold.size() > 0) lost = by_hold;
  const MatrixX rest = wide *
                       (response_.block(at(begin), at(begin), own, own) -
                        near.block(at(begin), at(begin), own, own)) *
                       wide.topRows(3).transpose();
  lost.leftCols<3>() = rest - wide * moved;
  lost.topLeftCorner<3, 3>() = rest.topRows<3>() - answer->response;
  lost.topLeftCorner<3, 3>() =
      (0.5 * (lost.topLeftCorner<3, 3>() + lost.topLeftCorner<3, 3>().transpose())).eval();
  lost.topRightCorner(3, sums - 3) = lost.bottomLeftCorner(sums - 3, 3).transpose();
  return lost;
}

}  // namespace viscera
