// review.html: one page that shows a run to a person, with no network and no other tool.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "engine/io/report.h"
#include "kernels/base/result.h"

namespace viscera {

/// One curve of a chart, thinned as it grows: at most kBuckets buckets of least, mean and greatest
/// value, so that a long run stays drawable and no peak is lost.
class Curve {
 public:
  static constexpr std::size_t kBuckets = 1200;
  struct Bucket {
    double time = 0.0;                        ///< of the first sample [s]
    double least = 0.0, sum = 0.0, greatest = 0.0;
    std::size_t count = 0;
  };

  Curve() = default;
  explicit Curve(std::string name) : name_(std::move(name)) {}

  /// Times ascend. Values that aren't finite are left out.
  void add(double time, double value);

  const std::string& name() const { return name_; }
  const std::vector<Bucket>& buckets() const { return buckets_; }

 private:
  std::string name_;
  std::vector<Bucket> buckets_;
  std::size_t samples_a_bucket_ = 1;
};

/// Curves over time on common axes.
struct Chart {
  std::string title;                          ///< "Force on the instruments"
  std::string unit;                           ///< "N"
  std::vector<Curve> curves;
};

/// What the page shows beside the report. Paths are relative to the page.
struct Review {
  RunReport report;
  std::string film;                           ///< empty: no film was made
  std::vector<Chart> charts;
};

Result<void> write_review(const std::filesystem::path& file, const Review& review);

}  // namespace viscera
