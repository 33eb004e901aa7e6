// Refinement of imported surfaces: cubic edges of curved PN triangles [Vlachos2001], so that a
// coarse organ has no facets.
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include "engine/organ/shape.h"

namespace viscera {
namespace {

// Where a vertex normal leans from one of an edge's two triangles by more than this, the surface
// has a corner there, and the edge stays straight; less than half a right angle, so that the edges
// of a box are corners too.
const double kCorner = std::cos(40.0 * std::numbers::pi / 180.0);

using Edge = std::pair<int, int>;

class Refiner {
 public:
  explicit Refiner(const TriangleSurface& surface)
      : surface_(surface), normals_(vertex_normals(surface)) {}

  // Splits every edge that is longer than `edge`, once; false where none is.
  bool pass(double edge) {
    middles_.clear();
    std::map<Edge, LongEdge> long_edges;
    for (int t = 0; t < static_cast<int>(surface_.triangles.size()); ++t) {
      const auto& corners = surface_.triangles[t];
      for (int i = 0; i < 3; ++i) {
        const Edge e = std::minmax({corners[i], corners[(i + 1) % 3]});
        const Vec3 along = surface_.vertices[e.first] - surface_.vertices[e.second];
        if (along.norm() <= edge) continue;
        const Vec3 normal = area_vector(surface_, t).normalized();
        LongEdge& found = long_edges[e];
        found.normal += normal;
        for (const int v : {e.first, e.second}) {
          found.smooth = found.smooth && normals_[v].dot(normal) > kCorner;
        }
      }
    }
    if (long_edges.empty()) return false;
    for (const auto& [e, found] : long_edges) add_middle(e, found);

    std::vector<std::array<int, 3>> finer;
    for (const auto& corners : surface_.triangles) divide(corners, finer);
    surface_.triangles = std::move(finer);
    return true;
  }

  TriangleSurface take() { return std::move(surface_); }

 private:
  struct LongEdge {
    Vec3 normal = Vec3::Zero();  // of its triangles, summed
    bool smooth = true;
  };

  void add_middle(const Edge& e, const LongEdge& found) {
    const Vec3 a = surface_.vertices[e.first], b = surface_.vertices[e.second];
    const Vec3 na = normals_[e.first], nb = normals_[e.second];
    const Vec3 d = b - a;
    Vec3 middle = 0.5 * (a + b);
    if (found.smooth) middle += 0.125 * (d.dot(nb) * nb - d.dot(na) * na);
    // The quadratic normal: the mean, mirrored where the edge bends both ways.
    const Vec3 sum = na + nb;
    const Vec3 normal =
        found.smooth ? Vec3(sum - 2.0 * d.dot(sum) / d.squaredNorm() * d) : found.normal;
    middles_[e] = static_cast<int>(surface_.vertices.size());
    surface_.vertices.push_back(middle);
    normals_.push_back(normal.normalized());
  }

  int middle(int a, int b) const {
    const auto at = middles_.find(std::minmax({a, b}));
    return at == middles_.end() ? -1 : at->second;
  }

  void divide(const std::array<int, 3>& corners, std::vector<std::array<int, 3>>& finer) const {
    std::array<int, 3> m;
    for (int i = 0; i < 3; ++i) m[i] = middle(corners[i], corners[(i + 1) % 3]);
    const int count = (m[0] >= 0) + (m[1] >= 0) + (m[2] >= 0);
    if (count == 0) {
      finer.push_back(corners);
      return;
    }
    if (count == 3) {
      for (int i = 0; i < 3; ++i) finer.push_back({corners[i], m[i], m[(i + 2) % 3]});
      finer.push_back(m);
      return;
    }
    // Turn so that the first edge is split, or, of two split edges, so that they are the first two.
    int turn = 0;
    while (m[turn] < 0 || (count == 2 && m[(turn + 1) % 3] < 0)) ++turn;
    const int a = corners[turn], b = corners[(turn + 1) % 3], c = corners[(turn + 2) % 3];
    const int ab = m[turn], bc = m[(turn + 1) % 3];
    if (count == 1) {
      finer.push_back({a, ab, c});
      finer.push_back({ab, b, c});
      return;
    }
    finer.push_back({ab, b, bc});
    // The shorter diagonal of the quadrilateral that is left.
    const auto& x = surface_.vertices;
    if ((x[a] - x[bc]).squaredNorm() <= (x[ab] - x[c]).squaredNorm()) {
      finer.push_back({a, ab, bc});
      finer.push_back({a, bc, c});
    } else {
      finer.push_back({a, ab, c});
      finer.push_back({ab, bc, c});
    }
  }

  TriangleSurface surface_;
  std::vector<Vec3> normals_;
  std::map<Edge, int> middles_;
};

}  // namespace

TriangleSurface refined(const TriangleSurface& surface, double edge) {
  Refiner refiner(surface);
  while (refiner.pass(edge)) {
  }
  return refiner.take();
}

}  // namespace viscera
