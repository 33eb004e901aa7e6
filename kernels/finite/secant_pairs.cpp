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

VectorX SecantPairs::apply(const VectorX& v, VectorX h0_v) const {
  // The two loops, the first of them on v and on H0 v alike.
  std::array<double, kMost> alpha = {};
  VectorX left = v;
  for (std::size_t i = pairs_.size(); i-- > 0;) {
    alpha[i] = pairs_[i].rho * pairs_[i].s.dot(left);
    left -= alpha[i] * pairs_[i].y;
    h0_v -= alpha[i] * pairs_[i].h0_y;
  }
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    const double beta = pairs_[i].rho * pairs_[i].y.dot(h0_v);
    h0_v += (alpha[i] - beta) * pairs_[i].s;
  }
  return h0_v;
}

}  // namespace viscera
