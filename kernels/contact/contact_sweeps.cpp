#include "kernels/contact/contact_sweeps.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "kernels/base/parallel.h"

namespace viscera {
namespace {

constexpr double kTolerance = 1e-6;
constexpr int kMostSweeps = 200;
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
      blocks_[used].conditions.clear();
      ++used;
    }
    Block& block = blocks_[found->second];
    block.conditions.push_back(condition);
    for (int i = 0; i < condition.unknowns(); ++i, ++u)
      block.unknowns.push_back(static_cast<Eigen::Index>(u));
  }
  blocks_.resize(used);
}

void ContactSweeps::assemble(std::span<const MatrixX* const> responses,
                             std::span<const IslandUnknown> unknowns, double ridge,
                             Block& block) const {
  const auto count = static_cast<Eigen::Index>(block.unknowns.size());
  const auto of = [&](Eigen::Index i) -> const IslandUnknown& {
    return unknowns[static_cast<std::size_t>(block.unknowns[static_cast<std::size_t>(i)])];
  };
  block.matrix.resize(count, count);
  block.added.resize(count);
  for (Eigen::Index i = 0; i < count; ++i)
    for (Eigen::Index j = 0; j <= i; ++j) {
      double sum = 0.0;
      for (const IslandTerm& row : of(i).terms)
        for (const IslandTerm& column : of(j).terms)
          if (row.body >= 0 && row.body == column.body)
            sum += row.along.dot(responses[static_cast<std::size_t>(row.body)]->block<3, 3>(
                                     at(row.cell), at(column.cell)) *
                                 column.along);
      block.matrix(i, j) = block.matrix(j, i) = sum;
    }
  for (Eigen::Index i = 0; i < count; ++i) {
    block.added[i] = ridge * block.matrix(i, i) + of(i).softness;
    block.matrix(i, i) += block.added[i];
  }
  block.step = forces_of_gaps(block.matrix.diagonal(), block.conditions);
}

void ContactSweeps::find_gaps(std::span<const IslandUnknown> unknowns, const VectorX& wanted,
                              Block& block) {
  block.gaps.resize(block.x.size());
  for (Eigen::Index i = 0; i < block.x.size(); ++i) {
    const Eigen::Index u = block.unknowns[static_cast<std::size_t>(i)];
    double gap = block.added[i] * block.x[i] - wanted[u];
    for (const IslandTerm& term : unknowns[static_cast<std::size_t>(u)].terms)
      if (term.body >= 0)
        gap +=
            term.along.dot(moved_[static_cast<std::size_t>(term.body)].segment<3>(at(term.cell)));
    block.gaps[i] = gap;
  }
}

/// What answers the block's own conditions as its neighbours press now.
void ContactSweeps::press(Block& block, double violated) const {
  for (int pass = 0; pass < kMostPasses; ++pass) {
    sweep_contact(block.matrix, block.conditions, block.x, block.gaps);
    contact_residual(block.conditions, block.step, block.x, block.gaps, block.residual);
    if (block.residual.cwiseAbs().maxCoeff() <= kEnough * violated) return;
  }
}

/// The block's two bodies, by what its forces have become more.
void ContactSweeps::move(std::span<const MatrixX* const> responses,
                         std::span<const IslandUnknown> unknowns, const Block& block) {
  for (Eigen::Index i = 0; i < block.x.size();) {
    const std::array<IslandTerm, 2>& first =
        unknowns[static_cast<std::size_t>(block.unknowns[static_cast<std::size_t>(i)])].terms;
    // Unknowns of one cell follow each other.
    std::array<Vec3, 2> more = {Vec3::Zero(), Vec3::Zero()};
    for (; i < block.x.size(); ++i) {
      const std::array<IslandTerm, 2>& terms =
          unknowns[static_cast<std::size_t>(block.unknowns[static_cast<std::size_t>(i)])].terms;
      if (terms[0].body != first[0].body || terms[0].cell != first[0].cell ||
          terms[1].body != first[1].body || terms[1].cell != first[1].cell)
        break;
      for (std::size_t e = 0; e < 2; ++e)
        more[e] += (block.x[i] - block.before[i]) * terms[e].along;
    }
    for (std::size_t e = 0; e < 2; ++e)
      if (first[e].body >= 0 && !more[e].isZero(0.0)) {
        const auto body = static_cast<std::size_t>(first[e].body);
        moved_[body].noalias() += responses[body]->middleCols<3>(at(first[e].cell)) * more[e];
      }
  }
}

SweepFigures ContactSweeps::solve(std::span<const MatrixX* const> responses,
                                  std::span<const IslandUnknown> unknowns,
                                  std::span<const ContactCondition> conditions, double ridge,
                                  const VectorX& wanted, VectorX& x) {
  SweepFigures figures;
  if (x.size() != wanted.size()) x.setZero(wanted.size());
  const auto give_up = [&] {
    x.setZero();
    return figures;
  };
  if (!wanted.allFinite() || !x.allFinite()) return give_up();
  into_cones(conditions, x);
  part(unknowns, conditions);
  figures.blocks = static_cast<int>(blocks_.size());
  parallel_for_each_index(blocks_.size(), 1, [&](std::size_t b) {
    assemble(responses, unknowns, ridge, blocks_[b]);
    blocks_[b].x = x(blocks_[b].unknowns);
    blocks_[b].before.setZero(blocks_[b].x.size());
  });
  for (const Block& block : blocks_)
    if (!block.matrix.allFinite() || !(block.matrix.diagonal().minCoeff() > 0.0)) return give_up();
  moved_.resize(responses.size());
  for (std::size_t b = 0; b < responses.size(); ++b) moved_[b].setZero(responses[b]->rows());
  for (const Block& block : blocks_) move(responses, unknowns, block);

  for (;; ++figures.sweeps) {
    double worst = 0.0, greatest = 0.0;
    for (Block& block : blocks_) {
      find_gaps(unknowns, wanted, block);
      contact_residual(block.conditions, block.step, block.x, block.gaps, block.residual);
      const double violated = block.residual.cwiseAbs().maxCoeff();
      worst = std::max(worst, violated);
      if (violated > 0.0) {
        block.before = block.x;
        press(block, violated);
        move(responses, unknowns, block);
      }
      greatest = std::max(greatest, block.x.cwiseAbs().maxCoeff());
    }
    figures.residual = greatest > 0.0 ? worst / greatest : worst > 0.0 ? 1.0 : 0.0;
    figures.converged = figures.residual <= kTolerance;
    if (figures.converged || figures.sweeps == kMostSweeps || !std::isfinite(worst)) break;
  }
  for (const Block& block : blocks_) x(block.unknowns) = block.x;
  if (!x.allFinite()) return give_up();
  return figures;
}

}  // namespace viscera
