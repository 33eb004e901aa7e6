// A world's state in a file, with what it belongs to.
#pragma once

#include <filesystem>

#include "engine/simulation/world.h"
#include "engine/simulator/checkpoint_file.h"

namespace viscera {

/// The part of a checkpoint that is the world.
inline constexpr const char* kWorldPart = "simulation";

/// Fails where some part of the world can't be saved, naming it.
Result<void> check_savable(const World& world);

/// Program, scene, machine and layout of this world's state. `computing`: on what, where that
/// changes bits.
CheckpointIdentity identity_of(const World& world, const std::string& computing = "cpu");

/// Written whole or not at all.
Result<void> save_state_file(const std::filesystem::path& file, const World& world);
/// Refuses what isn't a state of this world's scene, saying what differs.
Result<void> load_state_file(const std::filesystem::path& file, World& world);

}  // namespace viscera
