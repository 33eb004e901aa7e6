// The order of a step's stages, from what they say they read and write.
#pragma once

#include <string>
#include <vector>

#include "engine/simulation/feature.h"

namespace viscera {

/// For every thing that stages name: who writes it comes before who changes it (reads and writes
/// it), these in the list's order, and both before who reads it; who reads it as the last step left
/// it comes before them all. Where that leaves a choice, the features' order decides.
class Schedule {
 public:
  /// Fails where stages wait for each other in a ring, or one reads what nobody writes.
  static Result<Schedule> of(const std::vector<Feature>& features);

  const std::vector<Stage>& stages() const { return stages_; }
  /// Which feature a stage belongs to, by the stage's place.
  const std::vector<std::string_view>& owners() const { return owners_; }
  /// The table of stages for ARCHITECTURE.md.
  std::string markdown() const;

 private:
  std::vector<Stage> stages_;
  std::vector<std::string_view> owners_;
};

}  // namespace viscera
