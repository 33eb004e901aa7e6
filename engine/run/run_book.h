// What a run knows of itself, over all processes that have worked at it.
#pragma once

#include <cstdint>
#include <string>

#include "engine/io/trace.h"
#include "engine/run/run.h"
#include "engine/simulator/checkpoint_file.h"

namespace viscera {

/// The checkpoint's part of that name.
inline constexpr const char* kRunPart = "run";

struct RunBook {
  std::uint32_t flags = 0;  ///< all that frames have raised
  double wall_s = 0.0;      ///< spent in the loop by processes before this one
};

/// With the trace's events so far, and the options that its files depend on.
CheckpointPart book_part(const RunBook& book, const Trace& trace, const RunOptions& options);
/// Fails where the run was started with other such options, telling both.
Result<void> load_book(const CheckpointPart& part, const RunOptions& options, RunBook& book,
                       Trace& trace);

}  // namespace viscera
