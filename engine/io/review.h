// review.html: one page that shows a run to a person, with no network and no other tool.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "engine/io/report.h"
#include "kernels/base/fields.h"
#include "kernels/base/result.h"

namespace viscera {

/// One curve of a chart, thinned as it grows: at most kBuckets buckets of least, mean and greatest
/// value, so that a long run stays drawable and no peak is lost.
class Curve {
 public:
  static constexpr std::size_t kBuckets = 1200;
  struct Bucket {
    double time = 0.0;  ///< of the first sample [s]
    double least = 0.0, sum = 0.0, greatest = 0.0;
    std::size_t count = 0;
    static constexpr auto fields() {
      return std::tuple(field("time", &Bucket::time), field("least", &Bucket::least),
                        field("sum", &Bucket::sum), field("greatest", &Bucket::greatest),
                        field("count", &Bucket::count));
    }
  };
  static constexpr auto fields() {
    return std::tuple(field("name", &Curve::name_), field("buckets", &Curve::buckets_),
                      field("samples_a_bucket", &Curve::samples_a_bucket_));
  }

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

static_assert(fields_cover<Curve>() && fields_cover<Curve::Bucket>());

/// Curves over time on common axes.
struct Chart {
  std::string title;  ///< "Force on the instruments"
  std::string unit;   ///< "N"
  std::vector<Curve> curves;
  bool logarithmic = false;
  std::string note;  ///< what the values are, where the title can't say it
};

/// A moment that a person wants to see.
struct Moment {
  std::string title;    ///< "First contact"
  std::string detail;   ///< "hook on liver"
  double time = 0.0;    ///< [s]
  std::string picture;  ///< data URI; empty: none was drawn then
};

/// What the page shows beside the report.
struct Review {
  RunReport report;
  std::string film;                   ///< beside the page; empty: no film was made
  double pictures_per_second = 30.0;  ///< of the film; its first shows the time 1 / this
  std::vector<Chart> charts;
  std::vector<Moment> moments;
};

/// Films up to this size become part of the page, larger ones are referred to [bytes].
inline constexpr std::size_t kGreatestEmbeddedFilm = 48 << 20;

/// The picture (RGB, rows from the top) made smaller by a whole factor, to about `width` pixels;
/// pixels are means.
struct Thumbnail {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
  static constexpr auto fields() {
    return std::tuple(field("width", &Thumbnail::width), field("height", &Thumbnail::height),
                      field("rgb", &Thumbnail::rgb));
  }
};
static_assert(fields_cover<Thumbnail>());
Thumbnail thumbnail(std::span<const std::uint8_t> rgb, int width, int height, int wanted_width);
/// As PNG in a data URI.
Result<std::string> data_uri(const Thumbnail& picture);

Result<void> write_review(const std::filesystem::path& file, const Review& review);

}  // namespace viscera
