// What a node of a strong form stands for: a patch of the surface, a part of the volume.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "kernels/base/result.h"
#include "kernels/points/cloud.h"
#include "kernels/points/surface.h"

namespace viscera {

/// The surface divided among the surface nodes, each place going to the node nearest to it.
class SurfacePatches {
 public:
  /// Triangles are split to a quarter of the spacing of the nearest node, each part going whole.
  SurfacePatches(const TriangleSurface& surface, const PointCloud& cloud);

  /// A flat piece of a node's patch.
  struct Part {
    Vec3 normal;  ///< outward, unit
    double area;  ///< [m2]
  };

  double area(std::size_t node) const { return areas_[node]; }  ///< [m2]; adds up to the body's
  /// Mean of the unit normal over the patch: shorter than 1 where the surface bends, the mean of
  /// the faces' normals at an edge. Zero for a node without a patch.
  const Vec3& mean_normal(std::size_t node) const { return normals_[node]; }
  /// Mean over the patch of a function of the unit normal.
  template <class Function>
  Vec3 mean(std::size_t node, const Function& of_normal) const {
    Vec3 sum = Vec3::Zero();
    for (std::size_t p = begin_[node]; p < begin_[node + 1]; ++p) {
      sum += parts_[p].area * of_normal(parts_[p].normal);
    }
    return areas_[node] > 0.0 ? Vec3(sum / areas_[node]) : sum;
  }

 private:
  std::vector<std::size_t> begin_;  // (surface nodes + 1)
  std::vector<Part> parts_;
  std::vector<double> areas_;
  std::vector<Vec3> normals_;
};

class ShapeFunctions;

/// V_i = integral of phi_i over the body [m3], the load that a unit body force puts on node i of
/// the linear fields (`galerkin` integrates the same). They add up to the body's volume, and
/// weighted by place to its first moment.
Result<std::vector<double>> nodal_volumes(const TriangleSurface& surface, const PointCloud& cloud);
/// The same of these fields of the cloud; nodes added to it have volumes of their own. With
/// `density`, the mean of a number over a cube of this edge about a place, its integrals.
Result<std::vector<double>> nodal_volumes(
    const TriangleSurface& surface, const PointCloud& cloud, const ShapeFunctions& fields,
    const std::function<double(const Vec3& x, double edge)>& density = {});

}  // namespace viscera
