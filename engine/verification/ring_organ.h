// An organ of any size without preparation, for tests and benchmarks of what moves surfaces.
#pragma once

#include <memory>

#include "kernels/contact/deformation.h"

namespace viscera {

struct RingSize {
  int places_around = 24, places_across = 10;  ///< at least 3
  int vertices_around = 60, vertices_across = 25;
  int touchable = 30;  ///< places, spread evenly
};

/// A ring (torus) 80 mm wide with places on it, carriers from them to a drawn surface, and a
/// compliance of tissue's size: Kelvin's solution for a point force in an unbounded medium, blunted
/// at the distance of the places.
struct RingOrgan {
  TriangleSurface surface;
  SurfacePlaces places;
  SurfaceCompliance compliance;
  DrawnSurface drawn;
};

/// Stays where it is made: its drawn surface points at its surface.
std::unique_ptr<RingOrgan> make_ring_organ(const RingSize& size);

}  // namespace viscera
