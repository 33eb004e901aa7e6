#include "engine/simulation/frame_flag.h"

#include <algorithm>

namespace viscera {

void FlagSet::raise(const FrameFlag& flag) {
  if (!has(flag)) raised_.push_back(flag);
}

void FlagSet::raise(const FlagSet& others) {
  for (const FrameFlag& flag : others) raise(flag);
}

void FlagSet::order(std::span<const FrameFlag> all) {
  std::ranges::stable_sort(raised_, {}, [&](const FrameFlag& flag) {
    return std::ranges::find(all, flag.name, &FrameFlag::name) - all.begin();
  });
}

bool FlagSet::has(std::string_view name) const {
  return std::ranges::find(raised_, name, &FrameFlag::name) != raised_.end();
}

std::vector<std::string_view> FlagSet::names() const {
  std::vector<std::string_view> names;
  for (const FrameFlag& flag : raised_) names.push_back(flag.name);
  return names;
}

}  // namespace viscera
