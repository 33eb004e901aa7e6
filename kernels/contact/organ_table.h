// Where each touched organ's work begins in a dispatch over all of them, and how the threads of the
// GLSL twins of contact are numbered. A twin header (engine/gpu/twin_header.h).
#pragma once

#include <cstddef>
#include <cstdint>

namespace viscera {

// Columns: a tile is kTileLanes of four rows each, and kLoadParts threads share a lane's loads.
inline constexpr std::size_t kTileLanes = 32;
inline constexpr std::size_t kTileRows = 4 * kTileLanes;
inline constexpr std::size_t kLoadParts = 8;

inline constexpr std::size_t kSurfaceGroup = 64;  ///< vertices of a work group
inline constexpr std::size_t kSlice = 32;         ///< vertices whose rows lie side by side
static_assert(kSurfaceGroup % kSlice == 0);

struct OrganEntry {
  std::uint32_t first_group = 0;   ///< of this dispatch
  std::uint32_t first_tile = 0;    ///< its columns: where its first tile begins, in fours of rows
  std::uint32_t tile_stride = 0;   ///< from tile to tile, likewise
  std::uint32_t displacement = 0;  ///< its first displacement component
  std::uint32_t first_load = 0;
  std::uint32_t loads = 0;
  std::uint32_t vertices = 0;
  std::uint32_t first_slice = 0;  ///< its carriers and its neighbours, in slices of kSlice vertices
  std::uint32_t first_vertex = 0;  ///< its positions and normals
  std::uint32_t unused[3] = {};
};

}  // namespace viscera
