// A closed surface around one that can't carry a body as it is: open, of many patches, thin,
// non-manifold, crossing itself.
#pragma once

#include <string>
#include <vector>

#include "kernels/base/result.h"
#include "kernels/points/surface.h"

namespace viscera {

struct WrapOptions {
  double voxel = 0.0;  ///< of the grid on which distances are kept [m]
  double close = 0.0;  ///< gaps narrower than this are closed everywhere [m]; 0: two voxels
  double edge = 0.0;   ///< wanted triangle edge [m]; 0: two voxels
};

/// A place where the wrap bridges what the original leaves open.
struct ClosedHole {
  Vec3 place;    ///< on the wrap, farthest from the original [m]
  double width;  ///< twice the distance from there to the original [m]
};

struct Wrap {
  TriangleSurface surface;         ///< closed, manifold, one piece
  double mean_distance = 0.0;      ///< from the wrap to the original, over the wrap's area [m]
  double greatest_distance = 0.0;  ///< [m]
  Vec3 farthest = Vec3::Zero();    ///< where that is [m]
  double lost_share = 0.0;         ///< of the original's area, outside by over a voxel
  double greatest_lost = 0.0;      ///< how far that sticks out [m]
  Vec3 lost_place = Vec3::Zero();
  bool filled = false;            ///< by winding numbers, because gaps were too wide
  std::vector<ClosedHole> holes;  ///< wider than ten voxels, widest first
};

/// What a person should know of a wrap: one line of figures first, then warnings.
std::vector<std::string> wrap_notes(const Wrap& wrap, const WrapOptions& options);

/// The outside is what can be reached from far away without coming nearer to a triangle than
/// close / 2; the body is what lies deeper than that behind the outside's border (a morphological
/// closing), so that the wrap lies on the outermost of the triangles and what they hide is
/// forgotten. Where the outside gets in through wider holes and more than a tenth of the area is
/// left as a bare sheet, places around which the surface winds more than half are filled as well.
/// Fails for surfaces around which no body is found even then, for bodies in several pieces, and
/// for voxels that are too great or too small for the body.
Result<Wrap> wrap_surface(const TriangleSurface& original, const WrapOptions& options);

}  // namespace viscera
