// What an organ's model is made of, step by step: for its preparation, its plan and its cache.
#pragma once

#include <memory>
#include <vector>

#include "engine/organ/material_field.h"
#include "engine/organ/organ_model.h"
#include "kernels/finite/finite_solver.h"
#include "kernels/paff/stiffness_factor.h"
#include "kernels/paff/two_levels.h"

namespace viscera {

void set_surface(OrganModel& model, TriangleSurface surface);

/// Nodes as its resolution asks for them.
Result<PointCloud> place_cloud(const OrganDescription& organ, const TriangleSurface& surface,
                               const BodyDemand& demand, const Progress& progress);

/// Fills what follows from surface and cloud alone: kept out of the cache because it takes less
/// time to compute than to read.
Result<void> add_places(OrganModel& model, const OrganDescription& organ, const BodyDemand& demand);

/// What its equations are made from; notes at its touchable places what lies under them. `field`:
/// of its parts; null: it has none. Refers to all of these.
ElasticProblem elastic_problem(OrganModel& model, const OrganDescription& organ,
                               const Tissue& tissue, const MaterialField* field);

bool in_any(const std::vector<Region>& regions, const Vec3& x);

/// Of columns in single precision.
std::size_t compliance_bytes(std::size_t places, std::size_t touchable);

/// Whether columns are left to be made when they are asked for.
bool comes_on_demand(const OrganModel& model, const OrganDescription& organ,
                     std::size_t column_budget);

/// Touchable places whose columns preparation makes, by their indices.
std::vector<int> prepared_places(const OrganModel& model, const OrganDescription& organ,
                                 const BodyDemand& demand, std::size_t column_budget);

/// The columns that are there, packed.
SurfaceCompliance made_part(const SurfaceCompliance& compliance);

/// Room for all columns of the whole surface, which that factor, or those levels, will make.
SurfaceCompliance columns_to_come(const OrganModel& model,
                                  std::shared_ptr<const StiffnessFactor> factor);
SurfaceCompliance columns_to_come(const OrganModel& model, std::shared_ptr<const TwoLevels> levels);

/// The same of a step at finite strain, with a row for each node's unknowns after those of the
/// places.
SurfaceCompliance step_columns_to_come(const OrganModel& model, const FiniteSolver& solver);

}  // namespace viscera
