// Pictures of what `viscera bench smoke` measured.
#pragma once

#include <filesystem>
#include <vector>

#include "kernels/base/result.h"
#include "tools/bench/smoke_rows.h"

namespace viscera {

/// Writes smoke_time.svg (time a step and of its passes against particles), smoke_shares.svg (what
/// part of a step each pass is) and smoke_decay.svg (error against spacing) into the folder, which
/// is made if need be.
Result<void> draw_smoke_plots(const std::vector<SmokeRow>& rows,
                              const std::vector<SmokeDecay>& decays,
                              const std::filesystem::path& folder);

}  // namespace viscera
