// Beds of organs that are cut: the same bonds, on the bodies that the organs are.
//
// A bond keeps its end while tissue is left within its own radius of it, and is lost otherwise: no
// force and no heat has parted it, but what it held is gone. Forces act on cells of the same side
// of a cut only, so a bed ties no two sides of a kerf to each other.
#pragma once

#include <vector>

#include "engine/features/beds/bed_places.h"
#include "engine/simulation/world.h"

namespace viscera {

/// Of a bed of which an organ has become another body by a cut; they count in place of Bed::places.
struct BedPlacesLeft {
  BedPlaces places;
};

/// Where a bed's bonds and cells lie on the bodies that its organs are.
const BedPlaces& places_now(const World& world, Entity bed);

/// As Feature::replaced has it: bonds whose tissue has gone are parted by the cut.
void bed_what_is_left(World& world, Entity organ, const Continuation* continuation);

/// Of pieces that have come off one of its organs and that a bond still holds: tissue that is left
/// on the bed [m3].
double tissue_left_on(const World& world, Entity bed);

}  // namespace viscera
