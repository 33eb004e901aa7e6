// What random scenes are drawn by: seed and number fix all of it.
#pragma once

#include <array>
#include <cstdint>

#include "kernels/base/random.h"

namespace viscera {

/// Draws, one after the other.
class Dice {
 public:
  Dice(std::uint64_t seed, int number, std::uint64_t stream)
      : random_(seed, stream + static_cast<std::uint64_t>(number)) {}

  double between(double low, double high) { return low + (high - low) * random_.uniform(next_++); }
  int whole(int low, int high) {  // both among them
    return low +
           static_cast<int>(random_.bits(next_++) % static_cast<std::uint64_t>(high - low + 1));
  }
  bool chance(double share) { return random_.uniform(next_++) < share; }
  template <std::size_t N>
  const char* one_of(const std::array<const char*, N>& words) {
    return words[static_cast<std::size_t>(whole(0, static_cast<int>(N) - 1))];
  }
  Vec3 direction() { return random_.direction(next_++); }

 private:
  Random random_;
  std::uint64_t next_ = 0;
};

inline constexpr std::array<const char*, 8> kTissues{"liver", "gallbladder", "stomach", "kidney",
                                                     "lung",  "spleen",      "fat",     "rubber"};

}  // namespace viscera
