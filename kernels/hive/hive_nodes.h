// The nodes of a hive: rings on the surface about its centre, reached by walking, and copies of
// them along the inward normals in layers [De2006]. Rings and layers are finer near the contact.
// Every hive of a size has the same pattern, so who neighbours whom is known beforehand, and a hive
// moves with its centre as a whole: its force has no steps that depend on which nodes a mesh
// happens to have there.
#pragma once

#include <array>
#include <vector>

#include "kernels/hive/hive_verdict.h"
#include "kernels/hive/surface_walk.h"

namespace viscera {

/// A place of the pattern's disc as a mean of three of its nodes.
struct PatternPlace {
  std::array<int, 3> nodes{};
  std::array<double, 3> weights{};
};

/// Pattern of the nodes of a layer in the unit disc: one at the centre, 6 j in ring j, triangles
/// between. The last ring and the last layer are the periphery.
class HivePattern {
 public:
  /// The largest pattern of at most this many nodes, about as many layers as rings.
  explicit HivePattern(int most_nodes);

  int rings() const { return rings_; }
  int layers() const { return layers_; }
  int ring_nodes() const { return 1 + 3 * rings_ * (rings_ + 1); }  ///< m, of a layer
  int free_nodes() const { return 1 + 3 * (rings_ - 1) * rings_; }  ///< of them off the periphery
  int nodes() const { return ring_nodes() * layers_; }

  const std::vector<Vec2>& places() const { return places_; }  ///< (m)
  const std::vector<std::array<int, 3>>& triangles() const { return triangles_; }
  const std::vector<double>& depths() const { return depths_; }  ///< 0 to 1     (layers)

  /// Mean of nodes at a place of the disc; beyond its rim: of the rim's nearest triangle.
  PatternPlace locate(const Vec2& place) const noexcept;

 private:
  int rings_ = 0, layers_ = 0;
  std::vector<Vec2> places_;
  std::vector<std::array<int, 3>> triangles_;  ///< sixths of the disc one after another
  std::vector<double> depths_;
};

/// A hive's nodes on one body; memory of constant size.
struct HiveNodes {
  SurfaceSpot centre;
  Vec3 along_x = Vec3::UnitX(), along_y = Vec3::UnitY();  ///< of the disc, in the tangent plane
  double radius = 0.0;                                    ///< [m]
  std::vector<Vec3> positions;  ///< layer by layer from the surface down [m]  (layers m)
  std::vector<Vec3> normals;    ///< outward, unit                             (m)
  std::vector<double> areas;    ///< a third of the triangles about each [m2]  (m)

  explicit HiveNodes(const HivePattern& pattern);
  /// Walks to every node. `depth` of the lowest layer [m]; 0: as the radius, or less where a round
  /// body leaves no room. Sound, not_finite, not_on_surface or folded.
  HiveVerdict place(const HivePattern& pattern, const WalkableSurface& surface,
                    const SurfaceSpot& spot, double wanted_radius, double depth) noexcept;
  /// Where a point near the surface lies in the disc: by its distance from the centre and the way
  /// it lies in.
  Vec2 in_disc(const Vec3& point) const noexcept;
};

}  // namespace viscera
