// Smoke's values of assets/smoke.json, each with unit, source and mark.
#pragma once

#include <filesystem>

#include "kernels/base/result.h"
#include "kernels/smoke/smoke_optics.h"

namespace viscera {

/// The optics of the file, or every mistake in it.
Result<SmokeOptics> load_smoke_optics(const std::filesystem::path& file);

}  // namespace viscera
