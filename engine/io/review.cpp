#include "engine/io/review.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>

#include "engine/io/atomic_file.h"
#include "engine/io/base64.h"
#include "engine/io/png_file.h"
#include "engine/io/review_page.h"

namespace viscera {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view kDataMark = "{{run data}}", kFilmMark = "{{film}}";

/// Five digits are more than a chart shows, and keep the page small.
double shortened(double value) {
  if (value == 0.0) return 0.0;
  const double unit = std::pow(10.0, std::floor(std::log10(std::abs(value))) - 4.0);
  return std::round(value / unit) * unit;
}

Json values_json(const std::vector<Curve::Bucket>& buckets, auto value) {
  Json values = Json::array();
  for (const Curve::Bucket& bucket : buckets)
    values.push_back(static_cast<float>(shortened(value(bucket))));
  return values;
}

Json curve_json(const Curve& curve) {
  using Bucket = Curve::Bucket;
  const std::vector<Bucket>& buckets = curve.buckets();
  Json times = Json::array();
  for (const Bucket& bucket : buckets) times.push_back(bucket.time);
  Json json = {{"name", curve.name()}, {"times", times}};
  json["mean"] =
      values_json(buckets, [](const Bucket& b) { return b.sum / static_cast<double>(b.count); });
  // Of single samples the mean says all.
  if (std::any_of(buckets.begin(), buckets.end(), [](const Bucket& b) { return b.count > 1; })) {
    json["least"] = values_json(buckets, [](const Bucket& b) { return b.least; });
    json["greatest"] = values_json(buckets, [](const Bucket& b) { return b.greatest; });
  }
  return json;
}

Json charts_json(const std::vector<Chart>& charts) {
  Json all = Json::array();
  for (const Chart& chart : charts) {
    Json curves = Json::array();
    for (const Curve& curve : chart.curves) curves.push_back(curve_json(curve));
    all.push_back({{"title", chart.title},
                   {"unit", chart.unit},
                   {"logarithmic", chart.logarithmic},
                   {"note", chart.note},
                   {"curves", curves}});
  }
  return all;
}

Json moments_json(const std::vector<Moment>& moments) {
  Json all = Json::array();
  for (const Moment& moment : moments)
    all.push_back({{"title", moment.title},
                   {"detail", moment.detail},
                   {"time", moment.time},
                   {"picture", moment.picture}});
  return all;
}

/// The whole film as text, or nothing where it is absent or large.
std::string embedded_film(const std::filesystem::path& film) {
  std::error_code error;
  const auto size = std::filesystem::file_size(film, error);
  if (error || size > kGreatestEmbeddedFilm) return {};
  std::ifstream in(film, std::ios::binary);
  return base64(std::string(std::istreambuf_iterator<char>(in), {}));
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

Thumbnail thumbnail(std::span<const std::uint8_t> rgb, int width, int height, int wanted_width) {
  const int factor = std::max(1, (width + wanted_width / 2) / std::max(1, wanted_width));
  Thumbnail small{width / factor, height / factor, {}};
  small.rgb.reserve(3ull * small.width * small.height);
  const unsigned pixels = static_cast<unsigned>(factor) * factor;
  for (int y = 0; y < small.height; ++y) {
    for (int x = 0; x < small.width; ++x) {
      for (int channel = 0; channel < 3; ++channel) {
        unsigned sum = pixels / 2;
        for (int j = 0; j < factor; ++j)
          for (int i = 0; i < factor; ++i)
            sum += rgb[3 * (static_cast<std::size_t>(y * factor + j) * width + x * factor + i) +
                       channel];
        small.rgb.push_back(static_cast<std::uint8_t>(sum / pixels));
      }
    }
  }
  return small;
}

Result<std::string> data_uri(const Thumbnail& picture) {
  auto bytes = png_bytes(picture.width, picture.height, picture.rgb, PngEffort::kSmall);
  if (!bytes) return std::unexpected(bytes.error());
  return "data:image/png;base64," + base64(*bytes);
}

Result<void> write_review(const std::filesystem::path& file, const Review& review) {
  const Json data = {{"report", Json::parse(to_json(review.report))},
                     {"film", review.film},
                     {"pictures_per_second", review.pictures_per_second},
                     {"moments", moments_json(review.moments)},
                     {"charts", charts_json(review.charts)}};
  std::string text = data.dump(-1, ' ', false, Json::error_handler_t::replace);
  // "</script>" and "<!--" inside a name would end the data; JSON allows the escape.
  for (std::size_t at = 0; (at = text.find('<', at)) != std::string::npos; at += 6) {
    text.replace(at, 1, "\\u003c");
  }

  const std::string_view page = review_page();
  const std::size_t data_at = page.find(kDataMark), film_at = page.find(kFilmMark);
  const std::size_t after_data = data_at + kDataMark.size();
  std::string out(page.substr(0, data_at));
  out += text;
  out += page.substr(after_data, film_at - after_data);
  if (!review.film.empty()) out += embedded_film(file.parent_path() / review.film);
  out += page.substr(film_at + kFilmMark.size());
  return write_file(file, out);
}

}  // namespace viscera
