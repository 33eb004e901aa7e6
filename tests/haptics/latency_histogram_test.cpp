#include "haptics/latency_histogram.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "kernels/base/random.h"

namespace viscera {
namespace {

TEST(LatencyHistogram, WithoutValuesEverythingIsZero) {
  const auto histogram = std::make_unique<LatencyHistogram>();
  EXPECT_EQ(histogram->count(), 0u);
  EXPECT_EQ(histogram->percentile_ns(0.99), 0u);
  EXPECT_EQ(histogram->max_ns(), 0u);
}

TEST(LatencyHistogram, EachValueLiesInItsBucketAndBucketsFollowOneAnother) {
  for (int i = 1; i < LatencyHistogram::kBuckets; ++i) {
    const std::uint64_t first = LatencyHistogram::end_ns(i - 1) + 1,
                        last = LatencyHistogram::end_ns(i);
    ASSERT_LE(first, last);
    ASSERT_EQ(LatencyHistogram::bucket(first), static_cast<std::size_t>(i));
    ASSERT_EQ(LatencyHistogram::bucket(last), static_cast<std::size_t>(i));
  }
  EXPECT_EQ(LatencyHistogram::bucket(~0ull), LatencyHistogram::kBuckets - 1u);
}

TEST(LatencyHistogram, PercentilesAreAtMostAThirtySecondTooHighAndNeverTooLow) {
  const Random random(1, 2);
  std::vector<std::uint64_t> values;
  const auto histogram = std::make_unique<LatencyHistogram>();
  for (std::uint64_t i = 0; i < 20'000; ++i) {
    // Over many octaves, as latencies are.
    values.push_back(static_cast<std::uint64_t>(std::exp(16.0 * random.uniform(i))));
    histogram->add(values.back());
  }
  std::sort(values.begin(), values.end());
  for (const double share : {0.5, 0.99, 0.999}) {
    const std::uint64_t exact =
        values[static_cast<std::size_t>(std::ceil(share * static_cast<double>(values.size()))) - 1];
    EXPECT_GE(histogram->percentile_ns(share), exact);
    EXPECT_LE(static_cast<double>(histogram->percentile_ns(share)),
              static_cast<double>(exact) * (1.0 + 1.0 / 32.0) + 1.0);
  }
  EXPECT_EQ(histogram->percentile_ns(1.0), values.back());
  EXPECT_EQ(histogram->max_ns(), values.back());
}

}  // namespace
}  // namespace viscera
