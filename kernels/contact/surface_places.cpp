#include "kernels/contact/surface_places.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <span>

#include "kernels/base/parallel.h"
#include "kernels/contact/same_side.h"
#include "kernels/paff/true_neighbours.h"
#include "kernels/points/kd_tree.h"

namespace viscera {
namespace {

/// A piece of a triangle, small beside the node spacing.
struct Piece {
  int node;  // nearest on the surface
  Vec3 centroid;
  Vec3 area_vector;
};

/// Widest piece, in node spacings.
constexpr double kPieceWidth = 1.0 / 3.0;
/// Cosine between a piece and the mean of its patch below which it belongs to another.
constexpr double kSameFace = 0.7;

/// Splits a triangle into n x n pieces of equal area.
void split_triangle(const std::array<Vec3, 3>& corner, int n, std::vector<Piece>& out) {
  const Vec3 u = (corner[1] - corner[0]) / n, v = (corner[2] - corner[0]) / n;
  const Vec3 area_vector = 0.5 * u.cross(v);
  if (!(area_vector.squaredNorm() > 0.0)) return;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; i + j < n; ++j) {
      const Vec3 base = corner[0] + i * u + j * v;
      out.push_back({0, base + (u + v) / 3.0, area_vector});
      if (i + j + 1 < n) out.push_back({0, base + (u + v) * (2.0 / 3.0), area_vector});
    }
  }
}

std::vector<Piece> cut_into_pieces(const TriangleSurface& surface, const PointCloud& cloud) {
  constexpr std::size_t kChunk = 128;
  const std::size_t sites = cloud.surface_count > 0 ? cloud.surface_count : cloud.size();
  const KdTree tree(std::span<const Vec3>(cloud.positions).first(sites));
  std::vector<std::vector<Piece>> chunks((surface.triangles.size() + kChunk - 1) / kChunk);
  parallel_chunks(surface.triangles.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    std::vector<KdTree::Found> found;
    const auto nearest = [&](const Vec3& x) {
      tree.nearest(x, 1, -1, found);
      return found.front().index;
    };
    std::vector<Piece>& pieces = chunks[begin / kChunk];
    for (std::size_t t = begin; t < end; ++t) {
      std::array<Vec3, 3> corner;
      for (std::size_t a = 0; a < 3; ++a) {
        corner[a] = surface.vertices[static_cast<std::size_t>(surface.triangles[t][a])];
      }
      const int node = nearest((corner[0] + corner[1] + corner[2]) / 3.0);
      const double h = cloud.spacings[static_cast<std::size_t>(node)];
      const double longest = std::sqrt(
          std::max({(corner[1] - corner[0]).squaredNorm(), (corner[2] - corner[1]).squaredNorm(),
                    (corner[0] - corner[2]).squaredNorm()}));
      const std::size_t first = pieces.size();
      split_triangle(corner, std::max(1, static_cast<int>(std::ceil(longest / (kPieceWidth * h)))),
                     pieces);
      for (std::size_t p = first; p < pieces.size(); ++p) {
        pieces[p].node = nearest(pieces[p].centroid);
      }
    }
  });
  std::vector<Piece> pieces;
  for (const std::vector<Piece>& chunk : chunks) {
    pieces.insert(pieces.end(), chunk.begin(), chunk.end());
  }
  std::stable_sort(pieces.begin(), pieces.end(),
                   [](const Piece& a, const Piece& b) { return a.node < b.node; });
  return pieces;
}

/// The centre of pieces that face about the same way, put back onto the nearest of them: the mean
/// of a bent patch lies under it.
Vec3 centre_on_surface(std::span<const Piece> pieces, const Vec3& normal) {
  Vec3 moment = Vec3::Zero();
  double area = 0.0;
  for (const Piece& piece : pieces) {
    const double a = piece.area_vector.norm();
    moment += a * piece.centroid;
    area += a;
  }
  const Vec3 centre = moment / area;
  double least = std::numeric_limits<double>::infinity(), height = 0.0;
  for (const Piece& piece : pieces) {
    const Vec3 offset = piece.centroid - centre;
    const double up = normal.dot(offset);
    const double aside = (offset - up * normal).squaredNorm();
    if (aside >= least) continue;
    least = aside;
    // Along the mean normal to the plane of the piece.
    const double slope = normal.dot(piece.area_vector);
    height = offset.dot(piece.area_vector) / slope;
  }
  return centre + height * normal;
}

/// Sorts the pieces of one node, h from the next, into patches by the way they face, each on one
/// side of the body's folds, and adds a place for each.
void add_places(std::span<Piece> pieces, double h, SurfacePlaces& out) {
  while (!pieces.empty()) {
    Vec3 sum = Vec3::Zero();
    const Piece first = pieces.front();
    const auto rest = std::stable_partition(pieces.begin(), pieces.end(), [&](const Piece& piece) {
      const Vec3& area = piece.area_vector;
      if (sum.dot(area) < kSameFace * sum.norm() * area.norm()) return false;
      if (!same_side(out.paths.get(), kSideDepth * h, first.centroid,
                     first.area_vector.stableNormalized(), piece.centroid, area.stableNormalized()))
        return false;
      sum += area;
      return true;
    });
    const auto count = static_cast<std::size_t>(rest - pieces.begin());
    const Vec3 normal = sum.normalized();
    double area = 0.0;
    for (const Piece& piece : pieces.first(count)) area += piece.area_vector.norm();
    out.positions.push_back(centre_on_surface(pieces.first(count), normal));
    out.normals.push_back(normal);
    out.areas.push_back(area);
    pieces = pieces.subspan(count);
  }
}

std::unexpected<Error> uncovered(const Vec3& x) {
  char text[240];
  std::snprintf(text, sizeof text,
                "surface: at (%.2f, %.2f, %.2f mm) found no fields that cover it, expected at "
                "least four nodes in general position in reach; make the node spacing finer there",
                1e3 * x.x(), 1e3 * x.y(), 1e3 * x.z());
  return failure(text);
}

}  // namespace

Result<SurfacePlaces> place_on_surface(const TriangleSurface& surface,
                                       const ShapeFunctions& fields) {
  const PointCloud& cloud = fields.cloud();
  std::vector<Piece> pieces = cut_into_pieces(surface, cloud);
  SurfacePlaces out;
  out.nodes = cloud.size();
  if (const auto& neighbours = fields.true_neighbours())
    out.paths = std::shared_ptr<const TissuePaths>(neighbours, &neighbours->paths());
  for (std::size_t begin = 0, end = 0; begin < pieces.size(); begin = end) {
    while (end < pieces.size() && pieces[end].node == pieces[begin].node) ++end;
    add_places(std::span(pieces).subspan(begin, end - begin),
               cloud.spacings[static_cast<std::size_t>(pieces[begin].node)], out);
  }

  std::vector<ShapeValues> at_place(out.size());
  std::vector<char> covered(out.size());
  parallel_for_each_index(out.size(), 64, [&](std::size_t p) {
    covered[p] = fields.evaluate(out.positions[p], false, at_place[p]);
  });
  for (std::size_t p = 0; p < out.size(); ++p) {
    if (!covered[p]) return uncovered(out.positions[p]);
    const ShapeValues& place = at_place[p];
    double h = 0.0;
    for (std::size_t i = 0; i < place.nodes.size(); ++i) {
      h += place.values[i] * cloud.spacings[static_cast<std::size_t>(place.nodes[i])];
      out.fields.nodes.push_back(place.nodes[i]);
      out.fields.values.push_back(static_cast<float>(place.values[i]));
    }
    out.fields.row_begin.push_back(static_cast<int>(out.fields.nodes.size()));
    out.spacings.push_back(h);
  }
  return out;
}

}  // namespace viscera
