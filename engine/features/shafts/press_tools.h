// Instruments press each other, and the endoscope: as tubes that bend, without friction. Two that
// cross keep the side on which they came, however far a frame carries them.
#pragma once

#include <vector>

#include "engine/simulation/frame.h"
#include "engine/simulation/world.h"

namespace viscera {

/// What another tool does to one.
struct ToolPress {
  Entity tool;                    ///< that feels it
  Entity other;                   ///< that does it
  Vec3 force = Vec3::Zero();      ///< on `tool`, world [N]
  Vec3 at = Vec3::Zero();         ///< of its axis [m]
  Vec3 direction = Vec3::Zero();  ///< unit, of the force
  double stiffness = 0.0;         ///< by how much the force falls as that place goes this way [N/m]
  double overlap = 0.0;           ///< of the tubes as they are drawn [m]
};

/// As the scene begins: tools -> ShaftState::sides.
void note_sides(World& world);
/// Poses of tools -> ShaftState::sides; two for each pair that touches.
std::vector<ToolPress> press_tools(World& world, const FrameContext& context);

}  // namespace viscera
