// Percentiles of a time, as reports print them.
#pragma once

#include "haptics/latency_histogram.h"

namespace viscera {

/// Percentiles of a time [us].
struct Percentiles {
  double p50 = 0.0, p99 = 0.0, p999 = 0.0, max = 0.0;
};
Percentiles percentiles_of(const LatencyHistogram& histogram);

}  // namespace viscera
