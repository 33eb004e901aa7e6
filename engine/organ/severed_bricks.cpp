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

namespace viscera {
namespace {

constexpr int kBrickEdgeVoxels = BrickGeometry::kEdge;
/// From a cube's middle to its corners, over its edge; a little more, against rounding.
constexpr double kHalfDiagonal = 0.501 * std::numbers::sqrt3;

int piece_of_triangle(std::span<const int> pieces, const std::array<int, 3>& triangle) {
  return pieces[static_cast<std::size_t>(triangle[0])];
}

/// The walls of what is cut off and of what is held.
class SeveredWalls {
 public:
  SeveredWalls(const TriangleSurface& surface, std::span<const int> pieces,
               std::span<const char> severed)
      : boxes_(severed.size()) {
    TriangleSurface off{surface.vertices, {}}, held{surface.vertices, {}};
    for (const std::array<int, 3>& triangle : surface.triangles) {
      const auto piece = static_cast<std::size_t>(piece_of_triangle(pieces, triangle));
      (severed[piece] ? off : held).triangles.push_back(triangle);
      if (!severed[piece]) continue;
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

/// Calls for each brick, of this edge, that meets the box.
template <class Body>
void for_bricks_in(const Box& box, double edge, const Body& body) {
  const BrickIndex first = (box.min() / edge).array().floor().cast<int>();
  const BrickIndex last = (box.max() / edge).array().floor().cast<int>();
  for (int z = first.z(); z <= last.z(); ++z)
    for (int y = first.y(); y <= last.y(); ++y)
      for (int x = first.x(); x <= last.x(); ++x)
        if (const BrickIndex index(x, y, z); BrickMap::holds(index)) body(index);
}

bool all_are(const std::vector<float>& values, float value) {
  return std::ranges::all_of(values, [value](float one) { return one == value; });
}

}  // namespace

std::vector<char> severed_pieces(const OrganModel& model, const ShapeFunctions& fields,
                                 const SurfaceTree& tree, std::span<const int> pieces) {
  if (pieces.empty() || !model.finite || model.finite->loose().empty()) return {};
  const std::vector<Vec3>& points = model.energy_points;
  std::vector<int> piece_at(points.size());
  parallel_for_each_index(points.size(), 64, [&](std::size_t q) {
    const int triangle = tree.closest(points[q]).point.triangle;
    piece_at[q] =
        piece_of_triangle(pieces, model.surface.triangles[static_cast<std::size_t>(triangle)]);
  });
  std::vector<std::vector<std::size_t>> points_of(
      static_cast<std::size_t>(std::ranges::max(pieces)) + 1);
  for (std::size_t q = 0; q < points.size(); ++q)
    points_of[static_cast<std::size_t>(piece_at[q])].push_back(q);
  const auto is_held = [&](std::size_t q) {
    thread_local ShapeValues values;
    return fields.evaluate(points[q], false, values) &&
           std::ranges::any_of(values.nodes, [&](int node) {
             return !model.finite->loose().has(static_cast<std::size_t>(node));
           });
  };
  std::vector<char> severed;
  for (const std::vector<std::size_t>& own : points_of) {
    // One point tells, but for a piece that hangs together by less than fields do.
    if (!own.empty() && is_held(own.front())) {
      severed.push_back(0);
      continue;
    }
    std::vector<char> held(own.size());
    parallel_for_each_index(own.size(), 64, [&](std::size_t i) { held[i] = is_held(own[i]); });
    severed.push_back(std::ranges::none_of(held, [](char one) { return one != 0; }));
  }
  if (std::ranges::none_of(severed, [](char one) { return one != 0; })) return {};
  return severed;
}

void take_blood(const TriangleSurface& surface, const SurfaceTree& tree,
                std::span<const int> pieces, std::span<const char> severed, double voxel,
                std::vector<ShapedBrick>& shapes) {
  if (severed.empty()) return;
  const SeveredWalls walls(surface, pieces, severed);
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
