// A body at finite strain that nothing touches.
#pragma once

#include <vector>

#include "kernels/finite/finite_touch.h"

namespace viscera {

class Untouched final : public FiniteTouch {
 public:
  /// `like`: whose tissue it is; null: of sound tissue without a memory.
  explicit Untouched(std::size_t nodes, const FiniteTouch* like = nullptr)
      : like_(like), groups_(nodes, -1) {}
  const ChangedTissue& changed() const override {
    return like_ ? like_->changed() : FiniteTouch::changed();
  }
  const Overstress& overstress() const override {
    return like_ ? like_->overstress() : FiniteTouch::overstress();
  }
  std::size_t cells() const override { return 0; }
  std::int32_t held() const override { return 0; }
  std::span<const int> groups() const override { return groups_; }
  void turn(const NodalRotations&) override {}
  const MatrixX& response() const override { return response_; }
  VectorX displaced(const VectorX&) const override { return {}; }
  VectorX answer_to(const VectorX&) const override { return {}; }
  void add_loads(const VectorX&, VectorX&) const override {}
  double begin(const VectorX&) override { return 0.0; }
  std::optional<VectorX> solve(const TouchQuestion&) override { return VectorX(); }
  std::optional<VectorX> standing() const override { return VectorX(); }

 private:
  const FiniteTouch* like_;
  std::vector<int> groups_;
  MatrixX response_;
};

}  // namespace viscera
