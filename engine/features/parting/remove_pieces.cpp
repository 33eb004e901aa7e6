#include "engine/features/parting/remove_pieces.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "engine/features/parting/parting_flags.h"
#include "kernels/finite/finite_solver.h"

namespace viscera {
namespace {

/// Of a cut organ the pieces, by OrganLeft::pieces, on whose surfaces a grasp is; ascending.
std::vector<int> pieces_in(const World& world, const Grasp& grasp) {
  const OrganLeft* left = world.find<OrganLeft>(grasp.organ);
  std::vector<int> pieces;
  if (!left || left->pieces.empty()) return pieces;
  const TriangleSurface& surface = world.find<OrganBody>(grasp.organ)->model->surface;
  for (const SurfacePoint& point : grasp.points)
    pieces.push_back(piece_of(left->pieces, surface, point.triangle));
  std::ranges::sort(pieces);
  const auto same = std::ranges::unique(pieces);
  pieces.erase(same.begin(), same.end());
  return pieces;
}

/// Its closed surface at rest.
TriangleSurface surface_of_piece(const World& world, Entity organ, int piece) {
  const OrganLeft& left = *world.find<OrganLeft>(organ);
  const TriangleSurface& surface = world.find<OrganBody>(organ)->model->surface;
  TriangleSurface alone{surface.vertices, {}};
  for (std::size_t t = 0; t < surface.triangles.size(); ++t)
    if (piece_of(left.pieces, surface, static_cast<int>(t)) == piece)
      alone.triangles.push_back(surface.triangles[t]);
  return with_used_vertices(alone);
}

/// A place deep in it, so that heat and blades that took some of its surface leave that place.
std::optional<Vec3> place_within(const TriangleSurface& piece, std::span<const int> nodes,
                                 const PointCloud& cloud) {
  const SurfaceTree tree(piece);
  std::optional<Vec3> deepest;
  double least = 0.0;
  const auto look_at = [&](const Vec3& place) {
    const double distance = tree.signed_distance(place);
    if (!(distance < least)) return;
    least = distance;
    deepest = place;
  };
  look_at(bounds(piece).center());
  for (const int node : nodes) look_at(cloud.positions[static_cast<std::size_t>(node)]);
  return deepest;
}

bool one_of_these(const auto& those, const auto& one) {
  return std::ranges::find(those, one) != those.end();
}

/// A place of the grasp that is on this piece, which it has; at rest [m].
const Vec3& place_on(const World& world, const Grasp& grasp, int piece) {
  const OrganLeft& left = *world.find<OrganLeft>(grasp.organ);
  const TriangleSurface& surface = world.find<OrganBody>(grasp.organ)->model->surface;
  std::size_t k = 0;
  while (piece_of(left.pieces, surface, grasp.points[k].triangle) != piece) ++k;
  return grasp.cells[k].position;
}

/// Takes out a piece that is no wider than this [m]; true: it is wider.
bool bring_out_piece(const World& world, Entity organ, const std::pair<int, int>& piece_and_loose,
                     double widest, OrganCut& cut) {
  const auto& [piece, loose] = piece_and_loose;
  const TriangleSurface surface = surface_of_piece(world, organ, piece);
  if (width_through_hole(surface) > widest) return true;
  const OrganModel& model = *world.find<OrganBody>(organ)->model;
  const LoosePieces& pieces = model.finite->loose();
  const std::optional<Vec3> within =
      place_within(surface, pieces.pieces()[static_cast<std::size_t>(loose)],
                   world.find<OrganLeft>(organ)->fields->cloud());
  if (!within) return false;
  cut.removed.push_back({*within, volume(surface), pieces.mass(loose)});
  cut.changed = true;
  return false;
}

/// A grasper or a bag with something of this organ at its trocar; true: it has a piece that doesn't
/// fit.
bool bring_out(World& world, Entity organ, Entity instrument, OrganCut& cut) {
  const Grasp& grasp = *world.find<InstrumentContact>(instrument)->grasp;
  const InstrumentDescription& tool = world.find<InstrumentBody>(instrument)->description;
  const bool in_bag = tool.kind == InstrumentKind::kBag;
  const std::vector<int> held = pieces_in(world, grasp);
  if (held.empty() || (held.size() > 1 && !in_bag)) return false;
  const std::vector<int> leaving = leaving_pieces(world, organ, cut.removed.size());
  bool stuck = false;
  for (const int piece : held) {
    if (one_of_these(leaving, piece)) continue;
    const int loose = loose_piece_at(world, organ, place_on(world, grasp, piece));
    if (loose < 0) continue;
    const double widest = (in_bag ? kSqueezedInBag : 1.0) * bore_of(tool);
    stuck |= bring_out_piece(world, organ, {piece, loose}, widest, cut);
  }
  return stuck;
}

bool brings_to_trocar(const World& world, Entity organ, Entity instrument) {
  const InstrumentContact& grip = *world.find<InstrumentContact>(instrument);
  if (!grip.grasp || !(grip.grasp->organ == organ)) return false;
  const Vec3& trocar = world.find<InstrumentBody>(instrument)->description.trocar;
  return (world.find<InstrumentState>(instrument)->tip - trocar).norm() <= kAtTrocar;
}

}  // namespace

int loose_piece_at(const World& world, Entity organ, const Vec3& place) {
  ShapeValues values;
  const ShapeFunctions& fields = *world.find<OrganLeft>(organ)->fields;
  if (!fields.evaluate(place, false, values) || values.nodes.empty()) return -1;
  const auto size = [](double value) { return std::abs(value); };
  const auto most = std::ranges::max_element(values.values, {}, size) - values.values.begin();
  return world.find<OrganBody>(organ)->model->finite->loose().piece_of(
      static_cast<std::size_t>(values.nodes[static_cast<std::size_t>(most)]));
}

double width_through_hole(const TriangleSurface& piece) {
  const auto count = static_cast<double>(piece.vertices.size());
  Vec3 middle = Vec3::Zero();
  for (const Vec3& vertex : piece.vertices) middle += vertex / count;
  Mat3 spread = Mat3::Zero();
  for (const Vec3& vertex : piece.vertices)
    spread += (vertex - middle) * (vertex - middle).transpose() / count;
  const Eigen::SelfAdjointEigenSolver<Mat3> axes(spread);
  Box extents;
  for (const Vec3& vertex : piece.vertices)
    extents.extend(axes.eigenvectors().transpose() * vertex);
  Vec3 sizes = extents.sizes();
  std::ranges::sort(sizes);
  return sizes[1];
}

std::vector<Vec3> places_removed(const OrganCut& cut, std::uint64_t count) {
  std::vector<Vec3> places;
  for (std::size_t p = 0; p < count; ++p) places.push_back(cut.removed[p].within);
  return places;
}

std::vector<int> leaving_pieces(const World& world, Entity organ, std::uint64_t count) {
  const OrganCut& cut = *world.find<OrganCut>(organ);
  const OrganLeft& left = *world.find<OrganLeft>(organ);
  std::vector<int> leaving;
  if (left.pieces.empty()) return leaving;
  const TriangleSurface& surface = world.find<OrganBody>(organ)->model->surface;
  for (std::size_t p = cut.removed_used; p < count; ++p)
    leaving.push_back(
        piece_of(left.pieces, surface, left.tree->closest(cut.removed[p].within).point.triangle));
  return leaving;
}

std::vector<Entity> jaws_on(const World& world, Entity organ, const std::vector<int>& pieces) {
  std::vector<Entity> jaws;
  for (const Entity instrument : world.model().instruments()) {
    const InstrumentContact& grip = *world.find<InstrumentContact>(instrument);
    if (!grip.grasp || !(grip.grasp->organ == organ)) continue;
    const std::vector<int> held = pieces_in(world, *grip.grasp);
    if (!held.empty() &&
        std::ranges::all_of(held, [&](int one) { return one_of_these(pieces, one); }))
      jaws.push_back(instrument);
  }
  return jaws;
}

Result<void> check_removed(const OrganCut& cut) {
  if (cut.removed_used > cut.removed_asked || cut.removed_asked > cut.removed.size())
    return failure(
        fmt::format("cut organs: found a body without {} pieces and one to come without {}, "
                    "expected at most the {} that were taken out",
                    cut.removed_used, cut.removed_asked, cut.removed.size()));
  for (const RemovedPiece& piece : cut.removed)
    if (!piece.within.allFinite())
      return failure("cut organs: found a piece that was taken out from nowhere, expected a place");
  return {};
}

void remove_pieces(World& world, const FrameContext& context) {
  Pool<OrganCut>& cuts = world.all<OrganCut>();
  for (std::size_t c = 0; c < cuts.size(); ++c) {
    const Entity organ = cuts.owner(c);
    if (world.find<OrganState>(organ)->frozen) continue;
    const std::vector<Entity> told = std::exchange(cuts[c].stuck, {});
    for (const Entity instrument : world.model().instruments()) {
      if (!brings_to_trocar(world, organ, instrument)) continue;
      if (!bring_out(world, organ, instrument, cuts[c])) continue;
      cuts[c].stuck.push_back(instrument);
      if (!one_of_these(told, instrument)) context.report->raise(kPieceStuck);
    }
  }
}

}  // namespace viscera
