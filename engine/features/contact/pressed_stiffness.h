// How much the force of what a tool presses rises as it goes on.
#pragma once

#include <span>

#include "engine/simulation/world.h"

namespace viscera {

/// With all of these cells of an organ's last solve pressed, and pressed on: J^T C^-1 J, C their
/// compliance along their directions, row k of J the way that cell k is pressed per way of the tip;
/// world, symmetric [N/m]. Zero where there is no answer.
Mat3 pressed_stiffness(const World& world, Entity organ, std::span<const std::size_t> cells,
                       std::span<const Vec3> ways);

}  // namespace viscera
