// A soft body under a pressure of its own modulus: what a free block between two plates without
// friction presses back, beside what its law says exactly (engine/verification/uniaxial.h).
#pragma once

#include <iosfwd>
#include <vector>

#include "engine/features/free_bodies/block_between_plates.h"
#include "engine/simulation/frame_flag.h"
#include "kernels/base/result.h"
#include "kernels/paff/elasticity.h"

namespace viscera {

struct PressureFrame {
  double press = 0.0;     ///< how far the plate has come down [m]
  double force = 0.0;     ///< that presses the plate [N]
  double exact = 0.0;     ///< by the law [N]
  double pressure = 0.0;  ///< by the law, over the area as it is [Pa]
  double residual = 0.0;  ///< FiniteStep::residual
  double overlap = 0.0;   ///< how far a vertex of the block lies beyond the plate or floor [m]
  double took = 0.0;      ///< [s]
  FlagSet flags;
};

struct PressureCurve {
  IsotropicMaterial material;
  std::vector<PressureFrame> frames;
  /// The first frame that a flag says isn't right; null: there is none.
  const PressureFrame* first_refused() const;
  /// Of frames before that, in which the law presses by this at least [Pa]: the greatest error of
  /// the force over the exact one; and how far the block lies beyond a plate, at most [m].
  double greatest_error(double from_pressure) const;
  double greatest_overlap() const;
};

/// Until the law has pressure `until` [Pa], in options.time; options.press isn't looked at.
Result<PressureCurve> press_block(const IsotropicMaterial& material, double until,
                                  BlockBetweenPlates options);

/// A line at each tenth of the modulus: force beside the law's, residual, overlap and flags.
void print_pressure(const PressureCurve& curve, std::ostream& out);

}  // namespace viscera
