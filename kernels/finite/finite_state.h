// What a body at finite strain keeps from step to step.
#pragma once

#include <cstdint>
#include <tuple>
#include <vector>

#include "kernels/base/fields.h"

namespace viscera {

/// Rotation of each node, column after column                                              (9 N)
using NodalRotations = std::vector<double>;

struct FiniteState {
  std::vector<double> displacements;  ///< [m]                                              (3 N)
  std::vector<double> velocities;     ///< [m/s]                                            (3 N)
  std::vector<double> loads;          ///< of what touched it in the last step [N]          (3 N)
  NodalRotations rotations;           ///<                                                  (9 N)
  std::int32_t steps_since_warp = 0;
  std::int32_t steps_released = 0;  ///< more iterations for so many steps
  std::int32_t held = 0;            ///< places held in the last step
  std::int32_t lost = 0;            ///< steps so far that ended in no sound state

  static constexpr auto fields() {
    using S = FiniteState;
    return std::tuple(field("displacements", &S::displacements),
                      field("velocities", &S::velocities), field("loads", &S::loads),
                      field("rotations", &S::rotations),
                      field("steps_since_warp", &S::steps_since_warp),
                      field("steps_released", &S::steps_released), field("held", &S::held),
                      field("lost", &S::lost));
  }
};
static_assert(fields_cover<FiniteState>());

}  // namespace viscera
