// Where a part of an organ lies, and maps of moduli.
#pragma once

#include <filesystem>
#include <functional>

#include "engine/io/label_map.h"
#include "engine/organ/shape.h"
#include "engine/scene/scene.h"
#include "kernels/base/result.h"
#include "kernels/points/surface.h"

namespace viscera {

/// The share of a cube of this edge [m] about a place, 0 to 1, that lies in something.
using CubeShare = std::function<double(const Vec3& x, double edge)>;

/// Of what lies where this is negative: sampled on 27 places of cubes that its border passes, as if
/// it were flat about each.
CubeShare share_inside(SignedDistance distance);

/// Of a part that isn't a map. Fails for recipes and label maps that can't be read.
Result<CubeShare> part_share(const PartDescription& part, const TriangleSurface& surface,
                             const std::filesystem::path& assets);

/// Young's modulus in voxels; those of 0 are background, where it isn't known.
class ModulusMap {
 public:
  /// `unit`: pascals per unit of its whole numbers. Fails as read_label_map does, and for negative
  /// values.
  static Result<ModulusMap> read(const std::filesystem::path& file, double unit);

  /// Whether this voxel or one beside it knows it.
  bool known_at(const Vec3& x) const;
  /// Over a cube of this edge [m], of what is known within a voxel of it [Pa]; NaN: nothing is.
  double mean(const Vec3& x, double edge) const;
  const std::filesystem::path& file() const { return map_.file; }

 private:
  ModulusMap(LabelMap map, double unit);

  LabelMap map_;
  double unit_;
  Mat3 to_index_;
};

}  // namespace viscera
