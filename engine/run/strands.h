// What a bed looks like: a few fibres a bond, that thin as they are drawn out, tear, and leave
// stumps on both organs. How thick they are, and how far torn ones draw back, is chosen by eye.
#pragma once

#include <vector>

#include "engine/features/beds/beds.h"
#include "engine/render/view.h"

namespace viscera {

/// Both halves of every fibre, one after the other, world; none is missing where a bond parted.
std::vector<StrandHalf> strand_halves(const World& world, Entity bed);

}  // namespace viscera
