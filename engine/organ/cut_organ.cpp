#include "engine/organ/cut_organ.h"

#include <algorithm>
#include <array>
#include <utility>

#include "engine/organ/finite_parts.h"
#include "engine/organ/material_field.h"
#include "engine/organ/organ_parts.h"
#include "kernels/base/parallel.h"
#include "kernels/base/stopwatch.h"
#include "kernels/formulations/formulations.h"
#include "kernels/paff/continued_nodes.h"
#include "kernels/parting/carve.h"
#include "kernels/parting/void_surface.h"
#include "kernels/points/closed_pieces.h"
#include "kernels/points/kd_tree.h"
#include "kernels/points/surface_tree.h"

namespace viscera {
namespace {

/// Of a step, at the most where it comes to rest: what hangs by little that a cut has left moves
/// far under little force, and with two iterations it flew apart. A step ends as soon as more would
/// gain nothing.
constexpr int kIterations = 12;

/// Of each of these places the nearest of those.
std::vector<int> nearest_of(const std::vector<Vec3>& places, const std::vector<Vec3>& those) {
  const KdTree tree(those);
  std::vector<int> nearest(places.size());
  parallel_for_each_index(places.size(), 256, [&](std::size_t i) {
    thread_local std::vector<KdTree::Found> found;
    tree.nearest(places[i], 1, -1, found);
    nearest[i] = found.front().index;
  });
  return nearest;
}

/// Takes away pieces that are too small for a node to stand for them; how much [m3].
double drop_crumbs(double least, CarvedSurface& left) {
  const std::vector<TriangleSurface> pieces = closed_pieces(left.surface);
  if (pieces.size() < 2) return 0.0;
  double dropped = 0.0;
  std::vector<char> kept(left.surface.vertices.size(), 0);
  for (const TriangleSurface& piece : pieces) {
    const double size = volume(piece);
    if (size < least) {
      dropped += size;
      continue;
    }
    for (const std::array<int, 3>& triangle : piece.triangles)
      for (const int corner : triangle) kept[static_cast<std::size_t>(corner)] = 1;
  }
  CarvedSurface whole = std::exchange(left, {});
  left.surface.vertices = std::move(whole.surface.vertices);
  for (std::size_t t = 0; t < whole.skin.size(); ++t) {
    if (!kept[static_cast<std::size_t>(whole.surface.triangles[t][0])]) continue;
    left.surface.triangles.push_back(whole.surface.triangles[t]);
    left.skin.push_back(whole.skin[t]);
  }
  left.surface = with_used_vertices(left.surface);
  return dropped;
}

/// As CutOrgan::pieces.
std::vector<int> pieces_of_vertices(const TriangleSurface& surface) {
  const std::vector<TriangleSurface> pieces = closed_pieces(surface);
  if (pieces.size() < 2) return {};
  std::vector<int> numbers(surface.vertices.size(), 0);
  for (std::size_t p = 0; p < pieces.size(); ++p)
    for (const std::array<int, 3>& triangle : pieces[p].triangles)
      for (const int corner : triangle)
        numbers[static_cast<std::size_t>(corner)] = static_cast<int>(p);
  return numbers;
}

/// Of vertices that walls alone have.
std::vector<float> depths_below(const TriangleSurface& whole, const TriangleSurface& left,
                                const std::vector<int>& skin) {
  std::vector<char> in_skin(left.vertices.size(), 0);
  for (std::size_t t = 0; t < skin.size(); ++t)
    if (skin[t] >= 0)
      for (const int corner : left.triangles[t]) in_skin[static_cast<std::size_t>(corner)] = 1;
  const SurfaceTree tree(whole);
  std::vector<float> depths(left.vertices.size(), 0.0f);
  parallel_for_each_index(depths.size(), 64, [&](std::size_t v) {
    if (!in_skin[v]) depths[v] = static_cast<float>(tree.closest(left.vertices[v]).distance);
  });
  return depths;
}

bool any_loose(const FiniteParts& parts) {
  return std::ranges::any_of(parts.piece_of, [](int piece) { return piece >= 0; });
}

/// The body counts from where the whole one has no stress, and its weight acts as it did there. One
/// that what it lay among bore (hung_in_image) has none, but for the pieces that fall.
void take_weight(const CuttableOrgan& organ, const OrganModel& model, double density,
                 FiniteParts& parts) {
  const std::span<const double> unloaded = organ.whole->finite->body().unloaded();
  if (unloaded.empty() && (organ.gravity.isZero(0.0) || !any_loose(parts))) return;
  for (const int node : continued_nodes(*organ.fields, *model.fields))
    for (std::size_t k = 0; k < 3; ++k)
      parts.unloaded.push_back(unloaded.empty() ? 0.0
                                                : unloaded[3 * static_cast<std::size_t>(node) + k]);
  for (std::size_t node = 0; node < parts.volumes.size(); ++node) {
    Vec3 acts = organ.demand.weight;
    if (unloaded.empty()) acts = parts.piece_of[node] >= 0 ? organ.gravity : Vec3(Vec3::Zero());
    for (const double along : acts) parts.weight.push_back(density * parts.volumes[node] * along);
  }
}

Result<void> prepare_left(const CuttableOrgan& organ, OrganModel& model) {
  if (auto placed = add_places(model, organ.organ, organ.demand); !placed) return placed;
  // Layers under the surface are those that the whole one has.
  auto field = MaterialField::make(organ.organ, organ.tissue, organ.whole->surface, organ.assets);
  if (!field) return std::unexpected(field.error());
  ElasticProblem problem = elastic_problem(model, organ.organ, organ.tissue, field->get());
  if (problem.points_alone) return failure("it has too many nodes to be cut");
  FiniteOptions options = finite_options(organ.organ, organ.tissue);
  if (options.dynamic) problem.foundation = inertia_over_step(options);
  const Formulation* formulation = find_formulation(organ.organ.formulation);
  auto solver = formulation->prepare(problem, no_progress());
  if (!solver) return std::unexpected(solver.error());
  auto parts = finite_parts(model, organ.organ, organ.demand, **solver, field->get());
  if (!parts) return std::unexpected(parts.error());
  options.iterations = std::max(options.iterations, kIterations);
  options.iterations_released = std::max(options.iterations_released, kIterations);
  if (any_loose(*parts)) options.decrement = std::min(options.decrement, kFreeDecrement);
  take_weight(organ, model, options.density, *parts);
  model.compliance = columns_to_come(model, (*solver)->factor());
  model.compliance.on_demand->end_preparation();
  if (auto made = make_finite(model, *parts, options, !organ.demand.burnt.empty(), nullptr); !made)
    return made;
  model.step_compliance.on_demand->end_preparation();
  model.figures = (*solver)->figures();
  return {};
}

}  // namespace

std::shared_ptr<const CuttableOrgan> make_cuttable(std::shared_ptr<const OrganModel> whole,
                                                   OrganDescription organ, Tissue tissue,
                                                   BodyDemand demand, const Vec3& gravity,
                                                   std::filesystem::path assets) {
  organ.response = Response::kFinite;
  auto fields = std::make_shared<const ShapeFunctions>(
      find_formulation(organ.formulation)->fields(whole->surface, whole->cloud));
  return std::make_shared<const CuttableOrgan>(
      CuttableOrgan{std::move(whole), std::move(fields), std::move(organ), std::move(tissue),
                    std::move(demand), gravity, std::move(assets)});
}

int piece_of(std::span<const int> pieces, const TriangleSurface& surface, int triangle) {
  if (pieces.empty()) return 0;
  const int corner = surface.triangles[static_cast<std::size_t>(triangle)][0];
  return pieces[static_cast<std::size_t>(corner)];
}

Result<CutOrgan> cut_organ(const CuttableOrgan& organ, const TissueShare& tissue,
                           const OrganModel& before, const ShapeFunctions& fields_before) {
  const Stopwatch watch;
  const OrganModel& whole = *organ.whole;
  const TriangleSurface gone = plain_void_surface(tissue, organ.organ.resolution.finest);
  auto left = carve(whole.surface, gone);
  if (!left) return std::unexpected(left.error());
  const double finest = organ.organ.resolution.finest;
  const double crumbs = drop_crumbs(finest * finest * finest, *left);
  if (left->surface.triangles.empty()) return failure("nothing is left of it");
  auto model = std::make_shared<OrganModel>();
  set_surface(*model, std::move(left->surface));
  model->material = whole.material;
  model->cloud = whole.cloud;
  model->key = whole.key;
  if (auto prepared = prepare_left(organ, *model); !prepared)
    return std::unexpected(prepared.error());
  CutOrgan cut;
  cut.crumbs = crumbs;
  cut.fields = std::move(model->fields);
  cut.pieces = pieces_of_vertices(model->surface);
  cut.depths = depths_below(whole.surface, model->surface, left->skin);
  cut.continuation = {continued_nodes(fields_before, *cut.fields),
                      nearest_of(model->energy_points, before.energy_points)};
  model->prepare_s = cut.seconds = watch.seconds();
  cut.model = std::move(model);
  return cut;
}

}  // namespace viscera
