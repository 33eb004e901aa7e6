// What the renderer and its shaders both know. A twin header (engine/gpu/twin_header.h).
#pragma once

#include <Eigen/Core>
#include <cstddef>

namespace viscera {

/// What every pass knows of the picture: the std140 block Frame of frame.glsl.
struct FrameBlock {
  Eigen::Matrix4f view;        ///< world to camera: x right, y up, z towards the viewer
  Eigen::Matrix4f projection;  ///< depth 0 at the near plane, 1 at the far one
  Eigen::Vector4f eye;    ///< lens [m], its barrel distortion per square of the picture's height
  Eigen::Vector4f light;  ///< linear RGB times intensity
  Eigen::Vector4f lens;   ///< tan of half the field of view across and up, near, far [m]
  /// Shaded width, height [pixels], number of the picture, radius of the mask over the height.
  Eigen::Vector4f picture;
  /// The picture's width, height [pixels], exposure, 1: automatic exposure besides.
  Eigen::Vector4f shown;
};

inline constexpr int kRimCorners = 96;  ///< of the disc in full_screen.vert
inline constexpr int kMarchGroup = 8;   ///< columns of smoke in a work group, each way

// Tiles of the burn atlas.
inline constexpr int kBurnBorder = 2;           ///< voxels
inline constexpr double kHottestBurn = 1200.0;  ///< excess that 1 stands for [K]

/// What a part of an instrument is made of; a vertex carries it as a number.
enum class Finish { kSteel, kSleeve, kElectrode };

}  // namespace viscera
