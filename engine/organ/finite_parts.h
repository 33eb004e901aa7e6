// What an organ at finite strain is prepared from, and its way through the cache.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/organ/material_field.h"
#include "engine/organ/organ_model.h"
#include "engine/organ/region_arrays.h"
#include "kernels/finite/finite_solver.h"
#include "kernels/paff/elasticity.h"
#include "kernels/paff/preparation_cost.h"

namespace viscera {

/// Its points, what its hold adds, and the integrals of its nodes' fields.
struct FiniteParts {
  ElasticRegion region;  ///< without what only linear bodies need: rows of cells, places of points
  SymmetricBlockMatrix hold;
  /// Of their densities over the tissue's [m3]                                                 (N)
  std::vector<double> volumes;
  /// As LoosePieces has it; empty: something holds all of it, or nothing any. (N)
  std::vector<int> piece_of;
  /// From the imaged shape to that without stress (unloaded_shape.h); empty: the same  (3 N) [m]
  std::vector<double> unloaded;
  /// Of an unloaded body that isn't as it was imaged: the weight there (3 N) [N]; empty: it is.
  std::vector<double> weight;
  /// As OrganModel::hold_loads, column after column.
  std::vector<double> hold_loads;
};

/// Sets `parts.unloaded` of a body that was imaged under `weight` [m/s2]; nothing where that is 0.
/// Where no such shape is found `notes` says so: only what changes of its weight acts then.
/// `answer`: as find_unloaded_shape has it. Fails where it is cancelled.
Result<void> unload(FiniteParts& parts, const Vec3& weight, double density,
                    const std::function<VectorX(const VectorX&)>& answer,
                    std::vector<std::string>& notes, const Progress& progress = {});

/// FiniteOptions::decrement of a body or a piece that nothing holds. Where it lies still, the
/// weight that it doesn't give in to is nearly all of a step's energy, m g^2 dt^2 / 2: what moves
/// it by a of g too much has a^2 of that.
inline constexpr double kFreeDecrement = 2e-8;

/// What nothing holds rests, for what hands and the next step's cells meet, on the inertia of a
/// step (ElasticProblem::foundation): nothing else withstands them between two frames.
FiniteOptions finite_options(const OrganDescription& organ, const Tissue& tissue);

/// Where a hold moves by 1 along an axis: the surface in that region of `organ.fixed`, but for what
/// earlier regions hold.
std::function<Vec3(const Vec3&)> moved_hold(const OrganDescription& organ, int number, int axis);
/// Fails where all of these are 0: that hold has no surface.
Result<void> expect_hold(std::span<const double> loads_or_ways, int number);

/// Fails, naming the key, for formulations that have no such points.
/// `field`: of its parts; null: it has none.
Result<FiniteParts> finite_parts(const OrganModel& model, const OrganDescription& organ,
                                 const BodyDemand& demand, const ElasticSolver& solver,
                                 const MaterialField* field);

/// Sets OrganModel::finite and ::step_compliance; `step` null: factors what a step needs.
/// `changes`: its tissue may coagulate.
Result<void> make_finite(OrganModel& model, const FiniteParts& parts, const FiniteOptions& options,
                         bool changes, std::shared_ptr<const StiffnessFactor> step);

/// Whether a body whose factor, with averaged dilatation, would have so many numbers is answered by
/// two levels (two_levels.h) in its place.
bool answers_in_levels(std::size_t factor_entries);
/// Of the organ's body, as its cloud stands.
bool answers_in_levels(const OrganModel& model, const OrganDescription& organ);

/// Of the coarse nodes of the body at rest, and of a step.
struct CoarseFactors {
  std::shared_ptr<const StiffnessFactor> still, step;
};

/// The same of a large body, with OrganModel::compliance; what `coarse` lacks is factored. Where
/// `weight` isn't 0 it is unloaded first.
Result<CoarseFactors> make_finite_in_levels(OrganModel& model, FiniteParts& parts,
                                            const FiniteOptions& options, bool changes,
                                            const CoarseFactors& coarse,
                                            const Vec3& weight = Vec3::Zero());

void keep_finite(const FiniteParts& parts, CacheArrays& arrays);
/// None where there is none, or not of a piece.
std::optional<FiniteParts> finite_from_cache(CacheArrays& arrays, std::size_t nodes);

/// Of the body, and of a step's factor of so many numbers in both its forms [bytes].
std::size_t finite_bytes(std::size_t nodes, std::size_t factor_entries, bool fibres = false);
/// The same with levels, at rest and of a step.
std::size_t finite_bytes(std::size_t nodes, const LevelsCost& cost, bool fibres = false);

}  // namespace viscera
