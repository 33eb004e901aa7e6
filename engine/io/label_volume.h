// What the readers of label maps share: a volume as a file tells it, and its values as labels.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/base/fields.h"
#include "kernels/base/result.h"
#include "kernels/base/types.h"

namespace viscera {

/// In the file's units, turned to the body's frame (x left, y head, z front).
struct LabelVolume {
  Eigen::Vector3i size;
  std::vector<std::int32_t> labels;
  Mat3 axes;
  Vec3 origin;
  std::optional<double> unit;  ///< metres per unit, where the file says it
  std::map<std::int32_t, std::string> names;

  static constexpr auto fields() {
    return std::tuple(field("size", &LabelVolume::size), field("labels", &LabelVolume::labels),
                      field("axes", &LabelVolume::axes), field("origin", &LabelVolume::origin),
                      field("unit", &LabelVolume::unit), field("names", &LabelVolume::names));
  }
};
static_assert(fields_cover<LabelVolume>());

enum class ValueType {
  kInt8,
  kUint8,
  kInt16,
  kUint16,
  kInt32,
  kUint32,
  kInt64,
  kUint64,
  kFloat,
  kDouble
};

std::size_t bytes_of(ValueType type);

/// `count` values as labels, value * slope + intercept. Fails, naming the voxel, for values that
/// aren't whole numbers or don't fit 32 bits.
Result<std::vector<std::int32_t>> labels_of(std::string_view bytes, ValueType type, bool swap,
                                            std::size_t count, double slope, double intercept,
                                            const Eigen::Vector3i& size);

/// `sizes` as three dimensions of at least 1 with no more than 2^30 voxels, or the reason why not.
Result<Eigen::Vector3i> three_dimensions(const std::vector<long long>& sizes);

}  // namespace viscera
