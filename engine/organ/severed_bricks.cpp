#include "engine/organ/severed_bricks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "kernels/base/parallel.h"
#include "kernels/finite/finite_solver.h"
#include "kernels/points/brick_map.h"
#include "kernels/points/closed_pieces.h"

namespace viscera {
namespace {

constexpr int kBrickEdgeVoxels = BrickGeometry::kEdge;
/// From a cube's middle to its corners, over its edge; a little more, against rounding.
constexpr double kHalfDiagonal = 0.501 * std::numbers::sqrt3;

/// The walls of what is cut off and of what is held.
class SeveredWalls {
 public:
  SeveredWalls(const TriangleSurface& surface, std::span<const int> pieces,
               std::span<const int> loose)
      : boxes_(loose.size()) {
    TriangleSurface off{surface.vertices, {}}, held{surface.vertices, {}};
    for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
      const std::array<int, 3>& triangle = surface.triangles[t];
      const auto piece = static_cast<std::size_t>(piece_of(pieces, surface, static_cast<int>(t)));
      const bool severed = loose[piece] >= 0;
      (severed ? off : held).triangles.push_back(triangle);
      if (!severed) continue;
      for (const int corner : triangle)
        boxes_[piece].extend(surface.vertices[static_cast<std::size_t>(corner)]);
    }
    off_.emplace(with_used_vertices(off));
    if (!held.empty()) held_.emplace(with_used_vertices(held));
  }

  /// About each piece; empty for those that are held.
  const std::vector<Box>& boxes() const { return boxes_; }
  /// Whether a cube lies beside all that is cut off.
  bool beside(const Vec3& middle, double edge) const {
    return off_->signed_distance(middle) > kHalfDiagonal * edge;
  }
  /// Of each voxel of a brick, 1 where what is held is nearer, else 0.                     (512)
  std::vector<float> perfused(const BrickIndex& brick, double voxel) const {
    std::vector<float> values(BrickField::kVoxels);
    fill(brick * kBrickEdgeVoxels, voxel, {0, 0, 0}, kBrickEdgeVoxels, values);
    return values;
  }

 private:
  /// Of a block of voxels. In tissue the nearest wall is its own piece's. So all of a block is of
  /// one piece where no wall reaches it, or where one kind of walls is nearer than the other by
  /// more than what the two distances may change by on the way to a corner.
  void fill(const BrickIndex& first, double voxel, const BrickIndex& at, int edge,
            std::vector<float>& values) const {
    const Vec3 middle = (first + at).cast<double>() * voxel + Vec3::Constant(0.5 * edge * voxel);
    const double reach = kHalfDiagonal * edge * voxel;
    const double off = off_->closest(middle).distance;
    const double held =
        held_ ? held_->closest(middle).distance : std::numeric_limits<double>::infinity();
    if (edge > 1 && std::min(off, held) <= reach && std::abs(held - off) <= 2.0 * reach) {
      const int half = edge / 2;
      for (int child = 0; child < 8; ++child)
        fill(first, voxel, at + half * BrickIndex(child & 1, child >> 1 & 1, child >> 2), half,
             values);
      return;
    }
    const float value = held < off ? 1.0f : 0.0f;
    for (int z = at.z(); z < at.z() + edge; ++z)
      for (int y = at.y(); y < at.y() + edge; ++y)
        for (int x = at.x(); x < at.x() + edge; ++x)
          values[static_cast<std::size_t>(x + kBrickEdgeVoxels * (y + kBrickEdgeVoxels * z))] =
              value;
  }

  std::vector<Box> boxes_;
  std::optional<SurfaceTree> off_, held_;  // no `held_`: all is cut off
};

bool all_are(const std::vector<float>& values, float value) {
  return std::ranges::all_of(values, [value](float one) { return one == value; });
}

}  // namespace

std::vector<int> loose_of_pieces(const OrganModel& model, const ShapeFunctions& fields,
                                 const SurfaceTree& tree, std::span<const int> pieces) {
  if (pieces.empty() || !model.finite || model.finite->loose().empty()) return {};
  const LoosePieces& bodies = model.finite->loose();
  const std::vector<Vec3>& points = model.energy_points;
  std::vector<std::vector<Vec3>> places_of(static_cast<std::size_t>(std::ranges::max(pieces)) + 1);
  std::vector<int> piece_at(points.size());
  parallel_for_each_index(points.size(), 64, [&](std::size_t q) {
    piece_at[q] = piece_of(pieces, model.surface, tree.closest(points[q]).point.triangle);
  });
  for (std::size_t q = 0; q < points.size(); ++q)
    places_of[static_cast<std::size_t>(piece_at[q])].push_back(points[q]);
  // A thin one may have no point of the energy.
  std::vector<std::vector<Vec3>> corners_of(places_of.size());
  for (std::size_t v = 0; v < pieces.size(); ++v)
    if (const auto piece = static_cast<std::size_t>(pieces[v]); places_of[piece].empty())
      corners_of[piece].push_back(model.surface.vertices[v]);
  // What moves a point: -1 where any node of it is held; kNobodyKnows where it has none.
  constexpr int kNobodyKnows = std::numeric_limits<int>::max();
  const auto moved_by = [&](const Vec3& place) {
    thread_local ShapeValues values;
    if (!fields.evaluate(place, false, values)) return kNobodyKnows;
    int moves = kNobodyKnows;
    for (const int node : values.nodes)
      if (moves = bodies.piece_of(static_cast<std::size_t>(node)); moves < 0) break;
    return moves;
  };
  std::vector<int> loose;
  for (std::size_t piece = 0; piece < places_of.size(); ++piece) {
    const std::vector<Vec3>& own = places_of[piece].empty() ? corners_of[piece] : places_of[piece];
    // One place tells, but for a piece that hangs together by less than fields do.
    std::vector<int> moves(own.size());
    if (own.empty() || (moves[0] = moved_by(own.front())) < 0) {
      loose.push_back(-1);
      continue;
    }
    parallel_for_each_index(own.size(), 64, [&](std::size_t i) { moves[i] = moved_by(own[i]); });
    const int least = std::ranges::min(moves);
    loose.push_back(least == kNobodyKnows ? -1 : least);
  }
  if (std::ranges::max(loose) < 0) return {};
  return loose;
}

void take_blood(const TriangleSurface& surface, const SurfaceTree& tree,
                std::span<const int> pieces, std::span<const int> loose, double voxel,
                std::vector<ShapedBrick>& shapes) {
  if (loose.empty()) return;
  const SeveredWalls walls(surface, pieces, loose);
  const double edge = kBrickEdgeVoxels * voxel;
  // First those that there are, then those of the pieces.
  std::vector<ShapedBrick> bricks = std::move(shapes);
  const std::size_t shaped = bricks.size();
  BrickMap seen;
  for (std::size_t s = 0; s < shaped; ++s) seen.set(bricks[s].index, static_cast<int>(s));
  for (const Box& box : walls.boxes()) {
    if (box.isEmpty()) continue;
    for_bricks_in(box, edge, [&](const BrickIndex& index) {
      const int fresh = static_cast<int>(bricks.size());
      if (seen.find_or_add(index, fresh) == fresh) bricks.push_back({index, nullptr});
    });
  }
  const SignedDistance distance = [&](const Vec3& place) { return tree.signed_distance(place); };
  std::vector<char> listed(bricks.size(), 1);
  parallel_for_each_index(bricks.size(), 8, [&](std::size_t b) {
    ShapedBrick& brick = bricks[b];
    if (brick.geometry && brick.geometry->empty) return;
    const Vec3 middle = (brick.index.cast<double>() + Vec3::Constant(0.5)) * edge;
    if (walls.beside(middle, edge)) {
      listed[b] = b < shaped;
      return;
    }
    std::vector<float> perfused = walls.perfused(brick.index, voxel);
    if (all_are(perfused, 1.0f)) {
      listed[b] = b < shaped;
    } else if (all_are(perfused, 0.0f)) {
      if (b < shaped) brick.geometry = without_blood(brick.geometry);
    } else {
      if (b >= shaped) brick.geometry = make_geometry(brick.index, voxel, distance);
      brick.geometry = with_blood(brick.geometry, std::move(perfused));
    }
  });
  shapes.clear();
  for (std::size_t b = 0; b < bricks.size(); ++b)
    if (listed[b]) shapes.push_back(std::move(bricks[b]));
}

}  // namespace viscera
