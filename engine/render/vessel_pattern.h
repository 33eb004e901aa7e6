// A square of branching surface vessels that repeats in both directions, grown by space
// colonisation [Runions2005]: tips grow towards the points that still lack blood, and a vessel's
// width follows from what it feeds [Murray1926].
#pragma once

#include <cstdint>
#include <vector>

namespace viscera {

/// Coverage 0 ... 255 of arteries and of veins, two bytes a texel, rows of `edge` texels.
struct VesselPattern {
  int edge = 0;
  std::vector<std::uint8_t> coverage;
};

/// The trunks stand about a third of the square apart. The same on every machine.
VesselPattern grow_vessels(int edge);

}  // namespace viscera
