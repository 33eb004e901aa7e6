#include "tools/common/percentiles.h"

namespace viscera {

Percentiles percentiles_of(const LatencyHistogram& histogram) {
  const auto at = [&](double share) {
    return 1e-3 * static_cast<double>(histogram.percentile_ns(share));
  };
  return {at(0.5), at(0.99), at(0.999), 1e-3 * static_cast<double>(histogram.max_ns())};
}

}  // namespace viscera
