// A ball on a flat, deep body, answered by a hive and by what goes beyond linear on it: the same
// contact as press_block's (pressed_block.h).
#pragma once

#include <memory>
#include <vector>

#include "kernels/hive/nonlinear_hive.h"

namespace viscera {

class BallAndHive {
 public:
  /// Cells as a tool's foot lays them (haptics/tool_foot.h).
  BallAndHive(const NonlinearSettings& settings, double ball_radius);

  /// Of the linear hive [N].
  double linear(double depth);
  NonlinearForce press(double depth, TimeIsUp time = {});
  /// Ticks of `step` [m] from depth to depth; the last one's answer.
  NonlinearForce go(double from, double to, double step);

  /// Cells for this depth, seated on a hive of this kind.
  void seat(double depth);
  Hive& hive() { return *hive_; }
  NonlinearHive& nonlinear() { return *nonlinear_; }
  const std::vector<ContactCell>& cells() const { return cells_; }
  std::vector<double>& depths() { return depths_; }
  double across() const { return across_; }
  /// Another hive at the same place, seated on the same cells.
  Hive another() const;

 private:
  double ball_;
  int rings_;
  IsotropicMaterial material_;
  std::vector<Vec2> places_;
  std::unique_ptr<WalkableSurface> ground_;
  std::unique_ptr<Hive> hive_;
  std::unique_ptr<NonlinearHive> nonlinear_;
  std::vector<ContactCell> cells_;
  std::vector<double> depths_;
  double across_ = 0.0;
};

}  // namespace viscera
