#include "engine/organ/cut_organ.h"

#include <algorithm>
#include <array>
#include <utility>

#include "engine/organ/dropped_pieces.h"
#include "engine/organ/finite_parts.h"
#include "engine/organ/material_field.h"
#include "engine/organ/organ_parts.h"
#include "engine/organ/severed_bricks.h"
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

/// A node in the void is dropped where it lies this far from the tissue, in spacings: beyond a flat
/// wall so far from it lies a hundredth of its field, for less of which no node has a twin
/// (true_neighbours.h).
constexpr double kFarInVoid = 1.15;
/// Nodes that carry nothing are dropped so often at most: without them, others may.
constexpr int kNodesDropped = 3;

/// Remnants that nothing carries are taken away so often at most; about a place of one so far
/// surely, and so far where nothing is carried either [voxels].
constexpr int kRounds = 6;
constexpr double kOfRemnant = 1.5, kAboutRemnant = 3.0;

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

bool same_own_nodes(const ShapeFunctions& a, const ShapeFunctions& b) {
  const auto own = [](const ShapeFunctions& fields) {
    return std::span(fields.cloud().positions).first(own_nodes(fields));
  };
  return std::ranges::equal(own(a), own(b));
}

/// Of each node that carries what is left of an organ the one that did `before`; `other_pieces`:
/// some of it was ever taken out. `left`: of the surface now.
std::vector<int> gone_on(const ShapeFunctions& before, const ShapeFunctions& now,
                         const SurfaceTree& left, bool other_pieces) {
  return other_pieces || !same_own_nodes(before, now)
             ? continued_beside_gone_pieces(before, now, left)
             : continued_nodes(before, now);
}

/// Of vertices that walls alone have.
std::vector<float> depths_below(const SurfaceTree& whole, const TriangleSurface& left,
                                const std::vector<int>& skin) {
  std::vector<char> in_skin(left.vertices.size(), 0);
  for (std::size_t t = 0; t < skin.size(); ++t)
    if (skin[t] >= 0)
      for (const int corner : left.triangles[t]) in_skin[static_cast<std::size_t>(corner)] = 1;
  std::vector<float> depths(left.vertices.size(), 0.0f);
  parallel_for_each_index(depths.size(), 64, [&](std::size_t v) {
    if (!in_skin[v]) depths[v] = static_cast<float>(whole.closest(left.vertices[v]).distance);
  });
  return depths;
}

/// Bricks of heat, of this voxel, that anything gone reaches. Beside them the organ is as it was
/// whole.
std::vector<BrickIndex> heated_bricks(const TissueShare& tissue, std::span<const Box> dropped,
                                      double voxel) {
  BrickMap seen;
  std::vector<BrickIndex> bricks;
  const Vec3 beside = Vec3::Constant(voxel + 2.0 * tissue.voxel());
  const auto add = [&](const Box& box) {
    for_bricks_in({box.min() - beside, box.max() + beside}, BrickGeometry::kEdge * voxel,
                  [&](const BrickIndex& index) {
                    const int fresh = static_cast<int>(bricks.size());
                    if (seen.find_or_add(index, fresh) == fresh) bricks.push_back(index);
                  });
  };
  for (const TissueShare::Voxel& lowest : tissue.bricks())
    add({tissue.middle(lowest),
         tissue.middle(lowest + TissueShare::Voxel::Constant(TissueShare::kEdge - 1))});
  for (const Box& box : dropped) add(box);
  return bricks;
}

std::vector<ShapedBrick> heated_shapes(const TissueShare& tissue, std::span<const Box> dropped,
                                       double voxel, const SurfaceTree& left) {
  if (voxel == 0.0) return {};
  const SignedDistance distance = [&](const Vec3& place) { return left.signed_distance(place); };
  std::vector<ShapedBrick> shapes;
  for (const BrickIndex& index : heated_bricks(tissue, dropped, voxel))
    shapes.push_back({index, nullptr});
  parallel_for_each_index(shapes.size(), 1, [&](std::size_t s) {
    shapes[s].geometry = make_geometry(shapes[s].index, voxel, distance);
  });
  return shapes;
}

bool any_loose(const FiniteParts& parts) {
  return std::ranges::any_of(parts.piece_of, [](int piece) { return piece >= 0; });
}

/// The body counts from where the whole one has no stress, and its weight acts as it did there. One
/// that what it lay among bore (hung_in_image) has none, but for the pieces that fall.
void take_weight(const CuttableOrgan& organ, const OrganModel& model, const SurfaceTree& tree,
                 double density, FiniteParts& parts) {
  const std::span<const double> unloaded = organ.whole->finite->body().unloaded();
  if (unloaded.empty() && (organ.gravity.isZero(0.0) || !any_loose(parts))) return;
  for (const int node : gone_on(*organ.fields, *model.fields, tree, false))
    for (std::size_t k = 0; k < 3; ++k)
      parts.unloaded.push_back(unloaded.empty() ? 0.0
                                                : unloaded[3 * static_cast<std::size_t>(node) + k]);
  for (std::size_t node = 0; node < parts.volumes.size(); ++node) {
    Vec3 acts = organ.demand.weight;
    if (unloaded.empty()) acts = parts.piece_of[node] >= 0 ? organ.gravity : Vec3(Vec3::Zero());
    for (const double along : acts) parts.weight.push_back(density * parts.volumes[node] * along);
  }
}

/// `tree`: of its surface.
Result<void> prepare(const CuttableOrgan& organ, const SurfaceTree& tree, OrganModel& model) {
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
  take_weight(organ, model, tree, options.density, *parts);
  model.compliance = columns_to_come(model, (*solver)->factor());
  model.compliance.on_demand->end_preparation();
  if (auto made = make_finite(model, *parts, options, !organ.demand.burnt.empty(), nullptr); !made)
    return made;
  model.step_compliance.on_demand->end_preparation();
  model.figures = (*solver)->figures();
  return {};
}

/// What that leaves, maybe with parts that can't be prepared.
struct Left {
  std::shared_ptr<OrganModel> model;
  std::shared_ptr<const SurfaceTree> tree;  ///< of its surface
  std::vector<int> skin;                    ///< as CarvedSurface::skin
  Dropped dropped;
  Result<void> prepared;
};

Result<Left> prepare_left(const CuttableOrgan& organ, const TissueShare& tissue,
                          std::span<const Vec3> removed) {
  const OrganModel& whole = *organ.whole;
  const double finest = organ.organ.resolution.finest;
  auto carved = carve(whole.surface, plain_void_surface(tissue, finest));
  if (!carved) return std::unexpected(carved.error());
  Left left;
  left.dropped = drop_pieces(finest * finest * finest, removed, *carved);
  if (carved->surface.triangles.empty()) return failure("nothing is left of it");
  if (left.dropped.found < removed.size())
    return failure("a piece that was to be taken out isn't whole and apart any more");
  left.skin = std::move(carved->skin);
  left.tree = std::make_shared<const SurfaceTree>(carved->surface);
  // Nodes in the void carry what is left beside them. Those to which air leaves nothing make the
  // equations singular; which these are the fields tell.
  PointCloud cloud = nodes_about(*left.tree, whole.cloud, kFarInVoid);
  for (int round = 0;; ++round) {
    left.model = std::make_shared<OrganModel>();
    set_surface(*left.model, carved->surface);
    left.model->material = whole.material;
    left.model->cloud = std::move(cloud);
    left.model->key = whole.key;
    left.prepared = prepare(organ, *left.tree, *left.model);
    if (left.prepared || round == kNodesDropped || !left.model->fields) break;
    cloud = nodes_that_carry(left.model->surface, left.model->cloud, *left.model->fields);
    if (cloud.size() == left.model->cloud.size()) break;
  }
  return left;
}

/// Which of these places nodes carry.
std::vector<char> carried(const std::vector<Vec3>& places, const ShapeFunctions& fields) {
  std::vector<char> covered(places.size());
  parallel_for_each_index(places.size(), 64, [&](std::size_t p) {
    thread_local ShapeValues values;
    covered[p] = fields.evaluate(places[p], false, values);
  });
  return covered;
}

/// Places of a surface, its vertices and some of each triangle, that no nodes carry.
std::vector<Vec3> bare_places(const TriangleSurface& surface, const ShapeFunctions& fields) {
  std::vector<Vec3> places = surface.vertices;
  for (const std::array<int, 3>& t : surface.triangles) {
    std::array<Vec3, 3> corners;
    for (std::size_t c = 0; c < 3; ++c)
      corners[c] = surface.vertices[static_cast<std::size_t>(t[c])];
    const Vec3 middle = (corners[0] + corners[1] + corners[2]) / 3.0;
    places.push_back(middle);
    for (std::size_t c = 0; c < 3; ++c) {
      places.push_back(0.5 * (corners[c] + corners[(c + 1) % 3]));
      places.push_back(0.5 * (corners[c] + middle));
    }
  }
  const std::vector<char> covered = carried(places, fields);
  std::vector<Vec3> bare;
  for (std::size_t p = 0; p < places.size(); ++p)
    if (!covered[p]) bare.push_back(places[p]);
  return bare;
}

/// Takes away about places of the surface that no nodes carry, and, farther about them, what none
/// do either; false: there are none.
bool take_remnants(const OrganModel& model, TissueShare& tissue) {
  using Voxel = TissueShare::Voxel;
  if (!model.fields) return false;
  // Voxels about them, each once: places lie close together, and what carries a voxel is costly to
  // ask.
  const double surely = kOfRemnant * tissue.voxel(), radius = kAboutRemnant * tissue.voxel();
  std::vector<Voxel> voxels;
  std::vector<char> goes;
  BrickMap numbers;
  for (const Vec3& place : bare_places(model.surface, *model.fields)) {
    const Vec3 reach = Vec3::Constant(radius);
    const Voxel low = tissue.voxel_of(place - reach), high = tissue.voxel_of(place + reach);
    for (int z = low.z(); z <= high.z(); ++z)
      for (int y = low.y(); y <= high.y(); ++y)
        for (int x = low.x(); x <= high.x(); ++x) {
          const Voxel voxel(x, y, z);
          const double away = (tissue.middle(voxel) - place).norm();
          if (!(away < radius) || !(tissue.share(voxel) > 0.0)) continue;
          const int fresh = static_cast<int>(voxels.size());
          const int number = numbers.find_or_add(voxel, fresh);
          if (number == fresh) {
            voxels.push_back(voxel);
            goes.push_back(0);
          }
          if (away < surely) goes[static_cast<std::size_t>(number)] = 1;
        }
  }
  std::vector<Vec3> asked;
  for (std::size_t v = 0; v < voxels.size(); ++v)
    if (!goes[v]) asked.push_back(tissue.middle(voxels[v]));
  const std::vector<char> covered = carried(asked, *model.fields);
  bool any = false;
  for (std::size_t v = 0, a = 0; v < voxels.size(); ++v)
    if (goes[v] || !covered[a++]) any |= tissue.limit(voxels[v], 0.0) > 0.0;
  return any;
}

}  // namespace

std::shared_ptr<const CuttableOrgan> make_cuttable(std::shared_ptr<const OrganModel> whole,
                                                   OrganDescription organ, Tissue tissue,
                                                   BodyDemand demand, const Vec3& gravity,
                                                   double heat_voxel,
                                                   std::filesystem::path assets) {
  organ.response = Response::kFinite;
  auto fields = std::make_shared<const ShapeFunctions>(
      find_formulation(organ.formulation)->fields(whole->surface, whole->cloud));
  auto skin = std::make_shared<const SurfaceTree>(whole->surface);
  return std::make_shared<const CuttableOrgan>(
      CuttableOrgan{std::move(whole), std::move(fields), std::move(skin), std::move(organ),
                    std::move(tissue), std::move(demand), gravity, heat_voxel, std::move(assets)});
}

Result<CutOrgan> cut_organ(const CuttableOrgan& organ, const TissueShare& tissue,
                           std::span<const Vec3> removed, const OrganModel& before,
                           const ShapeFunctions& fields_before) {
  const Stopwatch watch;
  const OrganModel& whole = *organ.whole;
  CutOrgan cut{.tissue = tissue};
  Left left;
  double asked_left = 0.0;
  for (int round = 0;; ++round) {
    auto tried = prepare_left(organ, cut.tissue, removed);
    if (!tried) return std::unexpected(tried.error());
    left = *std::move(tried);
    if (round == 0)
      asked_left = volume(left.model->surface) + left.dropped.crumbs + left.dropped.removed;
    if (left.prepared) break;
    if (round == kRounds || !take_remnants(*left.model, cut.tissue))
      return std::unexpected(left.prepared.error());
  }
  OrganModel& model = *left.model;
  cut.crumbs = left.dropped.crumbs;
  cut.removed = left.dropped.removed;
  cut.remnants = asked_left - volume(model.surface) - cut.crumbs - cut.removed;
  cut.fields = std::move(model.fields);
  cut.pieces = pieces_of_vertices(model.surface, closed_pieces(model.surface));
  cut.depths = depths_below(*organ.skin, model.surface, left.skin);
  cut.tree = std::move(left.tree);
  cut.continuation = {gone_on(fields_before, *cut.fields, *cut.tree, !removed.empty()),
                      nearest_of(model.energy_points, before.energy_points)};
  cut.heated = heated_shapes(cut.tissue, left.dropped.boxes, organ.heat_voxel, *cut.tree);
  cut.loose = loose_of_pieces(model, *cut.fields, *cut.tree, cut.pieces);
  if (organ.heat_voxel > 0.0)
    take_blood(model.surface, *cut.tree, cut.pieces, cut.loose, organ.heat_voxel, cut.heated);
  model.prepare_s = cut.seconds = watch.seconds();
  cut.model = std::move(left.model);
  return cut;
}

}  // namespace viscera
