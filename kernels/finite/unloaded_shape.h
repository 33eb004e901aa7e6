// The shape without stress of a body that was imaged under its weight: inverse iteration.
//
// A body's shape in an image is at rest under gravity; put under gravity anew, it would sag twice.
// With X the imaged place of a point, X + u0(X) is where it would lie without weight, u0 a field of
// the same nodes. Displaced by u from the image, its deformation gradient is
//   F = (1 + grad u) (1 + grad u0)^-1 = 1 + grad0 (u - u0),   grad0 = (1 + grad u0)^-T grad,
// over the volume det(1 + grad u0) dX: a body at finite strain of the same nodes and points, whose
// gradients and weights are other ones and whose displacements count from u0. At u = 0 its forces
// must be the weight; u0 follows from where they aren't, by the stiffness at rest.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "kernels/base/progress.h"
#include "kernels/base/result.h"
#include "kernels/base/types.h"
#include "kernels/paff/elastic_region.h"

namespace viscera {

/// The points of a body that was imaged displaced by -`unloaded` (3 N, node-major) [m] from the
/// shape in which it has no stress. Cells average the same polynomials, orthonormal over what they
/// are then. Fails where tissue would be turned inside out or pressed to less than a tenth.
Result<ElasticRegion> region_unloaded(const ElasticRegion& region,
                                      std::span<const double> unloaded);

/// The farthest way of a node (3 N) [m].
double farthest(std::span<const double> displacements);

struct UnloadedShape {
  std::vector<double> displacements;  ///< u0 [m]                                           (3 N)
  /// How far the imaged shape would still go by itself under its weight, at most [m].
  double off = 0.0;
  int iterations = 0;
};

/// Of a body of such points and such a hold, at finite strain. `weight`: the forces that its nodes
/// bear in the image (3 N) [N]. `answer`: displacements of a body at rest under forces, about (3
/// N). Fails where no such shape is found within `kMostUnloading` iterations: the body is too soft
/// for its weight, or held too little; and with kCancelled where `progress` says so.
Result<UnloadedShape> find_unloaded_shape(const ElasticRegion& region,
                                          const SymmetricBlockMatrix& hold,
                                          std::span<const double> weight,
                                          const std::function<VectorX(const VectorX&)>& answer,
                                          const Progress& progress = {});

/// Searches end where the image would go by less than this [m], a hundredth of a voxel.
inline constexpr double kStillOff = 1e-5;
inline constexpr int kMostUnloading = 60;

}  // namespace viscera
