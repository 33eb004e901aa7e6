// Random scenes of all that a scene may have: for `viscera stress --whole`.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "kernels/base/result.h"

namespace viscera {

struct WholeScene {
  std::filesystem::path file;  ///< beside it: the recordings of its devices
  std::string description;     ///< "3 organs (1 local, 0 rigid, 1 finite), 2 tools (1 held), ..."
  std::uint64_t frames = 0;    ///< that it is stepped
  /// After so many frames a snapshot is taken, from which another simulation goes on.
  std::uint64_t snapshot_at = 0;
  /// After so many, tissue at finite strain is turned inside out in places, later than the
  /// snapshot; none: never.
  std::optional<std::uint64_t> inverted_at;
  bool abused = false;  ///< so, or by tools that leap
  /// From this frame on nothing is moved by anything but tissue's own motion, which then may gain
  /// no energy: all that deforms is at finite strain, elastic, and tools stand still; none: a scene
  /// in which something goes on.
  std::optional<std::uint64_t> still_from;
};

/// Writes the case's scene into a folder. It depends on seed and number alone. Most are sound;
/// some have tools that start in tissue, or links between organs that lie apart, and are refused.
Result<WholeScene> write_whole_scene(std::uint64_t seed, int number,
                                     const std::filesystem::path& folder);

}  // namespace viscera
