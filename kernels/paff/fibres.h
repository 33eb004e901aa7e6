// One family of fibres that tissue is reinforced by.
#pragma once

#include "kernels/base/types.h"

namespace viscera {

/// At rest they add to the stress along them `modulus` times the strain along them: in small
/// strains 1/2 modulus (a . eps a)^2 to the energy's density. kernels/finite/fibre_law.h has what
/// they do beyond.
struct Fibres {
  Vec3 direction = Vec3::UnitX();  ///< a, of length 1; at rest
  double modulus = 0.0;            ///< [Pa]; 0: there are none

  bool operator==(const Fibres&) const = default;
};

}  // namespace viscera
