#include "engine/organ/organ_parts.h"

#include <algorithm>

#include "engine/organ/finite_parts.h"
#include "kernels/contact/near_modulus.h"
#include "kernels/contact/near_thickness.h"
#include "kernels/formulations/formulations.h"
#include "kernels/points/node_placement.h"
#include "kernels/points/surface_tree.h"

namespace viscera {

bool in_any(const std::vector<Region>& regions, const Vec3& x) {
  return std::any_of(regions.begin(), regions.end(),
                     [&](const Region& region) { return region.contains(x); });
}

void set_surface(OrganModel& model, TriangleSurface surface) {
  model.surface = std::move(surface);
  model.rest_bounds = bounds(model.surface);
  model.rest_positions.reserve(model.surface.vertices.size());
  for (const Vec3& v : model.surface.vertices) model.rest_positions.push_back(v.cast<float>());
  for (const Vec3& n : vertex_normals(model.surface)) model.rest_normals.push_back(n.cast<float>());
}

Result<PointCloud> place_cloud(const OrganDescription& organ, const TriangleSurface& surface,
                               const BodyDemand& demand, const Progress& progress) {
  const SurfaceTree tree(surface);
  const Resolution& r = organ.resolution;
  return place_nodes(
      surface, tree,
      graded_spacing(r.spacing, r.finest, r.gradient, vertices_in(demand.fine, surface)), {},
      progress);
}

Result<void> add_places(OrganModel& model, const OrganDescription& organ,
                        const BodyDemand& demand) {
  const Formulation* formulation = find_formulation(organ.formulation);
  model.fields =
      std::make_shared<const ShapeFunctions>(formulation->fields(model.surface, model.cloud));
  auto places = place_on_surface(model.surface, *model.fields);
  if (!places) return std::unexpected(places.error());
  model.places = std::move(*places);
  // All of the surface: a tool may leave its path. What only sags has no place to touch.
  // Where loads enter a body at finite strain, whether any ever will.
  if (demand.touched || organ.response == Response::kFinite) {
    auto touchable = touchable_part(model.places, [](const Vec3&) { return true; });
    if (!touchable) return std::unexpected(touchable.error());
    model.touchable = std::move(*touchable);
  }
  model.drawn = carry_surface(model.surface, model.places);
  model.finest_spacing =
      *std::min_element(model.cloud.spacings.begin(), model.cloud.spacings.end());
  return {};
}

ElasticProblem elastic_problem(OrganModel& model, const OrganDescription& organ,
                               const Tissue& tissue, const MaterialField* field) {
  ElasticProblem problem;
  if (field) {
    problem.relative_modulus = [field](const Vec3& x, double edge) {
      return field->modulus(x, edge);
    };
    note_modulus(model.touchable, model.material, PatchContact::spread_factor(),
                 problem.relative_modulus);
  }
  problem.is_fixed = [&organ](const Vec3& x) { return in_any(organ.fixed, x); };
  if (model.touchable.size() > 0 && !organ.fixed.empty())
    note_thickness(model.touchable, model.material, PatchContact::spread_factor(), model.surface,
                   SurfaceTree(model.surface), problem.is_fixed);
  if (field ? field->has_fibres() : tissue.fibres.modulus > 0.0)
    problem.fibres = [field, &tissue](const Vec3& x, double edge) {
      return field ? field->fibres(x, edge) : tissue.fibres;
    };
  problem.surface = &model.surface;
  problem.cloud = &model.cloud;
  problem.fields = model.fields;
  problem.material = model.material;
  problem.few_points = organ.response == Response::kFinite;
  problem.points_alone = answers_in_levels(model, organ);
  if (organ.free) problem.foundation = inertia_over_step(finite_options(organ, tissue));
  return problem;
}

std::size_t compliance_bytes(std::size_t places, std::size_t touchable) {
  return 9 * places * touchable * sizeof(float);
}

bool comes_on_demand(const OrganModel& model, const OrganDescription& organ,
                     std::size_t column_budget) {
  if (organ.response == Response::kFinite) return true;
  // Half precision needs the greatest entry of all.
  return compliance_bytes(model.places.size(), model.touchable.size()) > column_budget &&
         organ.displacement_storage == DisplacementStorage::kSingle &&
         find_formulation(organ.formulation)->keeps_factor();
}

std::vector<int> prepared_places(const OrganModel& model, const OrganDescription& organ,
                                 const BodyDemand& demand, std::size_t column_budget) {
  const bool all = !comes_on_demand(model, organ, column_budget);
  std::vector<Region> fine;
  for (const Region& region : demand.fine) fine.push_back(region.grown(organ.resolution.finest));
  std::vector<int> places;
  for (std::size_t t = 0; t < model.touchable.size(); ++t)
    if (all || in_any(fine, model.touchable.positions[t])) places.push_back(static_cast<int>(t));
  return places;
}

SurfaceCompliance made_part(const SurfaceCompliance& compliance) {
  SurfaceCompliance part;
  part.places = compliance.places;
  part.symmetric = compliance.symmetric;
  part.touchable = compliance.on_demand->made();
  const auto three = static_cast<std::ptrdiff_t>(3 * compliance.rows());
  part.columns.reserve(part.touchable.size() * static_cast<std::size_t>(three));
  for (const int place : part.touchable) {
    const auto from = compliance.columns.begin() + place * three;
    part.columns.insert(part.columns.end(), from, from + three);
  }
  return part;
}

namespace {

SurfaceCompliance to_come(const OrganModel& model, std::shared_ptr<const ColumnSource> source,
                          std::size_t rows) {
  SurfaceCompliance compliance;
  compliance.places = rows;
  compliance.touchable = model.touchable.places;
  const std::size_t touchable = compliance.touchable.size();
  compliance.columns.resize(3 * compliance.rows() * touchable);
  compliance.on_demand = std::make_shared<ColumnsOnDemand>(std::move(source), touchable);
  return compliance;
}

}  // namespace

SurfaceCompliance columns_to_come(const OrganModel& model,
                                  std::shared_ptr<const StiffnessFactor> factor) {
  return to_come(model, StiffnessFactor::columns(std::move(factor), model.places.fields),
                 model.places.size());
}

SurfaceCompliance columns_to_come(const OrganModel& model,
                                  std::shared_ptr<const TwoLevels> levels) {
  return to_come(model,
                 TwoLevels::columns(std::move(levels), TwoLevels::Columns::kSolved,
                                    model.places.fields, model.touchable.size()),
                 model.places.size());
}

SurfaceCompliance step_columns_to_come(const OrganModel& model, const FiniteSolver& solver) {
  SparseWeights rows = model.places.fields;
  for (std::size_t node = 0; node < model.places.nodes; ++node) {
    rows.nodes.push_back(static_cast<int>(node));
    rows.values.push_back(1.0f);
    rows.row_begin.push_back(static_cast<int>(rows.nodes.size()));
  }
  const std::size_t touchable = model.touchable.size();
  return to_come(model,
                 solver.levels() ? TwoLevels::columns(solver.levels(), TwoLevels::Columns::kCycle,
                                                      rows, touchable)
                                 : StiffnessFactor::columns(solver.factor(), rows, touchable),
                 rows.rows());
}

}  // namespace viscera
