// What a deformed body does under a few more loads, small and slow ones, while others hold it: the
// answer of its tangent, without mass and viscosity.
//
// With K the exact second derivative of the energy where the body is, B the rows of what holds it
// (B x + N f + b = 0 for forces f: N is what gives way besides, b what the loads do to it beyond
// the nodes), the answer x to loads L makes
//   1/2 x K x + 1/2 f N f - L x
// least among all that meet the rows. The preconditioner H of a step gives a first guess that does,
// and each round one more: H of what is missing, brought back onto the rows (as [Gould2001] does
// for one load). The best in all their span is taken, for all loads together. So the response
// errs by the square of what the displacements err by, always towards too stiff.
#pragma once

#include <functional>
#include <optional>
#include <span>

#include "kernels/finite/finite_body.h"

namespace viscera {

/// What holds the body, by the preconditioner H.
struct HeldBody {
  std::size_t rows = 0;                            ///< 0: nothing else does
  std::function<MatrixX(const MatrixX&)> moved;    ///< B x                              (rows x m)
  std::function<MatrixX(const MatrixX&)> loads;    ///< B^T f                            (3 N x m)
  std::function<MatrixX(const MatrixX&)> answers;  ///< H B^T f                          (3 N x m)
  MatrixX response;                                ///< B H B^T + N, symmetric, positive
  MatrixX beyond;                                  ///< N
  MatrixX apart;                                   ///< b; empty: none                   (rows x m)
};

struct TangentLoads {
  MatrixX loads;  ///< L [N]                                                              (3 N x m)
  /// Where to begin: H L, or an answer that was right a moment ago.                       (3 N x m)
  MatrixX guess;
  MatrixX guessed_forces;  ///< with it; empty: none                                      (rows x m)
  /// H g, columns one after another.
  std::function<void(std::span<const double>, std::span<double>)> precondition;
};

struct TangentAnswer {
  MatrixX displacements;  ///< x [m]                                                      (3 N x m)
  MatrixX forces;         ///< f [N]                                                      (rows x m)
  MatrixX response;       ///< of the loads to each other, symmetric [m/N]                  (m x m)
};

/// After so many rounds. Nothing where the tangent isn't positive in what they span: there is no
/// least.
std::optional<TangentAnswer> answer_of_tangent(const FiniteBody& body,
                                               std::span<const double> displacements,
                                               const ChangedTissue& changed,
                                               const TangentLoads& loads, const HeldBody& held,
                                               int rounds);

}  // namespace viscera
