// What the memory of the device gives: the measure of kernels that do little but read.
#pragma once

#include <cstddef>

#include "kernels/base/result.h"

namespace viscera {

struct MemoryBandwidth {
  double read = 0.0;       ///< [bytes/s], a buffer read once
  double copy = 0.0;       ///< [bytes/s], read and written bytes together
  std::size_t bytes = 0;   ///< of what was read at a time
  std::size_t window = 0;  ///< of the buffer that it was part of
};

/// Reads and copies `bytes` at a time, each time the next part of a buffer of `window` bytes (at
/// most what a storage buffer holds), so that a cache smaller than that doesn't help. Medians of
/// `repeats` timestamped dispatches; of several sizes of dispatch the best. Needs a current
/// context.
Result<MemoryBandwidth> measure_memory_bandwidth(std::size_t bytes, std::size_t window,
                                                 int repeats);

}  // namespace viscera
