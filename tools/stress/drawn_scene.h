// What draws random scenes shares: places as a scene's file has them, and the file.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "kernels/base/result.h"
#include "kernels/base/types.h"

namespace viscera {

nlohmann::json listed(const Vec3& v);
Result<void> write_drawn_scene(const nlohmann::json& scene, const std::filesystem::path& file);

}  // namespace viscera
