#include "engine/simulation/feature.h"

#include "engine/simulation/sentinel.h"

namespace viscera {

std::vector<FrameFlag> flags_of(const std::vector<Feature>& features) {
  std::vector<FrameFlag> flags{kNotFinite};
  for (const Feature& feature : features)
    flags.insert(flags.end(), feature.flags.begin(), feature.flags.end());
  return flags;
}

}  // namespace viscera
