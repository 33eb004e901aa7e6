#include "engine/features/parting/remove_pieces.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "engine/features/contact/contact.h"
#include "engine/features/parting/parting_flags.h"
#include "kernels/finite/finite_solver.h"

namespace viscera {
namespace {

/// A place of a piece lies so deep in it [m].
constexpr double kSurelyWithin = 0.1e-3;
/// Turns about each of a piece's axes that are tried for how it fits, over a quarter.
constexpr int kTurnsTried = 18;

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

/// A place deep in what is left of it, so that heat and blades that take some of its surface leave
/// that place.
std::optional<Vec3> place_within(const TriangleSurface& piece, std::span<const int> nodes,
                                 const PointCloud& cloud, const TissueShare& left) {
  const SurfaceTree tree(piece);
  std::optional<Vec3> deepest;
  double least = -kSurelyWithin;
  const auto look_at = [&](const Vec3& place) {
    const double distance = tree.signed_distance(place);
    if (!(distance < least) || left.share(place) < 0.5) return;
    least = distance;
    deepest = place;
  };
  look_at(bounds(piece).center());
  for (const int node : nodes) look_at(cloud.positions[static_cast<std::size_t>(node)]);
  // A thin peel may have none of these within it.
  for (std::size_t t = 0; t < piece.triangles.size() && !deepest; ++t) {
    Vec3 middle = Vec3::Zero();
    for (const int corner : piece.triangles[t])
      middle += piece.vertices[static_cast<std::size_t>(corner)] / 3.0;
    look_at(middle - 2.0 * left.voxel() * area_vector(piece, static_cast<int>(t)).normalized());
  }
  return deepest;
}

bool one_of_these(const auto& those, const auto& one) {
  return std::ranges::find(those, one) != those.end();
}

/// Takes out a loose piece that is no wider than this [m]; true: it is wider.
bool bring_out_piece(const World& world, Entity organ, int piece, double widest, OrganCut& cut) {
  const TriangleSurface surface = surface_of_piece(world, organ, piece);
  if (width_through_hole(surface) > widest) return true;
  const OrganLeft& left = *world.find<OrganLeft>(organ);
  const LoosePieces& pieces = world.find<OrganBody>(organ)->model->finite->loose();
  const int loose = loose_number(left, piece);
  const std::optional<Vec3> within = place_within(
      surface, pieces.pieces()[static_cast<std::size_t>(loose)], left.fields->cloud(), cut.gone);
  if (!within) return false;
  cut.removed.push_back({*within, pieces.mass(loose)});
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
  const double widest = (in_bag ? kSqueezedInBag : 1.0) * bore_of(tool);
  bool stuck = false;
  for (const int piece : held)
    if (!one_of_these(leaving, piece) && loose_number(*world.find<OrganLeft>(organ), piece) >= 0)
      stuck |= bring_out_piece(world, organ, piece, widest, cut);
  return stuck;
}

bool brings_to_trocar(const World& world, Entity organ, Entity instrument) {
  const InstrumentContact& grip = *world.find<InstrumentContact>(instrument);
  if (!grip.grasp || !(grip.grasp->organ == organ)) return false;
  const Vec3& trocar = world.find<InstrumentBody>(instrument)->description.trocar;
  return (world.find<InstrumentState>(instrument)->tip - trocar).norm() <= kAtTrocar;
}

}  // namespace

int loose_number(const OrganLeft& left, int piece) {
  return left.loose.empty() ? -1 : left.loose[static_cast<std::size_t>(piece)];
}

double width_through_hole(const TriangleSurface& piece) {
  // Moments of its surface, however densely its vertices lie.
  Vec3 middle = Vec3::Zero();
  Mat3 spread = Mat3::Zero();
  double area = 0.0;
  const auto corners_of = [&](std::size_t t) {
    std::array<Vec3, 3> corners;
    for (std::size_t c = 0; c < 3; ++c)
      corners[c] = piece.vertices[static_cast<std::size_t>(piece.triangles[t][c])];
    return corners;
  };
  for (std::size_t t = 0; t < piece.triangles.size(); ++t) {
    const double own = area_vector(piece, static_cast<int>(t)).norm();
    for (const Vec3& corner : corners_of(t)) middle += own / 3.0 * corner;
    area += own;
  }
  middle /= area;
  for (std::size_t t = 0; t < piece.triangles.size(); ++t) {
    const double own = area_vector(piece, static_cast<int>(t)).norm() / 12.0;
    Vec3 sum = Vec3::Zero();
    for (const Vec3& corner : corners_of(t)) {
      const Vec3 from = corner - middle;
      sum += from;
      spread += own * from * from.transpose();
    }
    spread += own * sum * sum.transpose();
  }
  const Mat3 axes = Eigen::SelfAdjointEigenSolver<Mat3>(spread).eigenvectors();
  double least = std::numeric_limits<double>::infinity();
  for (Eigen::Index way = 0; way < 3; ++way) {
    const Vec3 first = axes.col((way + 1) % 3), second = axes.col((way + 2) % 3);
    for (int turn = 0; turn < kTurnsTried; ++turn) {
      const double angle = 0.5 * std::numbers::pi * turn / kTurnsTried;
      const Vec3 one = std::cos(angle) * first + std::sin(angle) * second;
      const Vec3 other = std::cos(angle) * second - std::sin(angle) * first;
      Eigen::AlignedBox2d across;
      for (const Vec3& vertex : piece.vertices)
        across.extend(Eigen::Vector2d(one.dot(vertex), other.dot(vertex)));
      least = std::min(least, across.sizes().maxCoeff());
    }
  }
  return least;
}

void withdraw_dropped(World& world, Entity organ) {
  OrganCut& cut = *world.find<OrganCut>(organ);
  const std::vector<int> leaving = leaving_pieces(world, organ, cut.removed.size());
  if (leaving.empty()) return;
  std::vector<int> held;
  for (const InstrumentContact& grip : world.all<InstrumentContact>())
    if (grip.grasp && grip.grasp->organ == organ)
      for (const int piece : pieces_in(world, *grip.grasp)) held.push_back(piece);
  std::size_t kept = cut.removed_used;
  for (std::size_t p = 0; p < leaving.size(); ++p)
    if (one_of_these(held, leaving[p])) cut.removed[kept++] = cut.removed[cut.removed_used + p];
  cut.removed.resize(kept);
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

void let_go(World& world, Entity organ, const std::vector<int>& pieces) {
  const OrganLeft& left = *world.find<OrganLeft>(organ);
  const TriangleSurface& surface = world.find<OrganBody>(organ)->model->surface;
  for (const Entity instrument : world.model().instruments()) {
    const std::optional<Grasp>& grasp = world.find<InstrumentContact>(instrument)->grasp;
    if (!grasp || !(grasp->organ == organ)) continue;
    keep_held(world, instrument, [&](std::size_t cell) {
      return !one_of_these(pieces, piece_of(left.pieces, surface, grasp->points[cell].triangle));
    });
  }
}

Result<void> check_removed(const OrganCut& cut, const Box& bounds) {
  if (cut.removed_used > cut.removed_asked || cut.removed_asked > cut.removed.size())
    return failure(
        fmt::format("cut organs: found a body without {} pieces and one to come without {}, "
                    "expected at most the {} that were taken out",
                    cut.removed_used, cut.removed_asked, cut.removed.size()));
  for (const RemovedPiece& piece : cut.removed)
    if (!piece.within.allFinite() || !bounds.contains(piece.within))
      return failure(
          "cut organs: found a piece that was taken out from outside of its organ, expected a "
          "place in it");
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
