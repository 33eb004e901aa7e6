// Random scenes in which blades cut an organ: for `viscera stress --whole --cuts`.
#pragma once

#include "tools/stress/whole_scene.h"

namespace viscera {

/// As write_whole_scene: a block or half a ball at finite strain, held at its base or at one side,
/// maybe drawn by a grasper or two; one or two scalpels or scissors that go through it once to
/// three times, some from side to side; after them maybe a hook with current. Then all stands
/// still.
Result<WholeScene> write_cut_scene(std::uint64_t seed, int number,
                                   const std::filesystem::path& folder);

}  // namespace viscera
