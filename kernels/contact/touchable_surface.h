// The part of a body's surface that tools may touch, as points over which contact loads are spread.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "kernels/base/result.h"
#include "kernels/paff/shape_functions.h"
#include "kernels/points/surface.h"

namespace viscera {

/// The touchable part of a body's surface as points with areas and finite fields: what a contact
/// load is spread over. Immutable; built once in pre-processing.
struct TouchableSurface {
  std::vector<Vec3> positions;   ///< rest [m]                                   (S)
  std::vector<Vec3> normals;     ///< outward, unit                              (S)
  std::vector<double> areas;     ///< [m2]                                       (S)
  std::vector<double> spacings;  ///< local node spacing h [m]                   (S)
  SparseWeights weights;         ///< phi_J at each point; columns are indices into
                                 ///< SurfaceCompliance::touchable               (S rows)
  // Uniform grid over positions for range queries.
  Box box;
  double cell = 1.0;  ///< [m]
  Eigen::Vector3i cells = Eigen::Vector3i::Ones();
  std::vector<int> cell_begin, cell_items;

  std::size_t size() const { return positions.size(); }
};

/// Samples the triangles of `surface` for which `is_touchable` holds at the centroid, split to
/// edges of half the local node spacing at most; where triangles are finer, neighbours share a
/// sample. `touchable_nodes` (out) are the nodes whose fields reach a sample, ascending: the
/// columns to ask of the compliance. Fails where nothing is touchable, or where the fields don't
/// cover a sample.
Result<TouchableSurface> sample_touchable_surface(
    const TriangleSurface& surface, const std::function<bool(const Vec3&)>& is_touchable,
    const ShapeFunctions& fields, std::vector<int>& touchable_nodes);

/// A sample and its share of a load.
struct SampleShare {
  int sample;
  double share;
};

/// A node and its share of a load; `node` is an index into SurfaceCompliance::touchable.
struct WeightedNode {
  int node;
  double weight;
};

/// Node spacing about a point, averaged over the samples around it; smooth along the surface [m].
double spacing_at(const TouchableSurface& surface, const Vec3& position);

/// A unit load at `position` (outward unit surface `normal`) spread over the samples about it by a
/// bell of standard deviation `sigma` [m] whose centre is the position. Shares add up to 1. Samples
/// that face away carry nothing, so that a load stays on its side of a thin body.
/// False when no sample is in reach: the nearest one then carries all.
bool spread_load(const TouchableSurface& surface, const Vec3& position, const Vec3& normal,
                 double sigma, std::vector<SampleShare>& shares);

}  // namespace viscera
