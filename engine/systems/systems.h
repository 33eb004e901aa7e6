// The stages of a step as functions over the world; engine/frame.cpp calls them in order.
#pragma once

#include <string>

#include "engine/frame.h"
#include "engine/world.h"

namespace viscera {

/// Where an instrument's key frames put it at `time` [s].
void place_tool(const InstrumentBody& body, double time, InstrumentState& state);
/// The tip there, the shaft through its trocar.
void aim_tool(const InstrumentBody& body, const Vec3& tip, InstrumentState& state);

/// Key frames -> InstrumentState.
void read_tools(World& world, const FrameContext& context);
/// Ticks of held tools until this frame's end -> InstrumentState.
void run_servos(World& world, const FrameContext& context);
/// OrganMotion -> the poses of organs that breathe, and the bounds of their surfaces.
void move_organs(World& world, const FrameContext& context);
/// Gravity, as the table tilts -> OrganSag.
void sag_organs(World& world, const FrameContext& context);
/// InstrumentState, deformed surfaces -> OrganContact.cells, InstrumentContact.grasp.
void find_contacts(World& world, const FrameContext& context);
/// OrganContact.cells -> forces, OrganState, deformed surfaces (where a GPU makes these, it
/// starts). Organs without cells that are at rest cost one test.
void deform_organs(World& world, const FrameContext& context);
/// Hooks that touch, or spark -> OrganBurn, BurnTrace.
void heat_tissue(World& world, const FrameContext& context);
/// What left the tissue of OrganBurn, steady sources -> particles of the smoke volumes.
void emit_smoke(World& world, const FrameContext& context);
/// Smoke particles by [De2006] eq. 14, and the gas that they stir.
void move_smoke(World& world, const FrameContext& context);
/// What the GPU made of this frame's loads -> OrganState, deformed surfaces.
void fetch_surfaces(World& world, const FrameContext& context);
/// Where tissue is now -> the servos' snapshots.
void publish_to_servos(World& world, const FrameContext& context);
/// The device has failed: from now on all organs are the CPU's, which makes what their last shapes
/// lack. Nothing to do where none is on the GPU.
void leave_gpu(World& world, const std::string& why);
/// Flags organs that are frozen, every frame.
void check_world(World& world, const FrameContext& context);

}  // namespace viscera
