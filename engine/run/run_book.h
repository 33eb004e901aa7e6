// What a run knows of itself, over all processes that have worked at it.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "engine/io/trace.h"
#include "engine/run/run.h"
#include "engine/simulation/frame_flag.h"
#include "engine/simulator/checkpoint_file.h"
#include "kernels/base/fields.h"

namespace viscera {

/// The checkpoint's part of that name.
inline constexpr const char* kRunPart = "run";

struct RunBook {
  /// Numbers that weren't finite, as steps told them: the first of them, and how many in all.
  struct Strays {
    static constexpr std::size_t kMost = 20;
    std::vector<std::string> first;
    std::uint64_t count = 0;
    void add(const std::vector<std::string>& more, double time);
    static constexpr auto fields() {
      return std::tuple(field("first", &Strays::first), field("count", &Strays::count));
    }
  };

  FlagSet flags;  ///< all that frames have raised
  Strays strays;
  double wall_s = 0.0;  ///< spent in the loop by processes before this one
};

/// With the trace's events so far, and the options that its files depend on.
CheckpointPart book_part(const RunBook& book, const Trace& trace, const RunOptions& options);
/// `known`: flags that there are. Fails where the run was started with other such options, telling
/// both, and for a flag that isn't known.
Result<void> load_book(const CheckpointPart& part, const RunOptions& options,
                       std::span<const FrameFlag> known, RunBook& book, Trace& trace);

}  // namespace viscera
