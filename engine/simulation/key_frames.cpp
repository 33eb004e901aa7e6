#include "engine/simulation/key_frames.h"

#include <algorithm>
#include <cmath>

namespace viscera {

KeyFrames::KeyFrames(std::vector<double> times, std::vector<Vec3> values)
    : times_(std::move(times)), values_(std::move(values)), slopes_(times_.size(), Vec3::Zero()) {
  const std::size_t n = times_.size();
  // Harmonic mean of the neighbouring slopes where they agree in sign, else level: no overshoot.
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const double h0 = times_[i] - times_[i - 1], h1 = times_[i + 1] - times_[i];
    for (int c = 0; c < 3; ++c) {
      const double d0 = (values_[i][c] - values_[i - 1][c]) / h0;
      const double d1 = (values_[i + 1][c] - values_[i][c]) / h1;
      if (d0 * d1 <= 0.0) continue;
      const double w0 = 2.0 * h1 + h0, w1 = h1 + 2.0 * h0;
      slopes_[i][c] = (w0 + w1) / (w0 / d0 + w1 / d1);
    }
  }
}

std::size_t KeyFrames::key_at(double time) const {
  const auto after = std::upper_bound(times_.begin(), times_.end(), time);
  return after == times_.begin() ? 0 : static_cast<std::size_t>(after - times_.begin()) - 1;
}

Vec3 KeyFrames::at(double time) const {
  if (time <= times_.front()) return values_.front();
  if (time >= times_.back()) return values_.back();
  const std::size_t i = key_at(time);
  const double h = times_[i + 1] - times_[i];
  const double s = (time - times_[i]) / h;
  const double s2 = s * s, s3 = s2 * s;
  return (2 * s3 - 3 * s2 + 1) * values_[i] + (s3 - 2 * s2 + s) * h * slopes_[i] +
         (3 * s2 - 2 * s3) * values_[i + 1] + (s3 - s2) * h * slopes_[i + 1];
}

}  // namespace viscera
