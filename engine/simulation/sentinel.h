// Watches a step for numbers that aren't finite. After each stage it looks at the states that the
// stage changes: what it finds is named, contained and flagged, and the step goes on.
#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include "engine/simulation/frame.h"
#include "kernels/base/finite.h"

namespace viscera {

struct Stage;
struct StateType;

inline constexpr FrameFlag kNotFinite{
    "not_finite",
    "a number that wasn't finite was met and taken out (report.json, not_finite, says where): the "
    "run's figures from then on are not to be relied on"};

/// A number that was met.
struct MetStray {
  std::string_view stage;
  std::string_view what;  ///< "burns"
  Entity owner;
  StrayNumber number;
};
/// Raises the flag, and says in the report's `strays` which it was.
void tell_stray(const World& world, FrameReport& report, const MetStray& met);

/// One a world, runtime.
class Sentinel {
 public:
  /// At a step's start: keeps states that are taken back to it.
  void keep(const World& world);
  /// After a stage. A state becomes what its type says (StateType::strays).
  void look(World& world, const Stage& stage, FrameReport& report);

 private:
  void look(World& world, const Stage& stage, const StateType& type, FrameReport& report);

  std::vector<std::vector<std::byte>>
      kept_;  ///< by the world's state types; empty: isn't taken back
};

}  // namespace viscera
