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
  const PointTangents tangents = body.point_tangents(displacements, changed);
  const auto image_of = [&](const MatrixX& x) { return body.tangent_times(tangents, x); };
  Eigen::LLT<MatrixX> hold;
  if (rows > 0) {
    hold.compute(held.response);
    if (hold.info() != Eigen::Success) return std::nullopt;
  }
  /// Moves fields and forces on by H so that what they leave of the rows' motion, `off`, is none.
  const auto bring_back = [&](const MatrixX& off, MatrixX& fields, MatrixX& forces) {
    const MatrixX back = hold.solve(off);
    fields -= held.answers(back);
    forces -= back;
  };
  TangentAnswer answer;
  answer.displacements = loads.guess;
  answer.forces = loads.guessed_forces.size() > 0 ? loads.guessed_forces : MatrixX::Zero(rows, m);
  if (rows > 0) {
    MatrixX off = held.moved(answer.displacements) + held.beyond * answer.forces;
    if (held.apart.size() > 0) off += held.apart;
    bring_back(off, answer.displacements, answer.forces);
  }
  MatrixX images = image_of(answer.displacements);
  Span span;
  span.forces.resize(rows, 0);
  if (held.apart.size() == 0 || held.apart.isZero(0.0))
    span = {answer.displacements, images, answer.forces};
  for (int round = 1; round < rounds; ++round) {
    MatrixX residual = loads.loads - images;
    if (rows > 0) residual += held.loads(answer.forces);
    MatrixX next(n, m), forces = MatrixX::Zero(rows, m);
    const auto numbers = static_cast<std::size_t>(n * m);
    loads.precondition({residual.data(), numbers}, {next.data(), numbers});
    if (rows > 0) bring_back(held.moved(next), next, forces);
    append(span.fields, next);
    append(span.images, image_of(next));
    append(span.forces, forces);

    MatrixX stiffness = span.fields.transpose() * span.images;
    MatrixX pull = span.fields.transpose() * (loads.loads - images);
    if (rows > 0) {
      stiffness += span.forces.transpose() * held.beyond * span.forces;
      pull -= span.forces.transpose() * held.beyond * answer.forces;
    }
    stiffness = (0.5 * (stiffness + stiffness.transpose())).eval();
    if (!stiffness.allFinite() || (stiffness.diagonal().array() <= 0.0).any()) return std::nullopt;
    const VectorX scale = stiffness.diagonal().cwiseSqrt().cwiseInverse();
    stiffness = (scale.asDiagonal() * stiffness * scale.asDiagonal()).eval();
    stiffness.diagonal().array() += kSame;
    const Eigen::LLT<MatrixX> least(stiffness);
    if (least.info() != Eigen::Success) return std::nullopt;
    const MatrixX amounts = scale.asDiagonal() * least.solve(scale.asDiagonal() * pull);
    answer.displacements += span.fields * amounts;
    answer.forces += span.forces * amounts;
    images += span.images * amounts;
  }
  const MatrixX work = loads.loads.transpose() * answer.displacements;
  MatrixX stored = answer.displacements.transpose() * images;
  if (rows > 0) stored += answer.forces.transpose() * held.beyond * answer.forces;
  answer.response = work + work.transpose() - 0.5 * (stored + stored.transpose());
  if (!answer.response.allFinite() || !(stored.diagonal().array() > 0.0).all()) return std::nullopt;
  return answer;
}

}  // namespace viscera
