#include "kernels/finite/tangent_answer.h"

#include <Eigen/Cholesky>

namespace viscera {
namespace {

/// What a span has twice, to this share of a pivot, is left out by a little stiffness: that is less
/// than the response errs by.
constexpr double kSame = 1e-9;

/// More columns on the right.
void append(MatrixX& all, const MatrixX& more) {
  const Eigen::Index had = all.cols();
  all.conservativeResize(more.rows(), had + more.cols());
  all.rightCols(more.cols()) = more;
}

/// Fields that leave what is held where it is, with the forces that do.
struct Span {
  MatrixX fields, images, forces;  // x, K x, f
};

}  // namespace

std::optional<TangentAnswer> answer_of_tangent(const FiniteBody& body,
                                               std::span<const double> displacements,
                                               const ChangedTissue& changed,
                                               const TangentLoads& loads, const HeldBody& held,
                                               int rounds) {
  const Eigen::Index n = loads.loads.rows(), m = loads.loads.cols();
  const auto rows = static_cast<Eigen::Index>(held.rows);
  const auto image_of = [&](const MatrixX& x) {
    return body.tangent_times(displacements, x, changed);
  };
  Eigen::LLT<MatrixX> hold;
  if (rows > 0) {
    hold.compute(held.response);
    if (hold.info() != Eigen::Success) return std::nullopt;
  }
  // What the loads do to what is held beyond the nodes, it makes good of itself.
  Span begun;
  const bool has_begun = rows > 0 && held.apart.size() > 0 && !held.apart.isZero(0.0);
  if (has_begun) {
    begun.forces = -hold.solve(held.apart);
    begun.fields = held.answers(begun.forces);
  }
  Span span;
  span.forces.resize(rows, 0);
  /// Fields brought back onto the rows.
  const auto take = [&](MatrixX fields, MatrixX forces) {
    if (rows > 0) {
      MatrixX off = held.moved(fields);
      if (forces.size() > 0)
        off += held.beyond * forces;
      else
        forces = MatrixX::Zero(rows, m);
      const MatrixX back = hold.solve(off);
      fields -= held.answers(back);
      forces -= back;
      append(span.forces, forces);
    }
    append(span.fields, fields);
    if (!has_begun || begun.images.size() > 0) {
      append(span.images, image_of(fields));
      return;
    }
    append(fields, begun.fields);  // the body is read once for both
    const MatrixX images = image_of(fields);
    span.images = images.leftCols(images.cols() - begun.fields.cols());
    begun.images = images.rightCols(begun.fields.cols());
  };
  TangentAnswer answer;
  take(loads.guess, loads.guessed_forces);
  for (int round = 1;; ++round) {
    MatrixX stiffness = span.fields.transpose() * span.images;
    if (rows > 0) stiffness += span.forces.transpose() * held.beyond * span.forces;
    stiffness = (0.5 * (stiffness + stiffness.transpose())).eval();
    if (!stiffness.allFinite() || (stiffness.diagonal().array() <= 0.0).any()) return std::nullopt;
    const VectorX scale = stiffness.diagonal().cwiseSqrt().cwiseInverse();
    stiffness = (scale.asDiagonal() * stiffness * scale.asDiagonal()).eval();
    stiffness.diagonal().array() += kSame;
    const Eigen::LLT<MatrixX> least(stiffness);
    if (least.info() != Eigen::Success) return std::nullopt;
    MatrixX missing = loads.loads;
    if (has_begun) missing -= begun.images;
    MatrixX pull = span.fields.transpose() * missing;
    if (has_begun) pull -= span.forces.transpose() * held.beyond * begun.forces;
    const MatrixX amounts = scale.asDiagonal() * least.solve(scale.asDiagonal() * pull);

    answer.displacements.noalias() = span.fields * amounts;
    MatrixX images = span.images * amounts;
    answer.forces = rows > 0 ? MatrixX(span.forces * amounts) : MatrixX(0, m);
    if (has_begun) {
      answer.displacements += begun.fields;
      answer.forces += begun.forces;
      images += begun.images;
    }
    if (round == rounds) {
      const MatrixX work = loads.loads.transpose() * answer.displacements;
      MatrixX stored = answer.displacements.transpose() * images;
      if (rows > 0) stored += answer.forces.transpose() * held.beyond * answer.forces;
      answer.response = work + work.transpose() - 0.5 * (stored + stored.transpose());
      if (!answer.response.allFinite()) return std::nullopt;
      return answer;
    }
    MatrixX residual = loads.loads - images;
    if (rows > 0) residual += held.loads(answer.forces);
    MatrixX next(n, m);
    const auto numbers = static_cast<std::size_t>(n * m);
    loads.precondition({residual.data(), numbers}, {next.data(), numbers});
    take(std::move(next), {});
  }
}

}  // namespace viscera
