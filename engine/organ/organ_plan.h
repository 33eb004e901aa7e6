// What preparation of an organ would build and cost, without factoring anything.
#pragma once

#include <string>
#include <vector>

#include "engine/io/memory_limit.h"
#include "engine/organ/organ_model.h"

namespace viscera {

struct OrganPlan {
  std::size_t triangles = 0, nodes = 0, surface_nodes = 0, places = 0, touchable_places = 0;
  std::size_t prepared_places = 0;    ///< of the touchable ones, those with columns from the start
  std::size_t memory_bytes = 0;       ///< of the prepared model
  std::size_t preparation_bytes = 0;  ///< peak while preparing, the model included
  double prepare_s = 0.0;             ///< expected on this machine's kind, no cache
  bool cached = false;
  Response response = Response::kLinear;  ///< never auto
  std::shared_ptr<OrganModel> begun;      ///< the model as far as it stands before its equations
  std::vector<std::string> notes;         ///< of the surface
};

/// What an organ is planned from and for; its response isn't auto any more.
struct PlanRequest {
  const OrganDescription& organ;
  const IsotropicMaterial& material;
  const BodyDemand& demand;
  std::size_t column_budget = kColumnBudget;
};

/// Reads and shapes the organ's geometry.
Result<OrganPlan> plan_organ(OrganDescription organ, const Tissue& tissue, const Reach& reach,
                             const PrepareOptions& options);
/// The same for a surface that is there already; the organ's geometry isn't read, nor the cache.
Result<OrganPlan> plan_surface(TriangleSurface surface, const PlanRequest& request);

/// Refuses what wouldn't fit, before minutes are spent on it; sets aside what stays.
Result<void> set_aside(const OrganPlan& plan, MemoryBudget& budget);

}  // namespace viscera
