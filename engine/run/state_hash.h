// One hash for everything a run computed: equal hashes mean equal runs, bit for bit.
#pragma once

#include <string>

#include "engine/simulation/world.h"
#include "kernels/base/hash.h"

namespace viscera {

class StateHash {
 public:
  /// What a frame changed that the last state doesn't show: tips and forces.
  void add_frame(const World& world);
  /// The last state of every store, and the hash of it all.
  std::string finish(const World& world);

  /// See Hasher.
  std::vector<std::byte> save() const { return hasher_.save(); }
  bool restore(std::span<const std::byte> saved) { return hasher_.restore(saved); }

 private:
  Hasher hasher_;
};

}  // namespace viscera
