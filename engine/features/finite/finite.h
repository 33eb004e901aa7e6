// Organs at finite strain: what of a scene they can't carry yet, and how their steps go.
#pragma once

#include "engine/simulation/feature.h"

namespace viscera {

/// How the steps of one organ went so far.
struct FiniteFigures {
  static constexpr std::string_view kName = "steps at finite strain";
  std::uint64_t steps = 0;         ///< with something moving
  std::uint64_t iterations = 0;    ///< quasi-Newton steps in all
  std::uint64_t lost = 0;          ///< steps that ended in no sound state
  std::uint64_t unsettled = 0;     ///< steps beyond kMostResidual
  double greatest_residual = 0.0;  ///< what a further iteration would have gained over the energy
  static constexpr auto fields() {
    using F = FiniteFigures;
    return std::tuple(field("steps", &F::steps), field("iterations", &F::iterations),
                      field("lost", &F::lost), field("unsettled", &F::unsettled),
                      field("greatest_residual", &F::greatest_residual));
  }
};
static_assert(fields_cover<FiniteFigures>());

/// To be called before an organ's contact is solved, and after; nothing for others.
void begin_finite_step(World& world, Entity organ);
void note_finite_step(World& world, Entity organ, FrameReport& report);

Feature finite_feature();

}  // namespace viscera
