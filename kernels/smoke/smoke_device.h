// How the GLSL twins of smoke are numbered, for them and for who dispatches them: threads, words of
// their counters and of what they survey. A twin header (engine/gpu/twin_header.h).
#pragma once

#include <cstddef>
#include <cstdint>

namespace viscera {

inline constexpr std::size_t kSmokeGroup = 128;  ///< threads of a work group
inline constexpr std::size_t kScanEach = 8;      ///< cells that a thread of scan.comp adds up
inline constexpr std::size_t kScanBlock = kScanEach * kSmokeGroup;
inline constexpr std::size_t kSplatChannels = 5;  ///< of a cell: mass, heat, momentum

/// Words of the counters.
enum SmokeCounter : std::uint32_t {
  kIsolatedWord,
  kTestedWord,
  kTouchingWord,
  kTrappedWord,
  kCounterWords
};

// Words of extent.comp: of a box its least corner, its greatest and the square of the greatest
// speed; of amounts the greatest mass, heat and momentum.
inline constexpr std::size_t kBoxWords = 7;
inline constexpr std::size_t kAmountWords = 3;

}  // namespace viscera
