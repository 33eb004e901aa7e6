#include "kernels/contact/contact_sweeps.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "kernels/base/parallel.h"
#include "kernels/contact/rise_to_positive.h"

namespace viscera {
namespace {

constexpr int kMostSweeps = 200;
/// A block that violates its conditions by less than this share of the tolerance isn't pressed.
constexpr double kQuiet = 0.1;
/// Passes over a block before its neighbours are asked again: until what it violated has shrunk to
/// this share.
constexpr int kMostPasses = 20;
constexpr double kEnough = 0.05;

std::array<int, 2> bodies_of(const IslandUnknown& unknown) {
  std::array<int, 2> bodies = {unknown.terms[0].body, unknown.terms[1].body};
  std::ranges::sort(bodies);
  return bodies;
}

Eigen::Index at(int cell) {
  return Eigen::Index{3} * cell;
}

}  // namespace

void ContactSweeps::part(std::span<const IslandUnknown> unknowns,
                         std::span<const ContactCondition> conditions) {
  std::map<std::array<int, 2>, std::size_t> block_of;
  std::size_t used = 0, u = 0;
  for (const ContactCondition& condition : conditions) {
    const auto [found, fresh] = block_of.try_emplace(bodies_of(unknowns[u]), used);
    if (fresh) {
      if (used == blocks_.size()) blocks_.emplace_back();
      blocks_[used].unknowns.clear();
      blocks_[used].from.clear();
      blocks_[used].conditions.clear();
      ++used;
    }
    Block& block = blocks_[found->second];
    block.conditions.push_back(condition);
    for (int i = 0; i < condition.unknowns(); ++i, ++u) {
      block.unknowns.push_back(unknowns[u]);
      block.from.push_back(static_cast<Eigen::Index>(u));
    }
  }
  blocks_.resize(used);
}

void ContactSweeps::take_turns(std::size_t bodies) {
  std::vector<std::vector<char>> busy;  // bodies, by turns
  turns_.clear();
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    const std::array<int, 2> two = bodies_of(blocks_[b].unknowns.front());
    const auto is_busy = [&](const std::vector<char>& turn) {
      return std::ranges::any_of(
          two, [&](int body) { return body >= 0 && turn[static_cast<std::size_t>(body)]; });
    };
    const auto turn =
        static_cast<std::size_t>(std::ranges::find_if_not(busy, is_busy) - busy.begin());
    if (turn == busy.size()) {
      busy.emplace_back(bodies, 0);
      turns_.emplace_back();
    }
    turns_[turn].push_back(b);
    for (const int body : two)
      if (body >= 0) busy[turn][static_cast<std::size_t>(body)] = 1;
  }
}

/// What is pressed of each, and how it answers there.
void ContactSweeps::take_bodies(std::span<const MatrixX* const> responses) {
  bodies_.resize(responses.size());
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    bodies_[b].place_of.assign(static_cast<std::size_t>(responses[b]->rows() / 3), -1);
    bodies_[b].rows.clear();
  }
  for (Block& block : blocks_)
    for (IslandUnknown& unknown : block.unknowns)
      for (IslandTerm& term : unknown.terms) {
        if (term.body < 0) continue;
        Body& body = bodies_[static_cast<std::size_t>(term.body)];
        int& place = body.place_of[static_cast<std::size_t>(term.cell)];
        if (place < 0) {
          place = static_cast<int>(body.rows.size() / 3);
          for (int axis = 0; axis < 3; ++axis) body.rows.push_back(at(term.cell) + axis);
        }
        term.cell = place;
      }
  parallel_for_each_index(bodies_.size(), 1, [&](std::size_t b) {
    Body& body = bodies_[b];
    body.response = (*responses[b])(body.rows, body.rows);
    body.moved.setZero(body.response.rows());
  });
}

/// By which share it had to be lifted.
double ContactSweeps::assemble(double ridge, Block& block) const {
  const auto count = static_cast<Eigen::Index>(block.unknowns.size());
  const auto of = [&](Eigen::Index i) -> const IslandUnknown& {
    return block.unknowns[static_cast<std::size_t>(i)];
  };
  block.matrix.resize(count, count);
  block.added.resize(count);
  for (Eigen::Index i = 0; i < count; ++i)
    for (Eigen::Index j = 0; j <= i; ++j) {
      double sum = 0.0;
      for (const IslandTerm& row : of(i).terms)
        for (const IslandTerm& column : of(j).terms)
          if (row.body >= 0 && row.body == column.body)
            sum += row.along.dot(bodies_[static_cast<std::size_t>(row.body)].response.block<3, 3>(
                                     at(row.cell), at(column.cell)) *
                                 column.along);
      block.matrix(i, j) = block.matrix(j, i) = sum;
    }
  for (Eigen::Index i = 0; i < count; ++i) {
    block.added[i] = ridge * block.matrix(i, i) + of(i).softness;
    block.matrix(i, i) += block.added[i];
  }
  block.lifted.resize(0, 0);
  double share = 0.0;
  if (Eigen::LLT<MatrixX>(block.matrix).info() != Eigen::Success) {
    Rise rise = rise_to_positive(block.matrix, ridge);
    if (rise.matrix.size() > 0) block.matrix += rise.matrix;
    block.lifted = std::move(rise.matrix);
    share = rise.share;
  }
  block.step = forces_of_gaps(block.matrix.diagonal(), block.conditions);
  return share;
}

/// And by how much they violate the conditions.
void ContactSweeps::find_gaps(Block& block) const {
  block.gaps = block.added.cwiseProduct(block.x) - block.wanted;
  if (block.lifted.size() > 0) block.gaps += block.lifted * block.x;
  for (Eigen::Index i = 0; i < block.x.size(); ++i)
    for (const IslandTerm& term : block.unknowns[static_cast<std::size_t>(i)].terms)
      if (term.body >= 0)
        block.gaps[i] += term.along.dot(
            bodies_[static_cast<std::size_t>(term.body)].moved.segment<3>(at(term.cell)));
  contact_residual(block.conditions, block.step, block.x, block.gaps, block.residual);
  block.violated = block.residual.cwiseAbs().maxCoeff();
}

/// What answers the block's own conditions as its neighbours press now.
void ContactSweeps::press(Block& block) const {
  block.before = block.x;
  for (int pass = 0; pass < kMostPasses; ++pass) {
    sweep_contact(block.matrix, block.conditions, block.x, block.gaps);
    contact_residual(block.conditions, block.step, block.x, block.gaps, block.residual);
    if (block.residual.cwiseAbs().maxCoeff() <= kEnough * block.violated) return;
  }
}

/// The block's two bodies, by what its forces have become more.
void ContactSweeps::move(const Block& block) {
  const auto is_same = [](const IslandTerm& one, const IslandTerm& other) {
    return one.body == other.body && one.cell == other.cell;
  };
  const auto same_cells = [&](const IslandUnknown& one, const IslandUnknown& other) {
    return is_same(one.terms[0], other.terms[0]) && is_same(one.terms[1], other.terms[1]);
  };
  std::size_t i = 0;
  while (i < block.unknowns.size()) {
    const IslandUnknown& first = block.unknowns[i];
    // Unknowns of one cell follow each other.
    std::array<Vec3, 2> more = {Vec3::Zero(), Vec3::Zero()};
    for (; i < block.unknowns.size() && same_cells(first, block.unknowns[i]); ++i) {
      const double change =
          block.x[static_cast<Eigen::Index>(i)] - block.before[static_cast<Eigen::Index>(i)];
      for (std::size_t e = 0; e < 2; ++e) more[e] += change * block.unknowns[i].terms[e].along;
    }
    for (std::size_t e = 0; e < 2; ++e) {
      if (first.terms[e].body < 0 || more[e].isZero(0.0)) continue;
      Body& body = bodies_[static_cast<std::size_t>(first.terms[e].body)];
      body.moved.noalias() += body.response.middleCols<3>(at(first.terms[e].cell)) * more[e];
    }
  }
}

SweepFigures ContactSweeps::solve(std::span<const MatrixX* const> responses,
                                  std::span<const IslandUnknown> unknowns,
                                  std::span<const ContactCondition> conditions, double ridge,
                                  double tolerance, const VectorX& wanted, VectorX& x) {
  SweepFigures figures;
  if (x.size() != wanted.size()) x.setZero(wanted.size());
  const auto give_up = [&] {
    x.setZero();
    figures.converged = false;
    figures.residual = 1.0;
    return figures;
  };
  if (!wanted.allFinite() || !x.allFinite()) return give_up();
  into_cones(conditions, x);
  part(unknowns, conditions);
  take_turns(responses.size());
  take_bodies(responses);
  figures.blocks = static_cast<int>(blocks_.size());
  if (std::ranges::any_of(blocks_,
                          [](const Block& b) { return b.from.size() > kMostDenseUnknowns; }))
    return give_up();
  std::vector<double> lifted(blocks_.size());
  parallel_for_each_index(blocks_.size(), 1, [&](std::size_t b) {
    Block& block = blocks_[b];
    lifted[b] = assemble(ridge, block);
    block.x = x(block.from);
    block.before.setZero(block.x.size());
    block.wanted = wanted(block.from);
  });
  for (const double share : lifted) figures.lifted = std::max(figures.lifted, share);
  for (const Block& block : blocks_)
    if (!block.matrix.allFinite() || !(block.matrix.diagonal().minCoeff() > 0.0)) return give_up();
  const auto in_turns = [&](const auto& body) {
    for (const std::vector<std::size_t>& turn : turns_)
      parallel_for_each_index(turn.size(), 1, [&](std::size_t i) { body(blocks_[turn[i]]); });
  };
  in_turns([&](Block& block) { move(block); });
  const auto greatest_force = [&] {
    double greatest = 0.0;
    for (const Block& block : blocks_) greatest = std::max(greatest, block.x.cwiseAbs().maxCoeff());
    return greatest;
  };
  double greatest = greatest_force();
  for (;; ++figures.sweeps) {
    const double quiet = kQuiet * tolerance * greatest;
    in_turns([&](Block& block) {
      find_gaps(block);
      if (!(block.violated > quiet)) return;
      press(block);
      move(block);
    });
    greatest = greatest_force();
    double worst = 0.0;
    for (const Block& block : blocks_) worst = std::max(worst, block.violated);
    const bool finite = std::ranges::all_of(blocks_, [](const Block& block) {
      return std::isfinite(block.violated) && block.x.allFinite();
    });
    if (!finite) return give_up();
    figures.residual = greatest > 0.0 ? worst / greatest : worst > 0.0 ? 1.0 : 0.0;
    figures.converged = figures.residual <= tolerance;
    if (figures.converged || figures.sweeps == kMostSweeps) break;
  }
  for (const Block& block : blocks_) x(block.from) = block.x;
  return figures;
}

}  // namespace viscera
