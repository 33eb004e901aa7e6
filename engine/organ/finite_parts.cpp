#include "engine/organ/finite_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>

#include "engine/organ/organ_parts.h"
#include "kernels/finite/unloaded_shape.h"
#include "kernels/formulations/formulations.h"
#include "kernels/paff/nodal_measures.h"

namespace viscera {
namespace {

/// What a body keeps of each node, most of it gradients at points [bytes]. Measured on the
/// gallbladder at 470 to 3,800 nodes and on the liver at 1,440: 9,900 to 17,600. A guard takes the
/// greatest.
constexpr std::size_t kBytesANode = 17600;
/// The same of fibres: five numbers a point, of which a node has no more than some 18.
constexpr std::size_t kFibreBytesANode = 18 * 5 * sizeof(double);
/// Of each number of the factor: itself, and in sixteen bits (CompactFactor).
constexpr std::size_t kBytesANumber = sizeof(float) + sizeof(std::int16_t);

/// More numbers than these no factor of a body at finite strain has: the greatest balls that stay
/// below have some 5,500 nodes. Of 7,731 two levels are prepared within .65 GB.
constexpr std::size_t kMostFactored = 100'000'000;
/// No body with fewer nodes has such a factor.
constexpr std::size_t kFewNodes = 4000;
/// What two levels keep of each node beside the coarse factor: rows of K, cells, groups [bytes].
constexpr std::size_t kLevelBytesANode = 14000;

constexpr const char* kFinite = "finite_";  // before the names of its arrays

}  // namespace

std::function<Vec3(const Vec3&)> moved_hold(const OrganDescription& organ, int number, int axis) {
  return [&organ, number, axis](const Vec3& x) {
    for (int r = 0; r <= number; ++r)
      if (organ.fixed[static_cast<std::size_t>(r)].contains(x))
        return r == number ? Vec3(Vec3::Unit(axis)) : Vec3(Vec3::Zero());
    return Vec3(Vec3::Zero());
  };
}

Result<void> expect_hold(std::span<const double> loads_or_ways, int number) {
  if (std::ranges::any_of(loads_or_ways, [](double one) { return one != 0.0; })) return {};
  return failure(fmt::format(
      "moving_holds: found region {} of fixed, which holds no surface that earlier regions leave, "
      "expected one that does",
      number));
}

FiniteOptions finite_options(const OrganDescription& organ, const Tissue& tissue) {
  FiniteOptions options;
  options.time_step = organ.finite.time_step;
  options.density = tissue.density;
  options.viscous_time = organ.finite.viscous_time;
  const double instantaneous = PronyForce(tissue.prony).instantaneous();
  for (const PronyTerm& term : tissue.prony)
    options.relaxation.push_back({term.g * instantaneous, term.tau});
  options.dynamic = !organ.finite.quasi_static;
  options.free = organ.free;
  if (organ.free) options.decrement = kFreeDecrement;
  options.iterations = organ.finite.iterations;
  options.iterations_released = std::max(options.iterations_released, organ.finite.iterations);
  // Rolling turns what the factor answers by, and more steps are what brings it back.
  if (organ.free) options.iterations = options.iterations_released;
  return options;
}

Result<FiniteParts> finite_parts(const OrganModel& model, const OrganDescription& organ,
                                 const BodyDemand& demand, const ElasticSolver& solver,
                                 const MaterialField* field) {
  const auto* regions = dynamic_cast<const RegionSolver*>(&solver);
  if (!regions)
    return failure(fmt::format("formulation: found {} with response finite, expected galerkin",
                               organ.formulation));
  auto region = regions->region([](const Vec3&) { return true; });
  if (!region) return std::unexpected(region.error());
  auto hold = regions->hold();
  if (!hold) return std::unexpected(hold.error());
  std::function<double(const Vec3&, double)> density;
  if (field) density = [field](const Vec3& x, double edge) { return field->density(x, edge); };
  auto volumes = nodal_volumes(model.surface, model.cloud, *model.fields, density);
  if (!volumes) return std::unexpected(volumes.error());
  region->cell_begin = {0};
  region->cell_nodes.clear();
  region->cell_gradients.clear();
  FiniteParts parts{.region = std::move(*region),
                    .hold = std::move(*hold),
                    .volumes = std::move(*volumes),
                    .piece_of = loose_pieces(regions->pieces(), model.fields->cloud().size())};
  for (const int number : demand.moving_holds)
    for (int axis = 0; axis < 3; ++axis) {
      const std::vector<double> loads = regions->held_loads(moved_hold(organ, number, axis));
      if (auto holds = expect_hold(loads, number); !holds) return std::unexpected(holds.error());
      parts.hold_loads.insert(parts.hold_loads.end(), loads.begin(), loads.end());
    }
  return parts;
}

Result<void> unload(FiniteParts& parts, const Vec3& weight, double density,
                    const std::function<VectorX(const VectorX&)>& answer,
                    std::vector<std::string>& notes, const Progress& progress) {
  if (weight.isZero(0.0)) return {};
  std::vector<double> forces;
  for (const double volume : parts.volumes)
    for (Eigen::Index k = 0; k < 3; ++k) forces.push_back(density * volume * weight[k]);
  auto found = find_unloaded_shape(parts.region, parts.hold, forces, answer, progress);
  if (found)
    parts.unloaded = std::move(found->displacements);
  else if (found.error().text() == kCancelled)
    return std::unexpected(found.error());
  else
    notes.push_back(found.error().text() +
                    ". Its imaged shape counts as one without stress: only what changes of gravity "
                    "acts on it. Hold more of it, or raise youngs_modulus_kPa");
  return {};
}

namespace {

Result<void> take_solver(OrganModel& model, FiniteSolver solver, const FiniteParts& parts,
                         bool changes) {
  if (!parts.unloaded.empty()) {
    auto body = FiniteBody::create(parts.region, parts.hold, parts.unloaded, parts.weight);
    if (!body) return std::unexpected(body.error());
    solver = solver.with(std::make_shared<const FiniteBody>(std::move(*body)));
  }
  model.finite = std::make_shared<const FiniteSolver>(std::move(solver));
  const auto rows = static_cast<Eigen::Index>(3 * model.finite->body().nodes());
  model.hold_loads = Eigen::Map<const MatrixX>(
      parts.hold_loads.data(), rows, static_cast<Eigen::Index>(parts.hold_loads.size()) / rows);
  model.step_compliance = step_columns_to_come(model, *model.finite);
  model.energy_points = parts.region.positions;
  if (!changes) return {};
  model.changeable.tissue.positions = parts.region.positions;
  model.changeable.tissue.weights = parts.region.weights;
  model.changeable.tissue.modulus = parts.region.modulus;
  return {};
}

}  // namespace

Result<void> make_finite(OrganModel& model, const FiniteParts& parts, const FiniteOptions& options,
                         bool changes, std::shared_ptr<const StiffnessFactor> step) {
  auto body = FiniteBody::create(parts.region, parts.hold);
  if (!body) return std::unexpected(body.error());
  auto shared = std::make_shared<const FiniteBody>(std::move(*body));
  auto solver = step ? FiniteSolver::prepared(std::move(shared), model.fields->cloud().positions,
                                              parts.volumes, options, step, parts.piece_of)
                     : FiniteSolver::prepare(std::move(shared), model.fields->cloud().positions,
                                             parts.volumes, options, parts.piece_of);
  if (!solver) return std::unexpected(solver.error());
  return take_solver(model, std::move(*solver), parts, changes);
}

bool answers_in_levels(std::size_t factor_entries) {
  return factor_entries > kMostFactored;
}

bool answers_in_levels(const OrganModel& model, const OrganDescription& organ) {
  if (organ.response != Response::kFinite || model.cloud.size() < kFewNodes) return false;
  const Formulation* formulation = find_formulation(organ.formulation);
  return answers_in_levels(
      preparation_cost(model.fields->cloud(), formulation->coupling(model.material))
          .factor_entries);
}

Result<CoarseFactors> make_finite_in_levels(OrganModel& model, FiniteParts& parts,
                                            const FiniteOptions& options, bool changes,
                                            const CoarseFactors& coarse, const Vec3& weight) {
  const PointCloud& cloud = model.fields->cloud();
  std::vector<double> foundation;
  if (options.free)
    for (const double volume : parts.volumes)
      foundation.push_back(inertia_over_step(options) * volume);
  auto still = TwoLevels::make(
      RestStiffness::assemble(cloud.size(), parts.region, parts.hold, {.inertia = foundation}),
      cloud.positions, cloud.spacings, coarse.still);
  if (!still) return std::unexpected(still.error());
  auto at_rest = std::make_shared<const TwoLevels>(std::move(*still));
  auto unloaded = unload(
      parts, weight, options.density,
      [&](const VectorX& forces) {
        std::vector<float> column(forces.begin(), forces.end());
        at_rest->solve(column, 1);
        return VectorX(
            Eigen::Map<const Eigen::VectorXf>(column.data(), forces.size()).cast<double>());
      },
      model.notes);
  if (!unloaded) return std::unexpected(unloaded.error());
  auto body = FiniteBody::create(parts.region, parts.hold);
  if (!body) return std::unexpected(body.error());
  auto solver = FiniteSolver::prepare_in_levels(
      std::make_shared<const FiniteBody>(std::move(*body)), parts.region, parts.hold, cloud,
      parts.volumes, options, coarse.step);
  if (!solver) return std::unexpected(solver.error());
  const CoarseFactors made{at_rest->coarse(), solver->levels()->coarse()};
  model.figures.factor_bytes = made.still->factor_bytes();
  model.compliance = columns_to_come(model, std::move(at_rest));
  if (auto taken = take_solver(model, std::move(*solver), parts, changes); !taken)
    return std::unexpected(taken.error());
  return made;
}

void keep_finite(const FiniteParts& parts, CacheArrays& arrays) {
  keep_points(parts.region, kFinite, arrays);
  const std::vector<std::size_t>& begin = parts.hold.pattern.row_begin;
  arrays["finite_hold_begin"] = std::vector<int>(begin.begin(), begin.end());
  arrays["finite_hold_columns"] = parts.hold.pattern.columns;
  arrays["finite_hold"] = parts.hold.blocks;
  arrays["finite_volumes"] = parts.volumes;
  if (!parts.unloaded.empty()) arrays["finite_unloaded"] = parts.unloaded;
  if (!parts.hold_loads.empty()) arrays["finite_hold_loads"] = parts.hold_loads;
  arrays["finite_positions"] = flat(parts.region.positions);
}

std::optional<FiniteParts> finite_from_cache(CacheArrays& arrays, std::size_t nodes) {
  FiniteParts parts;
  ElasticRegion& region = parts.region;
  std::vector<int> hold_begin;
  std::vector<double> positions;
  TakenArrays taken(arrays, kFinite);
  take_points(taken, region);
  taken.take("hold_begin", hold_begin);
  taken.take("hold_columns", parts.hold.pattern.columns);
  taken.take("hold", parts.hold.blocks);
  taken.take("volumes", parts.volumes);
  taken.take("positions", positions);
  taken.take_if_there("unloaded", parts.unloaded);
  taken.take_if_there("hold_loads", parts.hold_loads);
  region.positions = vectors(positions);
  parts.hold.width = 3;
  parts.hold.pattern.row_begin.assign(hold_begin.begin(), hold_begin.end());
  const auto all_below = [](const std::vector<int>& numbers, std::size_t end) {
    return std::ranges::all_of(numbers,
                               [&](int i) { return i >= 0 && static_cast<std::size_t>(i) < end; });
  };
  const auto ascends = [](const std::vector<std::size_t>& from, std::size_t rows, std::size_t end) {
    return from.size() == rows + 1 && from.front() == 0 && from.back() == end &&
           std::ranges::is_sorted(from);
  };
  const std::size_t points = region.weights.size();
  const SymmetricPattern& hold = parts.hold.pattern;
  if (!taken.whole() || region.positions.size() != points ||
      region.gradients.size() != region.point_nodes.size() ||
      !ascends(region.begin, points, region.point_nodes.size()) ||
      !all_below(region.point_nodes, region.nodes.size()) || !all_below(region.nodes, nodes) ||
      (!region.cell.empty() && region.cell.size() != points) ||
      (!region.modulus.empty() && region.modulus.size() != points) ||
      region.psi.size() != ElasticRegion::kTerms * region.cell.size() ||
      !ascends(hold.row_begin, nodes, hold.columns.size()) || !all_below(hold.columns, nodes) ||
      parts.hold.blocks.size() != 9 * hold.columns.size() || parts.volumes.size() != nodes ||
      (!parts.unloaded.empty() && parts.unloaded.size() != 3 * nodes) ||
      parts.hold_loads.size() % (9 * nodes) != 0)
    return std::nullopt;
  return parts;
}

std::size_t finite_bytes(std::size_t nodes, std::size_t factor_entries, bool fibres) {
  return nodes * (kBytesANode + (fibres ? kFibreBytesANode : 0)) + factor_entries * kBytesANumber;
}

std::size_t finite_bytes(std::size_t nodes, const LevelsCost& cost, bool fibres) {
  return finite_bytes(nodes, 2 * cost.coarse.factor_entries, fibres) + nodes * 2 * kLevelBytesANode;
}

}  // namespace viscera
