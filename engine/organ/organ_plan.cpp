#include "engine/organ/organ_plan.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/organ/finite_parts.h"
#include "engine/organ/material_field.h"
#include "engine/organ/organ_cache.h"
#include "engine/organ/organ_parts.h"
#include "engine/organ/shape.h"
#include "kernels/formulations/formulations.h"
#include "kernels/paff/preparation_cost.h"

namespace viscera {
namespace {

/// Columns in the order of elimination and in that of the nodes, with the copy of their square that
/// is checked, beside the factor.
std::size_t columns_bytes(const OrganPlan& plan, const PreparationCost& cost) {
  return 2 * compliance_bytes(plan.places, plan.prepared_places) +
         compliance_bytes(plan.prepared_places, plan.prepared_places) +
         cost.factor_entries * sizeof(float) + cost.assembling_bytes;
}

/// Operations at 1e11 a second (two cores, single precision): factoring, and for each touchable
/// place with columns a share of the factor. Assembly is linear in the nodes [s].
double expected_time(const OrganPlan& plan, const PreparationCost& cost) {
  constexpr double kPerSecond = 1e11, kAssembly = 4.5e-4, kColumns = 2.5;
  return 0.1 + kAssembly * static_cast<double>(plan.nodes) +
         (2.0 * cost.factoring_operations + kColumns * static_cast<double>(plan.prepared_places) *
                                                static_cast<double>(cost.factor_entries)) /
             kPerSecond;
}

/// Of a body that two levels answer; no columns are prepared.
void plan_levels(const LevelsCost& cost, bool fibres, OrganPlan& plan) {
  constexpr double kPerSecond = 1e11, kInDouble = 2e10, kAssembly = 1.5e-3;
  /// Quadrature, fields and what makes gradients consistent; then points and what is read of them.
  constexpr std::size_t kFieldBytes = 40000, kPartBytes = 36000;
  const std::size_t model = plan.begun->memory_bytes();
  plan.prepared_places = 0;
  plan.memory_bytes = model + finite_bytes(plan.nodes, cost, fibres);
  plan.preparation_bytes =
      std::max(model + plan.nodes * kFieldBytes + cost.consistency_bytes,
               plan.memory_bytes + plan.nodes * kPartBytes + cost.coarse.factoring_bytes);
  plan.prepare_s = 0.1 + kAssembly * static_cast<double>(plan.nodes) +
                   2.0 * cost.consistency_operations / kInDouble +
                   4.0 * cost.coarse.factoring_operations / kPerSecond;
}

}  // namespace

Result<OrganPlan> plan_organ(OrganDescription organ, const Tissue& tissue, const Reach& reach,
                             const PrepareOptions& options) {
  auto name = shape_key(organ.geometry, options.assets);
  if (!name) return std::unexpected(name.error());
  PreparedShape shape;
  shape.key = std::move(*name);
  auto surface = build_shape(organ.geometry, options.assets, shape.notes);
  if (!surface) return std::unexpected(surface.error());
  const auto demand = demand_on(organ, tissue, reach, *surface);
  if (!demand) return std::unexpected(demand.error());
  organ.response = response_of(organ, *demand);
  if (tissue.fibres.modulus > 0.0) organ.material.fibres = tissue.fibres;
  auto key = organ_key(organ, tissue, shape, *demand, options);
  if (!key) return std::unexpected(key.error());
  auto plan =
      plan_surface(std::move(*surface), {organ, tissue.elastic, *demand, options.column_budget});
  if (!plan) return plan;
  if (plan->begun->deformable()) {
    auto field = MaterialField::make(organ, tissue, plan->begun->surface, options.assets);
    if (!field) return std::unexpected(field.error());
    if (*field)
      if (auto sound = (*field)->check(plan->begun->cloud); !sound)
        return std::unexpected(sound.error());
  }
  plan->response = organ.response;
  plan->cached = cached_bytes(*demand, *key) > 0;
  plan->notes = std::move(shape.notes);
  return plan;
}

Result<OrganPlan> plan_surface(TriangleSurface surface, const PlanRequest& request) {
  const auto& [organ, material, demand, column_budget] = request;
  OrganPlan plan;
  plan.begun = std::make_shared<OrganModel>();
  OrganModel& model = *plan.begun;
  set_surface(model, std::move(surface));
  plan.triangles = model.surface.triangles.size();
  plan.memory_bytes = plan.preparation_bytes = model.memory_bytes();
  if (!demand.elastic()) return plan;
  const Formulation* formulation = find_formulation(organ.formulation);
  if (!formulation) return failure("formulation: " + unknown_formulation(organ.formulation));
  auto cloud = place_cloud(organ, model.surface, demand, no_progress());
  if (!cloud) return std::unexpected(cloud.error());
  model.cloud = std::move(*cloud);
  if (auto done = add_places(model, organ, demand); !done) return std::unexpected(done.error());
  plan.prepared_places = prepared_places(model, organ, demand, column_budget).size();
  plan.nodes = model.cloud.size();
  plan.surface_nodes = model.cloud.surface_count;
  plan.places = model.places.size();
  plan.touchable_places = model.touchable.size();
  const PreparationCost cost =
      preparation_cost(model.fields->cloud(), formulation->coupling(material));
  const bool finite = organ.response == Response::kFinite;
  const bool fibres = organ.material.fibres || std::ranges::any_of(organ.parts, [](const auto& p) {
                        return p.fibres.has_value();
                      });
  if (finite && answers_in_levels(cost.factor_entries)) {
    plan_levels(levels_cost(model.fields->cloud(), formulation->coupling(material)), fibres, plan);
    return plan;
  }
  plan.memory_bytes = model.memory_bytes() + compliance_bytes(plan.places, plan.prepared_places);
  if (plan.prepared_places < plan.touchable_places)
    plan.memory_bytes += sizeof(float) * cost.factor_entries;
  if (finite)
    plan.memory_bytes += compliance_bytes(plan.places + plan.nodes, plan.prepared_places) +
                         finite_bytes(plan.nodes, cost.factor_entries, fibres);
  const std::size_t shapes = (demand.sags ? 1 : 0) + demand.moving_holds.size();
  if (!finite) plan.memory_bytes += 9 * shapes * plan.places * sizeof(float);
  if (organ.displacement_storage == DisplacementStorage::kHalf)
    plan.memory_bytes = plan.memory_bytes -
                        compliance_bytes(plan.places, plan.touchable_places) / 2 +
                        compliance_bytes(plan.touchable_places, plan.touchable_places);
  plan.preparation_bytes =
      model.memory_bytes() + std::max(cost.factoring_bytes, columns_bytes(plan, cost));
  plan.prepare_s = expected_time(plan, cost);
  if (finite) {
    // The same once more: another factor, with columns of its own.
    plan.preparation_bytes += finite_bytes(plan.nodes, cost.factor_entries, fibres);
    plan.prepare_s *= 2.0;
  }
  return plan;
}

Result<void> set_aside(const OrganPlan& plan, MemoryBudget& budget) {
  const std::size_t needed =
      plan.cached ? plan.memory_bytes : std::max(plan.preparation_bytes, plan.memory_bytes);
  const auto fits =
      budget.check(needed,
                   fmt::format("spacings that make {} nodes, with columns for {} places, and",
                               plan.nodes, plan.prepared_places),
                   "raise finest_spacing_mm, or spacing_mm");
  if (!fits) return failure("resolution: " + fits.error().text());
  budget.keep(plan.memory_bytes);
  return {};
}

}  // namespace viscera
