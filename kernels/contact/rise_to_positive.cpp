#include "kernels/contact/rise_to_positive.h"

#include <Eigen/Eigenvalues>

namespace viscera {

// Why the matrix may be indefinite. With D_k the transform of cell k's pressure and g_k that of the
// bell it's spread by, H the half-space's response and B the body's, A_kl is the integral of
// H D_k D_l + (B - H) g_k g_l. Cells of one size on a plane have D and g in common, and D^2 H +
// (B - H) g^2 is positive wherever D >= g. Where cells of several sizes meet at one spot and the
// body is stiffer than a half-space (B < H: thin, or held nearby), two of them have the determinant
// H (B - H) (D_k g_l - D_l g_k)^2 < 0; and around an edge the flat half-space is a guess anyway.
// Such a contact could give energy away. The nearest matrix that can't is the one with its
// eigenvalues lifted to the ridge [Higham1988], taken of the matrix scaled to a unit diagonal. It
// is a continuous function of the cells and of nothing else, so the contact stays conservative.
Rise rise_to_positive(const MatrixX& matrix, double least) {
  if (!matrix.allFinite() || (matrix.diagonal().array() <= 0.0).any()) return {};
  const VectorX scale = matrix.diagonal().cwiseSqrt();
  const VectorX inverse = scale.cwiseInverse();
  const MatrixX scaled = inverse.asDiagonal() * matrix * inverse.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<MatrixX> modes(scaled);
  if (modes.info() != Eigen::Success) return {};
  // Well above what rounding may take from an eigenvalue again.
  const VectorX missing = (least - modes.eigenvalues().array()).max(0.0);
  const MatrixX rise =
      modes.eigenvectors() * missing.asDiagonal() * modes.eigenvectors().transpose();
  return {scale.asDiagonal() * (0.5 * (rise + rise.transpose())) * scale.asDiagonal(),
          missing.maxCoeff() / modes.eigenvalues().maxCoeff()};
}

}  // namespace viscera
