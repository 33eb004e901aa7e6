// Interpolation of key frames: monotone cubic [Fritsch1980], so that a path never
// overshoots its keys.
#pragma once

#include <span>
#include <vector>

#include "kernels/base/types.h"

namespace viscera {

/// A vector that varies in time; constant before the first key and after the last.
class KeyFrames {
 public:
  KeyFrames() = default;
  /// `times` [s] strictly ascending, at least one.
  KeyFrames(std::vector<double> times, std::vector<Vec3> values);

  Vec3 at(double time) const;
  /// Index of the last key at or before `time`; 0 before the first.
  std::size_t key_at(double time) const;

 private:
  std::vector<double> times_;
  std::vector<Vec3> values_;
  std::vector<Vec3> slopes_;
};

}  // namespace viscera
