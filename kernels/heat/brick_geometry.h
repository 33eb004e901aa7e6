// How much of a brick's voxels is tissue, how far their faces are open to their neighbours, how
// much surface to the gas each has, and whether blood reaches it.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <vector>

#include "kernels/heat/brick_layout.h"
#include "kernels/points/bricks.h"

namespace viscera {

static_assert(BrickField::kEdge == kBrickEdge, "a device's bricks are these");

/// Signed distance of a rest position from an organ's surface [m], negative inside. Like every
/// distance it changes by no more than one moves. Asked when bricks are made, from many threads at
/// once.
using SignedDistance = std::function<double(const Vec3&)>;

/// Made once; constant. x runs fastest in all arrays.
struct BrickGeometry {
  static constexpr int kEdge = BrickField::kEdge;
  static constexpr int kRow = kEdge + 1;
  struct Surface {
    int voxel = 0;
    float area = 0.0f;  ///< to the gas, of a whole face
  };

  /// Tissue in a voxel, 0 ... 1.
  std::array<float, BrickField::kVoxels> fraction;
  /// Open share of the faces across x, y and z that lie below voxel (i, j, k) along their axis; the
  /// last of a row is the brick's upper border.        (9 x 8 x 8, 8 x 9 x 8, 8 x 8 x 9)
  std::array<float, kRow * kEdge * kEdge> open_x, open_y, open_z;
  std::vector<Surface> surface;  ///< voxels that the surface crosses, in order
  bool empty = false;            ///< no tissue at all
  /// Share of a voxel's tissue that blood reaches, 0 ... 1; what is cut off has none, and no
  /// metabolism. Empty: blood reaches all, as it does but beside a cut.                    (512)
  std::vector<float> perfused;

  float perfused_at(std::size_t voxel) const { return perfused.empty() ? 1.0f : perfused[voxel]; }
  /// Of its own; of the two that all bricks share none.
  std::size_t memory_bytes() const;

  /// All tissue, no surface; one for all bricks deep inside.
  static const std::shared_ptr<const BrickGeometry>& whole();
  /// The same without blood; one for all bricks deep inside what is cut off.
  static const std::shared_ptr<const BrickGeometry>& whole_cut_off();
};

/// Of the brick at this index in a field of this voxel. Faces are cut along straight lines between
/// the points where the distance changes sign on their edges. A voxel's surface is what its faces'
/// openings leave unbalanced (the integral of the normal over a closed surface vanishes), so a
/// plane's area is exact. No tissue is so thin that it would limit the step: a voxel that is cut
/// has at least a tenth.
std::shared_ptr<const BrickGeometry> make_geometry(const BrickIndex& brick, double voxel,
                                                   const SignedDistance& distance);

/// The same tissue, of which blood reaches this much; `perfused` as BrickGeometry has it.
std::shared_ptr<const BrickGeometry> with_blood(
    const std::shared_ptr<const BrickGeometry>& geometry, std::vector<float> perfused);
/// The same tissue, all of it cut off.
std::shared_ptr<const BrickGeometry> without_blood(
    const std::shared_ptr<const BrickGeometry>& geometry);

/// A brick that isn't as the distance says: there the tissue has been cut, or cut off.
struct ShapedBrick {
  BrickIndex index = BrickIndex::Zero();
  /// Null: as the distance says, without blood. Then it costs nothing until the brick is warm.
  std::shared_ptr<const BrickGeometry> geometry;
};

}  // namespace viscera
