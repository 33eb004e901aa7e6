// Work groups of the kernels that belong to no physics. A twin header (twin_header.h).
#pragma once

#include <cstddef>

namespace viscera {

inline constexpr std::size_t kClearGroup = 128;      ///< words
inline constexpr std::size_t kBandwidthGroup = 256;  ///< threads

}  // namespace viscera
