// How simulated time is cut into steps.
#pragma once

#include <cmath>
#include <cstdint>

namespace viscera {

/// Step k ends at tick floor(1000 k / per_second): whole milliseconds, those of the servos.
struct StepRate {
  std::uint64_t per_second = 60;

  constexpr double step() const { return 1.0 / static_cast<double>(per_second); }  ///< [s]
  constexpr std::uint64_t last_tick(std::uint64_t step) const { return 1000 * step / per_second; }
  /// At which a step ends [s].
  constexpr double time_after(std::uint64_t steps) const {
    return static_cast<double>(steps) / static_cast<double>(per_second);
  }
  /// Nearest to so much time [s]; and at least as long.
  std::uint64_t steps_in(double seconds) const {
    return static_cast<std::uint64_t>(std::llround(seconds * static_cast<double>(per_second)));
  }
  std::uint64_t steps_covering(double seconds) const {
    return static_cast<std::uint64_t>(std::ceil(seconds * static_cast<double>(per_second)));
  }
};

}  // namespace viscera
