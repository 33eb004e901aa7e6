#include "kernels/parting/void_surface.h"

#include <algorithm>
#include <array>
#include <tuple>

#include "kernels/parting/simplify.h"
#include "kernels/points/marching_tetrahedra.h"

namespace viscera {
namespace {

using Voxel = TissueShare::Voxel;
constexpr int kEdge = TissueShare::kEdge;

/// By how much more than half is left of a brick's voxels and of those next to it above.
class Overs {
 public:
  Overs(const TissueShare& tissue, const Voxel& lowest) {
    std::size_t at = 0;
    for (int z = 0; z < kAcross; ++z)
      for (int y = 0; y < kAcross; ++y)
        for (int x = 0; x < kAcross; ++x)
          all_[at++] = tissue.share(Voxel(lowest + Voxel(x, y, z))) - 0.5;
  }
  double at(const Voxel& voxel) const {
    return all_[static_cast<std::size_t>(voxel.x() + kAcross * (voxel.y() + kAcross * voxel.z()))];
  }

 private:
  static constexpr int kAcross = kEdge + 1;
  std::array<double, kAcross * kAcross * kAcross> all_;
};

/// Those whose voxels are the first corners of cubes with some that is gone, from below upwards:
/// the surface doesn't depend on the order in which bricks came.
std::vector<Voxel> bricks_of_cubes(const TissueShare& tissue) {
  std::vector<Voxel> bricks;
  for (const Voxel& lowest : tissue.bricks())
    for (int c = 0; c < 8; ++c)
      bricks.push_back(lowest - kEdge * MarchingTetrahedra::corner(Voxel::Zero(), c));
  const auto in_turn = [](const Voxel& a, const Voxel& b) {
    return std::tuple(a.x(), a.y(), a.z()) < std::tuple(b.x(), b.y(), b.z());
  };
  std::sort(bricks.begin(), bricks.end(), in_turn);
  bricks.erase(std::unique(bricks.begin(), bricks.end()), bricks.end());
  return bricks;
}

}  // namespace

TriangleSurface void_surface(const TissueShare& tissue) {
  MarchingTetrahedra marching([&](const Voxel& voxel) { return tissue.middle(voxel); });
  for (const Voxel& lowest : bricks_of_cubes(tissue)) {
    const Overs overs(tissue, lowest);
    for (int z = 0; z < kEdge; ++z)
      for (int y = 0; y < kEdge; ++y)
        for (int x = 0; x < kEdge; ++x) {
          const Voxel first(x, y, z);
          std::array<double, 8> over;
          for (int c = 0; c < 8; ++c)
            over[static_cast<std::size_t>(c)] = overs.at(MarchingTetrahedra::corner(first, c));
          marching.visit(lowest + first, over);
        }
  }
  return marching.take();
}

TriangleSurface plain_void_surface(const TissueShare& tissue, double longest) {
  return simplified(void_surface(tissue), {0.1 * tissue.voxel(), longest});
}

}  // namespace viscera
