// What heat made of an organ, on the GPU: a sparse 3D texture that filters smoothly across bricks.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/gpu/program.h"
#include "engine/gpu/texture.h"
#include "engine/render/shader_layout.h"
#include "kernels/heat/heat_bricks.h"

namespace viscera {

/// Every brick is a tile of the atlas with a border of its neighbours' voxels, wide enough for
/// cubic filtering; a small 3D texture over the bricks' bounds says which tile a brick is. Four
/// values a voxel: coagulated; dried (0 to a half) and then charred (a half to 1); excess
/// temperature over kHottest; and whether tissue is there, by which the shader divides what it
/// filters, since the surface lies between voxels of tissue and empty ones.
class BurnAtlas {
 public:
  static constexpr int kBorder = kBurnBorder;                        ///< voxels
  static constexpr int kTileEdge = BrickField::kEdge + 2 * kBorder;  ///< voxels
  static constexpr double kHottest = kHottestBurn;  ///< excess that 1 stands for [K]

  /// Uploads the tiles that differ from what is there.
  void update(const HeatBricks& bricks);
  bool empty() const { return tiles_.empty(); }
  /// Binds the textures and sets the uniforms of the BURNT variants of organ.frag and label.frag.
  void bind(Program& program, unsigned map_unit, unsigned atlas_unit) const;

  int uploaded_tiles() const { return uploaded_; }  ///< of the last update

 private:
  static constexpr int kChannels = 4;
  using Tile = std::vector<std::uint16_t>;  ///< kTileEdge^3 x 4, 0 ... 65535 for 0 ... 1, x fastest

  bool reserve(int tiles);
  void update_map();

  std::vector<Tile> tiles_;  ///< as uploaded, by brick
  std::vector<BrickIndex> indices_;
  Texture map_, atlas_;
  Eigen::Vector3i atlas_tiles_ = Eigen::Vector3i::Zero();
  Eigen::Vector3i first_brick_ = Eigen::Vector3i::Zero();
  double voxel_ = 0.5e-3;
  int uploaded_ = 0;
};

}  // namespace viscera
