// How far a surface is turned and stretched from its rest: whether linear tissue can still follow.
#pragma once

#include <span>
#include <vector>

#include "kernels/base/types.h"

namespace viscera {

/// The greatest of a surface, each at a place of its own.
struct SurfaceStrains {
  double rotation = 0.0;  ///< of a piece of surface, from its rest [rad]
  double stretch = 0.0;   ///< | length over length at rest - 1 |, along the surface
  Vec3 rotated = Vec3::Zero(), stretched = Vec3::Zero();  ///< where, at rest [m]
};

/// Displacement gradients at samples of a surface, each by least squares over a ring of its
/// vertices. A piece of surface is taken from its rest by F (3 x 2); F = R U with a rotation R and
/// a stretch U, whose principal values along the surface count. Exact where the whole moves by a
/// linear map; what is finer than the rings, as the dent under a small tip, is seen as its mean
/// over them.
class SurfaceGradients {
 public:
  /// A sample at each of `places` [m] whose ring of about the radius `reaches` [m] has vertices
  /// that face as the place does; others have none. `normals` of places and of vertices are unit
  /// ones.
  SurfaceGradients(std::span<const Vec3f> vertices, std::span<const Vec3f> vertex_normals,
                   std::span<const Vec3> places, std::span<const Vec3> normals,
                   std::span<const double> reaches);

  std::size_t size() const { return frames_.size(); }

  /// Of the vertices as they are now, in the order of those at rest [m]. Costs some 150 operations
  /// a sample.
  SurfaceStrains greatest(std::span<const Vec3f> vertices) const;

  /// No gradient is greater than this times the greatest displacement of a vertex [1/m].
  double bound() const { return bound_; }

 private:
  struct Frame {
    Vec3f x, y, normal;  ///< orthonormal, of the piece at rest
    Vec3f middle;        ///< of the ring at rest [m]
  };
  std::vector<Frame> frames_;
  std::vector<int> begin_{0}, vertices_;
  std::vector<Eigen::Vector2f> weights_;  ///< of each vertex in both columns of F [1/m]
  double bound_ = 0.0;
};

}  // namespace viscera
