#include "kernels/points/curved_refinement.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

namespace viscera {
namespace {

// Where a vertex normal leans from one of an edge's two triangles by more than this, the surface
// has a corner there, and the edge stays straight; less than half a right angle, so that the edges
// of a box are corners too.
const double kCorner = std::cos(40.0 * std::numbers::pi / 180.0);

using Edge = std::pair<int, int>;

template <class Vector>
Vector unit_normal(const std::array<int, 3>& corners, const std::vector<Vector>& positions) {
  const Vector& a = positions[corners[0]];
  return (positions[corners[1]] - a).cross(positions[corners[2]] - a).normalized();
}

}  // namespace

template <class Vector>
void CurvedRefinement::append(const Middle& middle, std::vector<Vector>& positions,
                              std::vector<Vector>& normals) {
  using Scalar = typename Vector::Scalar;
  const Vector a = positions[middle.from], b = positions[middle.to];
  const Vector na = normals[middle.from], nb = normals[middle.to];
  const Vector d = b - a;
  Vector place = Scalar(0.5) * (a + b);
  Vector normal = Vector::Zero();
  if (middle.smooth) {
    place += Scalar(0.125) * (d.dot(nb) * nb - d.dot(na) * na);
    // The quadratic normal: the mean, mirrored where the edge bends both ways.
    normal = na + nb;
    const Scalar square = d.squaredNorm();
    if (square > Scalar(0)) normal -= Scalar(2) * d.dot(normal) / square * d;
  } else {
    for (int i = 0; i < middle.sides; ++i) normal += unit_normal(middle.side[i], positions);
  }
  positions.push_back(place);
  normals.push_back(normal.normalized());
}

/// Divides the surface pass by pass, and remembers how.
class CurvedRefinement::Builder {
 public:
  Builder(const TriangleSurface& coarse, CurvedRefinement& refinement)
      : made_(refinement), positions_(coarse.vertices), normals_(vertex_normals(coarse)) {
    made_.triangles_ = coarse.triangles;
  }

  /// Divides every edge that `divides` finds, once; false where it finds none.
  bool pass(const Divides& divides) {
    const std::map<Edge, Middle> found = edges();
    middles_.clear();
    const std::size_t before = made_.middles_.size();
    for (const auto& [edge, middle] : found) {
      append(middle, positions_, normals_);
      if (divides(positions_[edge.first], positions_[edge.second], positions_.back())) {
        middles_[edge] = static_cast<int>(positions_.size()) - 1;
        made_.middles_.push_back(middle);
      } else {
        positions_.pop_back();
        normals_.pop_back();
      }
    }
    if (made_.middles_.size() == before) return false;
    std::vector<std::array<int, 3>> finer;
    for (const auto& corners : made_.triangles_) divide(corners, finer);
    made_.triangles_ = std::move(finer);
    return true;
  }

 private:
  std::map<Edge, Middle> edges() const {
    std::map<Edge, Middle> found;
    for (const auto& corners : made_.triangles_) {
      const Vec3 normal = unit_normal(corners, positions_);
      for (int i = 0; i < 3; ++i) {
        const Edge edge = std::minmax({corners[i], corners[(i + 1) % 3]});
        Middle& middle = found.try_emplace(edge, Middle{edge.first, edge.second}).first->second;
        if (middle.sides < 2) middle.side[middle.sides++] = corners;
        for (const int v : {edge.first, edge.second})
          middle.smooth = middle.smooth && normals_[v].dot(normal) > kCorner;
      }
    }
    return found;
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
    const auto& x = positions_;
    if ((x[a] - x[bc]).squaredNorm() <= (x[ab] - x[c]).squaredNorm()) {
      finer.push_back({a, ab, bc});
      finer.push_back({a, bc, c});
    } else {
      finer.push_back({a, ab, c});
      finer.push_back({ab, bc, c});
    }
  }

  CurvedRefinement& made_;
  std::vector<Vec3> positions_, normals_;
  std::map<Edge, int> middles_;  // of this pass
};

CurvedRefinement::CurvedRefinement(const TriangleSurface& coarse, const Divides& divides) {
  Builder builder(coarse, *this);
  while (builder.pass(divides)) {
  }
}

template <class Vector>
void CurvedRefinement::extend(std::vector<Vector>& positions, std::vector<Vector>& normals) const {
  positions.reserve(positions.size() + middles_.size());
  normals.reserve(normals.size() + middles_.size());
  for (const Middle& middle : middles_) append(middle, positions, normals);
}

template void CurvedRefinement::extend(std::vector<Vec3>&, std::vector<Vec3>&) const;
template void CurvedRefinement::extend(std::vector<Vec3f>&, std::vector<Vec3f>&) const;

}  // namespace viscera
