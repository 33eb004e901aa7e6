// `viscera check`: what a scene will build, skip and cost, before anything is computed.
#pragma once

#include <iosfwd>
#include <map>
#include <string>

#include "engine/scene/scene.h"
#include "engine/scene/tissues.h"
#include "kernels/base/result.h"

namespace viscera {

/// Prints the plan: organs with nodes, memory and expected preparation time, instruments, smoke,
/// what is skipped and why. Fails for mistakes that only geometry shows (open surfaces, tips that
/// start inside organs, empty fixed regions).
Result<void> check_scene(const SceneDescription& scene,
                         const std::map<std::string, Tissue>& tissues, std::ostream& out);

}  // namespace viscera
