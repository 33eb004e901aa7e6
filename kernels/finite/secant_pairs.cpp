#include "kernels/finite/secant_pairs.h"

#include <array>
#include <utility>

namespace viscera {

bool SecantPairs::add(VectorX s, VectorX y, VectorX h0_y) {
  const double bend = s.dot(y);
  if (!(bend > 1e-12 * s.norm() * y.norm())) return false;
  if (pairs_.size() == kMost) pairs_.pop_front();
  pairs_.push_back({std::move(s), std::move(y), std::move(h0_y), 1.0 / bend});
  return true;
}

VectorX SecantPairs::apply(const VectorX& v, VectorX h0_v, std::size_t count) const {
  // The two loops, the first of them on v and on H0 v alike.
  std::array<double, kMost> alpha = {};
  h0_v *= scale_;
  VectorX left = v;
  for (std::size_t i = count; i-- > 0;) {
    alpha[i] = pairs_[i].rho * pairs_[i].s.dot(left);
    left -= alpha[i] * pairs_[i].y;
    h0_v -= (alpha[i] * scale_) * pairs_[i].h0_y;
  }
  for (std::size_t i = 0; i < count; ++i) {
    const double beta = pairs_[i].rho * pairs_[i].y.dot(h0_v);
    h0_v += (alpha[i] - beta) * pairs_[i].s;
  }
  return h0_v;
}

// H' = (1 - rho s y^T) H (1 - rho y s^T) + rho s s^T, a pair after the other.
MatrixX SecantPairs::response_change(const std::function<VectorX(const VectorX&)>& rows,
                                     const MatrixX& response) const {
  MatrixX change;
  if (scale_ != 1.0) change = (scale_ - 1.0) * response;
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    const Pair& pair = pairs_[i];
    const VectorX h_y = apply(pair.y, pair.h0_y, i);
    const VectorX a = rows(pair.s), b = rows(h_y);
    if (change.size() == 0) change = MatrixX::Zero(a.size(), a.size());
    change.noalias() -= pair.rho * (a * b.transpose() + b * a.transpose());
    change.noalias() += (pair.rho * pair.rho * pair.y.dot(h_y) + pair.rho) * a * a.transpose();
  }
  return change;
}

}  // namespace viscera
