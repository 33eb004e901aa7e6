#include "engine/organ/finite_parts.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/organ/organ_parts.h"
#include "kernels/paff/nodal_measures.h"

namespace viscera {
namespace {

/// Points a node, and nodes a point, about: measured on organs of 500 to 5,000 nodes.
constexpr std::size_t kPointsANode = 17, kNodesAPoint = 16;
/// Of each node at a point: a number and a gradient.
constexpr std::size_t kBytesANode = sizeof(std::uint16_t) + 3 * sizeof(double);

std::vector<double> flat(const std::vector<Vec3>& vectors) {
  std::vector<double> numbers;
  numbers.reserve(3 * vectors.size());
  for (const Vec3& v : vectors) numbers.insert(numbers.end(), v.data(), v.data() + 3);
  return numbers;
}

template <class To, class From>
std::vector<To> converted(const std::vector<From>& from) {
  return std::vector<To>(from.begin(), from.end());
}

}  // namespace

FiniteOptions finite_options(const OrganDescription& organ, const Tissue& tissue) {
  FiniteOptions options;
  options.density = tissue.density;
  options.viscous_time = organ.finite.viscous_time;
  options.dynamic = !organ.finite.quasi_static;
  options.iterations = organ.finite.iterations;
  options.iterations_released = std::max(options.iterations_released, organ.finite.iterations);
  return options;
}

Result<FiniteParts> finite_parts(const OrganModel& model, const OrganDescription& organ,
                                 const ElasticSolver& solver) {
  const auto* regions = dynamic_cast<const RegionSolver*>(&solver);
  if (!regions)
    return failure(fmt::format("formulation: found {} with response finite, expected galerkin",
                               organ.formulation));
  if (model.places.nodes != model.cloud.size())
    return failure(fmt::format(
        "response: found finite on a body of {} nodes whose folds give {} of them a twin, expected "
        "one without folds, or response linear",
        model.cloud.size(), model.places.nodes - model.cloud.size()));
  auto region = regions->region([](const Vec3&) { return true; });
  if (!region) return std::unexpected(region.error());
  auto hold = regions->hold();
  if (!hold) return std::unexpected(hold.error());
  auto volumes = nodal_volumes(model.surface, model.cloud);
  if (!volumes) return std::unexpected(volumes.error());
  region->positions.clear();
  region->cell_begin = {0};
  region->cell_nodes.clear();
  region->cell_gradients.clear();
  return FiniteParts{std::move(*region), std::move(*hold), std::move(*volumes)};
}

Result<void> make_finite(OrganModel& model, const FiniteParts& parts, const FiniteOptions& options,
                         std::shared_ptr<const StiffnessFactor> step) {
  auto body = FiniteBody::create(parts.region, parts.hold);
  if (!body) return std::unexpected(body.error());
  auto shared = std::make_shared<const FiniteBody>(std::move(*body));
  auto solver = step ? FiniteSolver::prepared(std::move(shared), parts.volumes, options, step)
                     : FiniteSolver::prepare(std::move(shared), model.cloud.positions,
                                             parts.volumes, options);
  if (!solver) return std::unexpected(solver.error());
  model.finite = std::make_shared<const FiniteSolver>(std::move(*solver));
  model.step_compliance = step_columns_to_come(model, model.finite->factor());
  return {};
}

void keep_finite(const FiniteParts& parts, CacheArrays& arrays) {
  const ElasticRegion& region = parts.region;
  arrays["finite_moduli"] =
      std::vector<double>{region.shear_modulus, region.pointwise_lambda, region.averaged_lambda};
  arrays["finite_nodes"] = region.nodes;
  arrays["finite_weights"] = region.weights;
  arrays["finite_begin"] = converted<int>(region.begin);
  arrays["finite_point_nodes"] = region.point_nodes;
  arrays["finite_gradients"] = flat(region.gradients);
  arrays["finite_cell"] = region.cell;
  arrays["finite_psi"] = region.psi;
  arrays["finite_hold_begin"] = converted<int>(parts.hold.pattern.row_begin);
  arrays["finite_hold_columns"] = parts.hold.pattern.columns;
  arrays["finite_hold"] = parts.hold.blocks;
  arrays["finite_volumes"] = parts.volumes;
}

std::optional<FiniteParts> finite_from_cache(CacheArrays& arrays, std::size_t nodes) {
  FiniteParts parts;
  bool whole = true;
  const auto take = [&](const char* name, auto& into) {
    using Into = std::remove_reference_t<decltype(into)>;
    const auto found = arrays.find(name);
    auto* values = found == arrays.end() ? nullptr : std::get_if<Into>(&found->second);
    if (values) into = std::move(*values);
    whole = whole && values;
  };
  ElasticRegion& region = parts.region;
  std::vector<double> moduli, gradients;
  std::vector<int> begin, hold_begin;
  take("finite_moduli", moduli);
  take("finite_nodes", region.nodes);
  take("finite_weights", region.weights);
  take("finite_begin", begin);
  take("finite_point_nodes", region.point_nodes);
  take("finite_gradients", gradients);
  take("finite_cell", region.cell);
  take("finite_psi", region.psi);
  take("finite_hold_begin", hold_begin);
  take("finite_hold_columns", parts.hold.pattern.columns);
  take("finite_hold", parts.hold.blocks);
  take("finite_volumes", parts.volumes);
  const auto all_below = [](const std::vector<int>& numbers, std::size_t end) {
    return std::ranges::all_of(numbers,
                               [&](int i) { return i >= 0 && static_cast<std::size_t>(i) < end; });
  };
  const auto ascends = [](const std::vector<int>& from, std::size_t rows, std::size_t end) {
    return from.size() == rows + 1 && from.front() == 0 && std::ranges::is_sorted(from) &&
           static_cast<std::size_t>(from.back()) == end;
  };
  const std::size_t points = region.weights.size();
  if (!whole || moduli.size() != 3 || gradients.size() != 3 * region.point_nodes.size() ||
      !ascends(begin, points, region.point_nodes.size()) ||
      !all_below(region.point_nodes, region.nodes.size()) || !all_below(region.nodes, nodes) ||
      (!region.cell.empty() && region.cell.size() != points) ||
      region.psi.size() != ElasticRegion::kTerms * region.cell.size() ||
      !ascends(hold_begin, nodes, parts.hold.pattern.columns.size()) ||
      !all_below(parts.hold.pattern.columns, nodes) ||
      parts.hold.blocks.size() != 9 * parts.hold.pattern.columns.size() ||
      parts.volumes.size() != nodes)
    return std::nullopt;
  region.shear_modulus = moduli[0];
  region.pointwise_lambda = moduli[1];
  region.averaged_lambda = moduli[2];
  for (std::size_t i = 0; i < gradients.size(); i += 3)
    region.gradients.emplace_back(gradients[i], gradients[i + 1], gradients[i + 2]);
  region.begin = converted<std::size_t>(begin);
  parts.hold.width = 3;
  parts.hold.pattern.row_begin = converted<std::size_t>(hold_begin);
  return parts;
}

std::size_t finite_bytes(std::size_t nodes, std::size_t factor_entries) {
  return nodes * kPointsANode * kNodesAPoint * kBytesANode + factor_entries * sizeof(float);
}

}  // namespace viscera
