// Runge-Kutta-Legendre super-time-stepping of second order [Meyer2014]: s stages cover about s^2 /
// 4 of the explicit step's bound, so a fine grid pays for the root of the ratio and not for the
// ratio.
#pragma once

#include <cmath>

namespace viscera {

/// How many stages a step needs that is `ratio` times the explicit bound [Meyer2014] eq. (20).
inline int super_stages(double ratio) {
  int stages = 2;
  while ((stages * stages + stages - 2) / 4.0 < ratio) ++stages;
  return stages;
}

/// Y_j = newest Y_(j-1) + older Y_(j-2) + first Y_0 + slope dt M(Y_(j-1)) + first_slope dt M(Y_0),
/// [Meyer2014] eqs. (16), (17); stage 1 has no older.
struct SuperStage {
  double newest = 0.0, older = 0.0, first = 0.0, slope = 0.0, first_slope = 0.0;
};

inline SuperStage super_stage(int j, int stages) {
  const auto b = [](int i) {
    return i < 2 ? 1.0 / 3.0 : (i * i + i - 2.0) / (2.0 * i * (i + 1.0));
  };
  const double w = 4.0 / (stages * stages + stages - 2.0);
  if (j == 1) return {0.0, 0.0, 1.0, b(1) * w, 0.0};
  SuperStage stage;
  stage.newest = (2.0 * j - 1.0) / j * b(j) / b(j - 1);
  stage.older = -(j - 1.0) / j * b(j) / b(j - 2);
  stage.first = 1.0 - stage.newest - stage.older;
  stage.slope = stage.newest * w;
  stage.first_slope = -(1.0 - b(j - 1)) * stage.slope;
  return stage;
}

}  // namespace viscera
