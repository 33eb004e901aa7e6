// What has become of tissue at a body's quadrature points.
#pragma once

#include <tuple>
#include <vector>

#include "kernels/base/fields.h"

namespace viscera {

/// Empty: nothing.
struct TissueChange {
  std::vector<double> stiffness;  ///< E over that of sound tissue, at least 1               (Q)
  std::vector<double> shrinkage;  ///< length lost over length, 0 or more                    (Q)

  static constexpr auto fields() {
    return std::tuple(field("stiffness", &TissueChange::stiffness),
                      field("shrinkage", &TissueChange::shrinkage));
  }
};
static_assert(fields_cover<TissueChange>());

}  // namespace viscera
