// A label's voxels as a smooth signed distance, whose zero set encloses what the voxels do.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "engine/io/label_map.h"
#include "engine/organ/shape.h"

namespace viscera {

/// Voxels of one label that hang together by their faces. Indices of `mask` are those of the map
/// less `first`; a margin of background lies all around.
struct LabelPiece {
  std::int32_t label = 0;
  std::size_t voxels = 0;
  std::size_t cavity_voxels = 0;  ///< enclosed by the piece, not of its label; filled in `mask`
  Vec3 cavity = Vec3::Zero();     ///< centre of the first such voxel [m]
  bool at_border = false;         ///< reaches the map's border, which may cut the organ
  Eigen::Vector3i first, size;    ///< of the mask
  std::vector<char> mask;         ///< (size), i fastest; 1: of the piece
};

/// The pieces of a label, greatest first.
std::vector<LabelPiece> label_pieces(const LabelMap& map, std::int32_t label,
                                     const LabelExtent& extent);

/// Distance from the faces between a piece's voxels and the rest, exact on the voxels' centres up
/// to three voxels away, smoothed there by `smoothing` passes of (1 2 1)/4 along each axis and
/// between them by uniform cubic B-splines; with smoothing -1 only interpolated, along each axis
/// linearly. Anisotropic voxels are smoothed by their own steps along each axis.
///
/// Disjoint pieces stay disjoint. On voxels d_a + d_b >= 0, since what is deep in one is as far
/// from the other, and smoothing and splines, whose weights aren't negative, keep that. The level c
/// that restores the volume would break it, so it is w c with a weight w_a = 0 on every voxel that
/// shares an interpolation patch with one where d_b < c. A patch without such a voxel holds nothing
/// of b; in one with such voxels of both, neither has a level. Unsmoothed, d_b >= half a voxel
/// outside of b, and a smoothing pass sees one voxel farther: so for c below half a voxel these are
/// the voxels of b and as many around them as there are passes. Other voxels are those of the
/// labels `imported` (ascending) that aren't of the piece; where there are none, c may be a whole
/// voxel.
class LabelField {
 public:
  LabelField(const LabelMap& map, const LabelPiece& piece, int smoothing,
             const std::vector<std::int32_t>& imported);

  /// The field becomes smaller by `level` [m], where that may be: the body grows. No more than
  /// greatest_level() either way.
  void set_level(double level);
  double greatest_level() const { return greatest_level_; }  ///< [m]
  double operator()(const Vec3& x) const;                    ///< [m]
  Box box() const;  ///< encloses the body with room for smoothing [m]
  bool adjustable() const { return adjustable_; }

 private:
  Mat3 to_index_;
  Vec3 origin_;  // of the mask's voxel (0, 0, 0)
  Mat3 axes_;
  Eigen::Vector3i size_;
  bool linear_ = false, adjustable_ = false;
  double far_ = 0.0, greatest_level_ = 0.0;
  std::vector<float> distance_, freedom_, values_;  // (size)
};

}  // namespace viscera
