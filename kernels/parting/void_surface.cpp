#include "kernels/parting/void_surface.h"

#include <algorithm>
#include <set>
#include <unordered_map>

namespace viscera {
namespace {

using Voxel = TissueShare::Voxel;

/// A vertex keeps this share of its edge from both ends, so that triangles have an area.
constexpr double kFromEnds = 0.02;

/// The corner of a cube whose bits say along which axes it lies from the first.
Voxel corner(const Voxel& first, unsigned bits) {
  return {first[0] + static_cast<int>(bits & 1u), first[1] + static_cast<int>(bits >> 1u & 1u),
          first[2] + static_cast<int>(bits >> 2u & 1u)};
}

/// The edge from a middle to the one along these axes.
struct Edge {
  Voxel from;
  unsigned along;
  bool operator==(const Edge&) const = default;
};
struct EdgeHash {
  std::size_t operator()(const Edge& edge) const {
    std::uint64_t sum = edge.along;
    for (const int index : edge.from)
      sum = (sum ^ static_cast<std::uint32_t>(index)) * 0x9E3779B97F4A7C15ull;
    return sum ^ sum >> 29;
  }
};

/// The shares of a brick's voxels and of those next to it above.
struct Shares {
  static constexpr int kAcross = TissueShare::kEdge + 1;
  Shares(const TissueShare& tissue, const Voxel& lowest) {
    std::size_t at = 0;
    for (int z = 0; z < kAcross; ++z)
      for (int y = 0; y < kAcross; ++y)
        for (int x = 0; x < kAcross; ++x)
          all[at++] = tissue.share(Voxel{lowest[0] + x, lowest[1] + y, lowest[2] + z});
  }
  double at(int x, int y, int z) const {
    return all[static_cast<std::size_t>(x + kAcross * (y + kAcross * z))];
  }
  std::array<double, kAcross * kAcross * kAcross> all;
};

class Marching {
 public:
  explicit Marching(const TissueShare& tissue) : tissue_(tissue) {}

  /// The cubes whose first middles are those of a brick.
  void brick(const Voxel& lowest) {
    const Shares shares(tissue_, lowest);
    for (int z = 0; z < TissueShare::kEdge; ++z)
      for (int y = 0; y < TissueShare::kEdge; ++y)
        for (int x = 0; x < TissueShare::kEdge; ++x) {
          std::array<double, 8> over;
          bool any = false, all = true;
          for (unsigned bits = 0; bits < 8; ++bits) {
            const Voxel voxel = corner({x, y, z}, bits);
            over[bits] = shares.at(voxel[0], voxel[1], voxel[2]) - 0.5;
            any = any || over[bits] < 0.0;
            all = all && over[bits] < 0.0;
          }
          if (any && !all) cube({lowest[0] + x, lowest[1] + y, lowest[2] + z}, over);
        }
  }

  TriangleSurface surface;

 private:
  void cube(const Voxel& first, const std::array<double, 8>& over) {
    std::array<unsigned, 3> axes = {1, 2, 4};
    do {
      tetrahedron(first, {0u, axes[0], axes[0] | axes[1], 7u}, over);
    } while (std::next_permutation(axes.begin(), axes.end()));
  }

  void tetrahedron(const Voxel& first, const std::array<unsigned, 4>& corners,
                   const std::array<double, 8>& over) {
    std::vector<unsigned> gone, left;
    for (const unsigned bits : corners) (over[bits] < 0.0 ? gone : left).push_back(bits);
    if (gone.empty() || left.empty()) return;
    const auto on = [&](unsigned a, unsigned b) { return vertex(first, a, b, over); };
    Vec3 way = Vec3::Zero();
    for (const unsigned bits : left)
      way += tissue_.middle(corner(first, bits)) / static_cast<double>(left.size());
    for (const unsigned bits : gone)
      way -= tissue_.middle(corner(first, bits)) / static_cast<double>(gone.size());
    if (gone.size() == 1) {
      add({on(gone[0], left[0]), on(gone[0], left[1]), on(gone[0], left[2])}, way);
    } else if (left.size() == 1) {
      add({on(gone[0], left[0]), on(gone[1], left[0]), on(gone[2], left[0])}, way);
    } else {
      const int a = on(gone[0], left[0]), b = on(gone[0], left[1]), c = on(gone[1], left[1]),
                d = on(gone[1], left[0]);
      add({a, b, c}, way);
      add({a, c, d}, way);
    }
  }

  /// One corner's bits are all among the other's.
  int vertex(const Voxel& first, unsigned a, unsigned b, const std::array<double, 8>& over) {
    const unsigned low = a & b, high = a | b;
    const Edge edge{corner(first, low), high ^ low};
    const auto [found, is_new] =
        vertices_.try_emplace(edge, static_cast<int>(surface.vertices.size()));
    if (is_new) {
      const Vec3 from = tissue_.middle(edge.from), to = tissue_.middle(corner(first, high));
      const double share = over[low] / (over[low] - over[high]);
      surface.vertices.push_back(from +
                                 std::clamp(share, kFromEnds, 1.0 - kFromEnds) * (to - from));
    }
    return found->second;
  }

  void add(std::array<int, 3> triangle, const Vec3& way) {
    const auto at = [&](std::size_t i) -> const Vec3& {
      return surface.vertices[static_cast<std::size_t>(triangle[i])];
    };
    if ((at(1) - at(0)).cross(at(2) - at(0)).dot(way) < 0.0) std::swap(triangle[1], triangle[2]);
    surface.triangles.push_back(triangle);
  }

  const TissueShare& tissue_;
  std::unordered_map<Edge, int, EdgeHash> vertices_;
};

}  // namespace

TriangleSurface void_surface(const TissueShare& tissue) {
  // Cubes that reach into a brick from below have their first middles in those before it.
  std::set<Voxel> bricks;
  for (const Voxel& lowest : tissue.bricks())
    for (unsigned bits = 0; bits < 8; ++bits) {
      const Voxel before = corner({0, 0, 0}, bits);
      bricks.insert({lowest[0] - TissueShare::kEdge * before[0],
                     lowest[1] - TissueShare::kEdge * before[1],
                     lowest[2] - TissueShare::kEdge * before[2]});
    }
  Marching marching(tissue);
  for (const Voxel& lowest : bricks) marching.brick(lowest);
  return std::move(marching.surface);
}

}  // namespace viscera
