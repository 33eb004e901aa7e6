// Procedural instruments: tip at the origin, shaft along +z, side along +x.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/render/shader_layout.h"
#include "engine/render/view.h"

namespace viscera {

struct InstrumentVertex {
  Vec3f position;       ///< [m]
  Vec3f normal;         ///< unit
  float finish = 0.0f;  ///< Finish
};
static_assert(sizeof(InstrumentVertex) == 28);

struct InstrumentMesh {
  std::vector<InstrumentVertex> vertices;
  std::vector<std::uint32_t> indices;  ///< three a triangle
};

/// The mesh of an instrument in its own frame. Probe: a rod that ends in a ball of tip_radius about
/// the tip. Hook: an L of wire whose bent end is at the tip, with the shaft set back against the
/// side. Grasper: two toothed jaws that meet in front of a hinge, opening to 50 degrees.
InstrumentMesh make_instrument(const InstrumentView& view);

}  // namespace viscera
