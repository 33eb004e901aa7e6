// A rigid grip: points of the tissue that are all held, wherever they are taken.
#pragma once

#include <span>
#include <vector>

#include "kernels/finite/finite_touch.h"

namespace viscera {

/// Points of the tissue that something holds, by the fields there: u(p) = sum_J phi_J(p) u_J.
struct HeldRows {
  std::vector<std::size_t> begin{0};  ///<                                              (points + 1)
  std::vector<int> nodes;             ///<                                                 (entries)
  std::vector<double> values;         ///<                                                 (entries)

  std::size_t points() const { return begin.size() - 1; }
  void add(std::span<const int> point_nodes, std::span<const double> point_values);
};

/// Rows with what the factor makes of them; as long as the same is held they stay.
struct Grip {
  HeldRows rows;
  MatrixX columns;          ///< P^-1 Phi^T [m/N]                            (3 N) x (3 points)
  std::vector<int> groups;  ///< 0 of the nodes that it reaches, -1 of the others          (N)
};

class GripTouch : public FiniteTouch {
 public:
  /// Takes the points, each to its displacement [m]. `last`: FiniteStep::forces of the step before,
  /// if the same grip held the body then and nothing else did. The grip outlives it.
  GripTouch(const Grip& grip, std::span<const Vec3> displacements, std::span<const Vec3> last = {});

  std::size_t cells() const override { return grip_.rows.points(); }
  std::int32_t held() const override { return static_cast<std::int32_t>(cells()); }
  std::span<const int> groups() const override { return grip_.groups; }
  void turn(const NodalRotations& rotations) override;
  const MatrixX& response() const override { return response_; }
  VectorX displaced(const VectorX& u) const override;
  VectorX answer_to(const VectorX& forces) const override { return columns_ * forces; }
  void add_loads(const VectorX& forces, VectorX& loads) const override;
  std::optional<VectorX> standing() const override {
    return last_.size() > 0 ? std::optional(last_) : std::nullopt;
  }
  double begin(const VectorX& displaced) override;
  std::optional<VectorX> solve(const TouchQuestion& question) override;

 private:
  const Grip& grip_;
  VectorX wanted_, last_, begun_;
  MatrixX columns_, response_;  // of the turned factor
};

}  // namespace viscera
