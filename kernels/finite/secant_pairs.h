// Limited-memory BFGS [Nocedal1980] on top of any first guess H0 of the inverse Hessian.
#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>
#include <functional>
#include <utility>
#include <vector>

#include "kernels/base/types.h"

namespace viscera {

/// Steps s and the changes y of the gradient that came with them, with H0 y. Since H0 is linear,
/// H0 y is the difference of what H0 made of the two gradients: no further solve.
class SecantPairs {
 public:
  static constexpr std::size_t kMost = 5;

  /// Keeps the pair if y bends upwards along s; whether it did.
  bool add(VectorX s, VectorX y, VectorX h0_y);
  void clear() { pairs_.clear(); }
  std::size_t size() const { return pairs_.size(); }
  /// From now on H0 is this share of what it was: the body is stiffer than its first guess.
  void stiffen(double share) { scale_ *= share; }
  /// Four times as much of it again, at most all.
  void relax() { scale_ = std::min(1.0, 4.0 * scale_); }
  double scale() const { return scale_; }  ///< of H0

  /// H v, given H0 v.
  VectorX apply(const VectorX& v, VectorX h0_v) const { return apply(v, std::move(h0_v), size()); }

  /// Phi (H - H0) Phi^T, `rows` giving Phi v, `response` Phi H0 Phi^T; empty: they are the same. H0
  /// as it is given, before stiffen().
  MatrixX response_change(const std::function<VectorX(const VectorX&)>& rows,
                          const MatrixX& response) const;

 private:
  /// By the first `count` pairs alone.
  VectorX apply(const VectorX& v, VectorX h0_v, std::size_t count) const;

  struct Pair {
    VectorX s, y, h0_y;
    double rho;  // 1 / s.y
  };
  std::deque<Pair> pairs_;
  double scale_ = 1.0;
};

}  // namespace viscera
