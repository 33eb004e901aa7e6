#include "engine/io/label_volume.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

namespace viscera {
namespace {

constexpr long long kMostVoxels = 1ll << 30;

std::string digits(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

template <class T>
T value_at(const char* bytes, bool swap) {
  char copy[sizeof(T)];
  for (std::size_t b = 0; b < sizeof(T); ++b) copy[b] = bytes[swap ? sizeof(T) - 1 - b : b];
  return std::bit_cast<T>(copy);
}

template <class T>
Result<std::vector<std::int32_t>> decoded(std::string_view bytes, bool swap, std::size_t count,
                                          double slope, double intercept,
                                          const Eigen::Vector3i& size) {
  std::vector<std::int32_t> labels(count);
  for (std::size_t v = 0; v < count; ++v) {
    const double value =
        slope * static_cast<double>(value_at<T>(bytes.data() + v * sizeof(T), swap)) + intercept;
    const double whole = std::round(value);
    // Scaling in single precision leaves whole numbers off by a few last digits.
    if (!(std::abs(value - whole) <= 1e-4) ||
        std::abs(whole) > std::numeric_limits<std::int32_t>::max()) {
      const auto x = static_cast<std::size_t>(size.x()), y = static_cast<std::size_t>(size.y());
      return failure("found the value " + digits(value) + " at voxel (" + std::to_string(v % x) +
                     ", " + std::to_string(v / x % y) + ", " + std::to_string(v / x / y) +
                     "), expected whole numbers: is this an image rather than a label map?");
    }
    labels[v] = static_cast<std::int32_t>(whole);
  }
  return labels;
}

}  // namespace

std::size_t bytes_of(ValueType type) {
  switch (type) {
    case ValueType::kInt8:
    case ValueType::kUint8:
      return 1;
    case ValueType::kInt16:
    case ValueType::kUint16:
      return 2;
    case ValueType::kInt32:
    case ValueType::kUint32:
    case ValueType::kFloat:
      return 4;
    default:
      return 8;
  }
}

Result<std::vector<std::int32_t>> labels_of(std::string_view bytes, ValueType type, bool swap,
                                            std::size_t count, double slope, double intercept,
                                            const Eigen::Vector3i& size) {
  const std::size_t needed = count * bytes_of(type);
  if (bytes.size() < needed) {
    return failure("found " + std::to_string(bytes.size()) + " bytes of voxels, expected " +
                   std::to_string(needed) + ": the file looks truncated");
  }
  const auto as = [&]<class T>(T) {
    return decoded<T>(bytes, swap, count, slope, intercept, size);
  };
  switch (type) {
    case ValueType::kInt8:
      return as(std::int8_t{});
    case ValueType::kUint8:
      return as(std::uint8_t{});
    case ValueType::kInt16:
      return as(std::int16_t{});
    case ValueType::kUint16:
      return as(std::uint16_t{});
    case ValueType::kInt32:
      return as(std::int32_t{});
    case ValueType::kUint32:
      return as(std::uint32_t{});
    case ValueType::kInt64:
      return as(std::int64_t{});
    case ValueType::kUint64:
      return as(std::uint64_t{});
    case ValueType::kFloat:
      return as(float{});
    case ValueType::kDouble:
      return as(double{});
  }
  return failure("found a type of values that isn't known");
}

Result<Eigen::Vector3i> three_dimensions(const std::vector<long long>& sizes) {
  std::string found;
  for (const long long size : sizes) {
    found += (found.empty() ? "" : " x ") + std::to_string(size);
    if (size < 1) return failure("found the dimensions " + found + ", expected positive ones");
  }
  if (sizes.size() < 3) {
    return failure("found the dimensions " + found + ", expected three");
  }
  for (std::size_t d = 3; d < sizes.size(); ++d) {
    if (sizes[d] == 1) continue;
    return failure("found " + std::to_string(sizes.size()) + " dimensions (" + found +
                   "), expected three: a series, or several values a voxel, is no label map; "
                   "write one volume of it to a file of its own");
  }
  long long voxels = 1;
  for (int d = 0; d < 3; ++d) {
    if (sizes[d] > kMostVoxels / voxels) {
      return failure("found the dimensions " + found + ", expected at most 2^30 voxels");
    }
    voxels *= sizes[d];
  }
  return Eigen::Vector3i(static_cast<int>(sizes[0]), static_cast<int>(sizes[1]),
                         static_cast<int>(sizes[2]));
}

}  // namespace viscera
