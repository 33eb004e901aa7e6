#include "engine/simulation/feature.h"

namespace viscera {

std::vector<FrameFlag> flags_of(const std::vector<Feature>& features) {
  std::vector<FrameFlag> flags;
  for (const Feature& feature : features)
    flags.insert(flags.end(), feature.flags.begin(), feature.flags.end());
  return flags;
}

}  // namespace viscera
