// Pulsation: an organ beats by a prescribed strain, as a vessel or what lies on one. At finite
// strain its tissue swells by it, as a term of the energy, and goes where what holds and touches it
// lets it; the surface of a linear organ is moved.
#pragma once

#include "engine/simulation/feature.h"

namespace viscera {

/// What the scene says of an organ.
struct PulsationDescription {
  double strain = 0.0;  ///< at its greatest: length gained over length
  double rate = 0.0;    ///< beats [1/s]

  /// Strain at `time` [s]: 0 at first, `strain` in the middle of a beat. A raised cosine, chosen by
  /// eye: a pressure wave rises faster than it falls.
  double at(double time) const;
};

struct PulsatingOrgan {
  static constexpr bool kConstant = true;
  PulsationDescription description;
  /// Displacements of the places of the surface per strain [m]: away from the organ's middle,
  /// fading to none where the organ is held. Empty: of an organ at finite strain.      (3 places)
  std::vector<float> swell;
};

struct Pulse {
  static constexpr std::string_view kName = "pulses";
  double strain = 0.0;  ///< now
  static constexpr auto fields() { return std::tuple(field("strain", &Pulse::strain)); }
};

Feature pulsation_feature();

}  // namespace viscera
