// What a run knows of itself, over all processes that have worked at it.
#pragma once

#include <span>

#include "engine/io/trace.h"
#include "engine/run/run.h"
#include "engine/simulation/frame_flag.h"
#include "engine/simulator/checkpoint_file.h"

namespace viscera {

/// The checkpoint's part of that name.
inline constexpr const char* kRunPart = "run";

struct RunBook {
  FlagSet flags;        ///< all that frames have raised
  double wall_s = 0.0;  ///< spent in the loop by processes before this one
};

/// With the trace's events so far, and the options that its files depend on.
CheckpointPart book_part(const RunBook& book, const Trace& trace, const RunOptions& options);
/// `known`: flags that there are. Fails where the run was started with other such options, telling
/// both, and for a flag that isn't known.
Result<void> load_book(const CheckpointPart& part, const RunOptions& options,
                       std::span<const FrameFlag> known, RunBook& book, Trace& trace);

}  // namespace viscera
