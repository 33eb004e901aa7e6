// How a body's compliance and shape follow where tissue has stiffened and shrunk since the body was
// prepared: an update of low rank beside the precomputed compliance, which itself stays.
//
// With Delta K = B^T B on the m nodes that the changed tissue reaches (elastic_region.h) and C =
// Phi K^-1 Phi^T, [Woodbury1950] gives, exactly,
//   C' = C - V V^T,   V = C_sm B^T G^-T,   G G^T = I + B C_mm B^T,
// from what unit forces on those nodes do to each other (C_mm) and to the places of the surface
// (C_sm), which preparation keeps for a region. G G^T has no eigenvalue below 1 and C' stays
// positive, whatever is stiffened. The columns of V that matter at touchable places are few, since
// what lies deep or far off hardly shows there: those of least effect are dropped, which leaves the
// body a little softer, and never indefinite.
//
// Shrinkage is a strain e without stress. Its load g makes the free shape, Phi K'^-1 g, to which
// forces add: with y = g - B^T (G G^T)^-1 B C_mm g it is C_sm y.
//
// Updates don't add up: each is made from the prepared body and all that has changed by then.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "kernels/base/fields.h"
#include "kernels/base/progress.h"
#include "kernels/contact/touchable_surface.h"
#include "kernels/finite/tissue_change.h"
#include "kernels/paff/elastic_region.h"
#include "kernels/paff/elasticity.h"

namespace viscera {

/// A part of a prepared body in which tissue may change, and what unit forces on its n nodes do.
struct ChangeableRegion {
  ElasticRegion tissue;
  std::size_t rows = 0;       ///< 3 places
  std::vector<float> places;  ///< Phi K^-1 E, column-major [m/N]     (rows x 3n)
  std::vector<float> nodes;   ///< E^T K^-1 E, column-major [m/N]       (3n x 3n)

  bool empty() const { return tissue.size() == 0; }
  std::size_t memory_bytes() const;
};

/// `solver` prepared the body that `tissue` is a part of; `places` as for its compliance. Empty
/// where there is no tissue. Fails as ElasticSolver::compliance does.
Result<ChangeableRegion> changeable_region(ElasticSolver& solver, ElasticRegion tissue,
                                           const SparseWeights& places, const Progress& progress);
/// What one of so many nodes takes [bytes].
std::size_t changeable_bytes(std::size_t places, std::size_t nodes);

/// As large as some hundred columns of the compliance. A file may rather keep the change that it
/// was made from: made again it has the same bits.
struct StiffnessUpdate {
  std::size_t rows = 0;          ///< 3 places
  std::size_t rank = 0;          ///< columns of V; 0: nothing stiffened
  std::vector<float> columns;    ///< V, column-major [sqrt(m/N)]                  (rows x rank)
  std::vector<float> touchable;  ///< its rows of touchable places, likewise        (3 T x rank)
  /// Mean factor of the tissue about each touchable place; empty: 1 everywhere.            (T)
  std::vector<float> stiffness;
  /// Displacements of the places without forces [m]; empty: none.                       (rows)
  std::vector<float> shift;
  /// Of a body at finite strain, whose energy follows the change itself; else empty.
  TissueChange change;

  // What it took, and what it left.
  std::size_t nodes = 0;          ///< m
  std::size_t modes = 0;          ///< columns of V before any were dropped
  double greatest_stiffness = 1;  ///< of the change
  double greatest_shift = 0.0;    ///< [m]

  std::size_t memory_bytes() const;

  static constexpr auto fields() {
    using U = StiffnessUpdate;
    return std::tuple(
        field("rows", &U::rows), field("rank", &U::rank), field("columns", &U::columns),
        field("touchable", &U::touchable), field("stiffness", &U::stiffness),
        field("shift", &U::shift), field("change", &U::change), field("nodes", &U::nodes),
        field("modes", &U::modes), field("greatest_stiffness", &U::greatest_stiffness),
        field("greatest_shift", &U::greatest_shift));
  }
};
static_assert(fields_cover<StiffnessUpdate>());

/// Eigenvalues of V^T V at touchable places below this share of the greatest are dropped. Measured
/// on a block and a hemisphere (tests), greatest difference from the compliance of the body
/// factored anew, over its greatest entry: 1e-6 to 7e-6, and 1e-6 with none dropped, which is what
/// single precision leaves. A lesion of a few millimetres keeps some 130 modes of 240 to 540.
inline constexpr double kDroppedModes = 1e-5;

/// Parallel, the same for any number of threads; meant for a thread of its own beside the frames.
/// `surface`: the touchable places among those of the region. Factors below 1 count as 1,
/// shrinkages below 0 as 0, and so do those that are no numbers.
StiffnessUpdate update_stiffness(const ChangeableRegion& region, const TissueChange& change,
                                 const TouchableSurface& surface, double dropped = kDroppedModes);

/// Of a body at finite strain, all of whose points `tissue` holds: the change, and how stiff its
/// touchable places have become.
StiffnessUpdate energy_update(const ElasticRegion& tissue, TissueChange change,
                              const TouchableSurface& surface);

/// Multiplications that it takes, about: so that who runs it beside frames can say beforehand when
/// it will be due.
double update_cost(const ChangeableRegion& region, const TissueChange& change,
                   const TouchableSurface& surface);

/// sums -= V V_t^T loads: what the update takes from displacements of all places (`sums` has
/// `rows`) or of the touchable ones alone (3 T) under loads on touchable places. Parallel,
/// deterministic.
void subtract_update(const StiffnessUpdate& update, std::span<const int> touched,
                     std::span<const Vec3> loads, std::span<float> sums);

}  // namespace viscera
