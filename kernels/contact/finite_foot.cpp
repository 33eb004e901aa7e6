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

/// Rounds of a foot that is new, and of one whose answer is at hand: of that a round leaves a third
/// of the error of displacements or less.
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

/// What was felt at the place last, unless the foot is new there.
FiniteContact::State::FootAnswer* FiniteContact::felt_at(const Vec3& place) {
  const auto far = [&](const State::FootAnswer& one) { return (one.place - place).norm(); };
  const auto last = std::ranges::min_element(state_.felt, {}, far);
  return last != state_.felt.end() && far(*last) < kSameFoot ? &*last : nullptr;
}

/// `last`: where it goes on from; null: a foot that is new.
std::optional<TangentAnswer> FiniteContact::answer_at_foot(std::size_t begin, const MatrixX& shares,
                                                           const HeldBody& held,
                                                           const State::FootAnswer* last) const {
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
  const auto rows = static_cast<Eigen::Index>(held.rows);
  if (last) {
    asked.guess = Eigen::Map<const MatrixX>(last->displacements.data(), n, 3);
    if (rows > 0 && last->forces.size() == 3 * held.rows)
      asked.guessed_forces = Eigen::Map<const MatrixX>(last->forces.data(), rows, 3);
  } else {
    asked.guess = answers_to(forces);
  }
  return answer_of_tangent(body_.solver.body(), u, changed_, asked, held,
                           last ? kRoundsOn : kRoundsAnew);
}

/// What mean forces on the foot lose of their answer at rest, by the tangent's: in sums by `wide`.
MatrixX FiniteContact::lost_to_mean_forces(const TangentAnswer& answer, std::size_t begin,
                                           const MatrixX& wide, const Holding& holding,
                                           const MatrixX& near) const {
  const Eigen::Index own = wide.cols();
  MatrixX moved(own, 3);
  for (Eigen::Index c = 0; c < 3; ++c) {
    moved.col(c) = moved_cells(answer.displacements.col(c)).segment(at(begin), own);
    for (std::size_t i = 0; i < holding.ways.size(); ++i)
      moved.col(c) +=
          answer.forces(static_cast<Eigen::Index>(i), c) *
          (near.block(at(begin), 3 * holding.ways[i].cell, own, 3) * holding.ways[i].direction);
  }
  const MatrixX rest = wide *
                       (response_.block(at(begin), at(begin), own, own) -
                        near.block(at(begin), at(begin), own, own)) *
                       wide.topRows(3).transpose();
  MatrixX lost = rest - wide * moved;
  const Mat3 mean = rest.topRows<3>() - answer.response;
  lost.topRows<3>() = 0.5 * (mean + mean.transpose());
  return lost;
}

/// Asked of the tangent in every second frame, and kept for the one between: what is refined by
/// turns alone would be stiffer and softer by turns, which gives a hand energy.
std::optional<MatrixX> FiniteContact::lost_by_strain(std::size_t begin, std::size_t end,
                                                     const MatrixX& shares, const Holding& holding,
                                                     const MatrixX& by_hold) {
  const std::vector<double>& u = state_.motion.displacements;
  if (std::ranges::all_of(u, [](double one) { return one == 0.0; })) return std::nullopt;
  const Eigen::Index sums = 3 * shares.rows();
  const std::size_t numbers = 3 * static_cast<std::size_t>(sums);
  Vec3 place = Vec3::Zero();
  for (std::size_t k = begin; k < end; ++k) place += state_.places[k].position;
  place /= static_cast<double>(end - begin);
  State::FootAnswer* last = felt_at(place);
  const bool keep = last && !last->kept && last->lost.size() == numbers &&
                    last->forces.size() == 3 * holding.ways.size();
  if (!keep) {
    const MatrixX near = turned(near_);
    const HeldBody held = held_body(holding, begin, end, shares, near);
    const auto answer = answer_at_foot(begin, shares, held, last);
    if (!answer) {
      if (last) state_.felt.erase(state_.felt.begin() + (last - state_.felt.data()));
      ++tangents_refused_;
      return std::nullopt;
    }
    MatrixX wide = MatrixX::Zero(sums, at(end - begin));  // the shares of each axis
    for (Eigen::Index c = 0; c < shares.rows(); ++c)
      for (Eigen::Index k = 0; k < shares.cols(); ++k)
        wide.block<3, 3>(3 * c, 3 * k).diagonal().setConstant(shares(c, k));
    const MatrixX lost = lost_to_mean_forces(*answer, begin, wide, holding, near);
    if (!last) last = &state_.felt.emplace_back();
    const auto all_of = [](const MatrixX& m) {
      return std::vector<double>(m.data(), m.data() + m.size());
    };
    last->displacements = all_of(answer->displacements);
    last->forces = all_of(answer->forces);
    last->lost = all_of(lost);
  }
  last->place = place;
  last->asked = true;
  last->kept = keep;
  MatrixX lost = MatrixX::Zero(sums, sums);
  if (by_hold.size() > 0) lost = by_hold;
  lost.leftCols<3>() = Eigen::Map<const MatrixX>(last->lost.data(), sums, 3);
  lost.topRightCorner(3, sums - 3) = lost.bottomLeftCorner(sums - 3, 3).transpose();
  return lost;
}

}  // namespace viscera
