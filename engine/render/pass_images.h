// The ground truth of a picture: what it is made of, pixel by pixel, before exposure, film curve
// and the lens's distortion.
#pragma once

#include <cstdint>
#include <vector>

namespace viscera {

/// Rows from the top; three values a pixel for colours, one for all others. Linear light: 1 is a
/// white matte surface 10 cm before the lens. beauty = clean * transmittance * light_transmittance
/// + scattered.
struct PassImages {
  int width = 0, height = 0;
  std::vector<float> beauty;               ///< with smoke, linear RGB
  std::vector<float> clean;                ///< without
  std::vector<float> scattered;            ///< light that smoke sends to the lens
  std::vector<float> transmittance;        ///< share that comes through smoke from surface to lens
  std::vector<float> light_transmittance;  ///< and from the light guide to the surface
  std::vector<float> depth;  ///< along the view axis [m]; infinite where nothing is seen
  std::vector<float> surface_temperature;  ///< [K]; NaN: unknown
  std::vector<float> smoke_temperature;    ///< mean over the smoke on the way, by mass [K]
  std::vector<std::uint32_t>
      labels;  ///< 0: nothing; 1 ...: organs, instruments, beds, as in the view
};

}  // namespace viscera
