// How big a brick of voxels is and how its geometry lies in a device's memory: for C++ and for
// GLSL. A twin header (engine/gpu/twin_header.h).
#pragma once

#include <cstddef>

namespace viscera {

inline constexpr std::size_t kBrickEdge = 8;  ///< voxels
inline constexpr std::size_t kBrickLayer = kBrickEdge * kBrickEdge;
inline constexpr std::size_t kBrickVoxels = kBrickLayer * kBrickEdge;
inline constexpr std::size_t kBrickRow = kBrickEdge + 1;             ///< faces along an axis
inline constexpr std::size_t kBrickFaces = kBrickLayer * kBrickRow;  ///< across an axis

// Words of a geometry: fractions of tissue, openings across x, y and z, area of the surface, share
// that blood reaches.
inline constexpr std::size_t kOpenX = kBrickVoxels;
inline constexpr std::size_t kOpenY = kOpenX + kBrickFaces;
inline constexpr std::size_t kOpenZ = kOpenY + kBrickFaces;
inline constexpr std::size_t kSurfaceArea = kOpenZ + kBrickFaces;
inline constexpr std::size_t kPerfused = kSurfaceArea + kBrickVoxels;
inline constexpr std::size_t kGeometryWords = kPerfused + kBrickVoxels;

}  // namespace viscera
