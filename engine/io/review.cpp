#include "engine/io/review.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>

#include "engine/io/atomic_file.h"
#include "engine/io/review_page.h"

namespace viscera {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view kDataMark = "{{run data}}";

/// Five digits are more than a chart shows, and keep the page small.
double shortened(double value) {
  if (value == 0.0) return 0.0;
  const double unit = std::pow(10.0, std::floor(std::log10(std::abs(value))) - 4.0);
  return std::round(value / unit) * unit;
}

Json curve_json(const Curve& curve) {
  Json times = Json::array(), least = Json::array(), mean = Json::array(), greatest = Json::array();
  for (const Curve::Bucket& bucket : curve.buckets()) {
    times.push_back(bucket.time);
    least.push_back(static_cast<float>(shortened(bucket.least)));
    mean.push_back(static_cast<float>(shortened(bucket.sum / static_cast<double>(bucket.count))));
    greatest.push_back(static_cast<float>(shortened(bucket.greatest)));
  }
  return {{"name", curve.name()},
          {"times", times},
          {"least", least},
          {"mean", mean},
          {"greatest", greatest}};
}

}  // namespace

void Curve::add(double time, double value) {
  if (!std::isfinite(value)) return;
  if (buckets_.empty() || buckets_.back().count >= samples_a_bucket_) {
    if (buckets_.size() == kBuckets) {
      for (std::size_t i = 0; i < kBuckets / 2; ++i) {
        const Bucket &a = buckets_[2 * i], &b = buckets_[2 * i + 1];
        buckets_[i] = {.time = a.time,
                       .least = std::min(a.least, b.least),
                       .sum = a.sum + b.sum,
                       .greatest = std::max(a.greatest, b.greatest),
                       .count = a.count + b.count};
      }
      buckets_.resize(kBuckets / 2);
      samples_a_bucket_ *= 2;
    }
    buckets_.push_back({time, value, 0.0, value, 0});
  }
  Bucket& bucket = buckets_.back();
  bucket.least = std::min(bucket.least, value);
  bucket.greatest = std::max(bucket.greatest, value);
  bucket.sum += value;
  ++bucket.count;
}

Result<void> write_review(const std::filesystem::path& file, const Review& review) {
  Json charts = Json::array();
  for (const Chart& chart : review.charts) {
    Json curves = Json::array();
    for (const Curve& curve : chart.curves) curves.push_back(curve_json(curve));
    charts.push_back({{"title", chart.title}, {"unit", chart.unit}, {"curves", curves}});
  }
  const Json data = {
      {"report", Json::parse(to_json(review.report))}, {"film", review.film}, {"charts", charts}};
  std::string text = data.dump(-1, ' ', false, Json::error_handler_t::replace);
  // "</script>" and "<!--" inside a name would end the data; JSON allows the escape.
  for (std::size_t at = 0; (at = text.find('<', at)) != std::string::npos; at += 6) {
    text.replace(at, 1, "\\u003c");
  }

  const std::string_view page = review_page();
  const std::size_t mark = page.find(kDataMark);
  std::string out(page.substr(0, mark));
  out += text;
  out += page.substr(mark + kDataMark.size());
  return write_file(file, out);
}

}  // namespace viscera
