#include "engine/features/parting/perforations.h"

#include <algorithm>
#include <optional>

#include "engine/features/cautery/cautery.h"
#include "engine/features/parting/parting.h"
#include "kernels/base/disjoint_sets.h"
#include "kernels/points/surface_tree.h"

namespace viscera {
namespace {

/// Voxels that are gone, of one size.
struct Gone {
  double voxel = 0.0;  ///< their edge [m]
  std::vector<BrickIndex> voxels;
  std::vector<Vec3> middles;  ///< rest frame [m]
};

/// Those of which less than half is left.
Gone gone_by_cuts(const TissueShare& tissue) {
  Gone gone{.voxel = tissue.voxel(), .voxels = {}, .middles = {}};
  for (const TissueShare::Voxel& lowest : tissue.bricks())
    for (int v = 0; v < BrickField::kVoxels; ++v) {
      constexpr int kEdge = TissueShare::kEdge;
      const TissueShare::Voxel voxel =
          lowest + TissueShare::Voxel(v % kEdge, v / kEdge % kEdge, v / (kEdge * kEdge));
      if (!(tissue.share(voxel) < 0.5)) continue;
      gone.voxels.push_back(voxel);
      gone.middles.push_back(tissue.middle(voxel));
    }
  return gone;
}

Gone gone_by_heat(const Bioheat& heat) {
  Gone gone{.voxel = heat.options().voxel, .voxels = {}, .middles = {}};
  for (std::size_t b = 0; b < heat.bricks().count(); ++b) {
    const HeatBrick& brick = heat.bricks().brick(b);
    if (!brick.harmed) continue;
    for (int v = 0; v < BrickField::kVoxels; ++v) {
      const auto at = static_cast<std::size_t>(v);
      if (!(mass_left(heat.tissue(), static_cast<double>(brick.water[at]),
                      static_cast<double>(brick.charred[at])) < 0.5))
        continue;
      gone.middles.push_back(heat.bricks().centre(brick, v));
      gone.voxels.push_back(heat.bricks().voxel_of(gone.middles.back()));
    }
  }
  return gone;
}

/// Joins those of these voxels that touch, by a corner at least.
template <class Counts>
DisjointSets joined(const Gone& gone, const BrickMap& numbers, const Counts& counts) {
  DisjointSets sets(gone.voxels.size());
  for (std::size_t i = 0; i < gone.voxels.size(); ++i)
    for (int side = 0; counts(i) && side < 27; ++side) {
      const BrickIndex beside(side % 3 - 1, side / 3 % 3 - 1, side / 9 - 1);
      const int other = numbers.find(gone.voxels[i] + beside);
      if (other != BrickMap::kNone && counts(static_cast<std::size_t>(other)))
        sets.join(static_cast<int>(i), other);
    }
  return sets;
}

/// What lies as deep as the wall is thick, and hangs together there, is one place, where it is
/// open to the skin.
void count(const Gone& gone, const SurfaceTree& surface, WallFigures& figures) {
  BrickMap numbers;
  std::vector<double> depths;  // of their far sides
  for (std::size_t i = 0; i < gone.voxels.size(); ++i) {
    numbers.set(gone.voxels[i], static_cast<int>(i));
    depths.push_back(0.5 * gone.voxel - surface.signed_distance(gone.middles[i]));
    figures.depth = std::max(figures.depth, depths.back());
  }
  const auto is_deep = [&](std::size_t i) { return depths[i] >= figures.wall; };
  DisjointSets all = joined(gone, numbers, [](std::size_t) { return true; });
  DisjointSets deep = joined(gone, numbers, is_deep);
  std::vector<char> open(gone.voxels.size(), 0), counted(gone.voxels.size(), 0);
  for (std::size_t i = 0; i < gone.voxels.size(); ++i)
    if (depths[i] <= gone.voxel) open[static_cast<std::size_t>(all.root(static_cast<int>(i)))] = 1;
  for (std::size_t i = 0; i < gone.voxels.size(); ++i) {
    if (!is_deep(i) || !open[static_cast<std::size_t>(all.root(static_cast<int>(i)))]) continue;
    char& seen = counted[static_cast<std::size_t>(deep.root(static_cast<int>(i)))];
    if (!seen) ++figures.perforations;
    seen = 1;
  }
}

}  // namespace

std::vector<WallFigures> wall_figures(const World& world) {
  std::vector<WallFigures> all;
  const SceneModel& model = world.model();
  for (std::size_t o = 0; o < model.organs().size(); ++o) {
    const WallDescription* wall = wall_of(model.scene().organs[o]);
    if (!wall) continue;
    WallFigures& figures = all.emplace_back();
    figures.organ = model.organs()[o];
    figures.wall = wall->thickness;
    // Where an organ may be cut, what heat has taken is among what is gone.
    if (const OrganCut* cut = world.find<OrganCut>(figures.organ)) {
      if (!cut->gone.untouched())
        count(gone_by_cuts(cut->gone),
              SurfaceTree(world.find<Cuttable>(figures.organ)->organ->whole->surface), figures);
    } else if (const OrganBurn* burn = world.find<OrganBurn>(figures.organ)) {
      count(gone_by_heat(burn->heat), surface_left(world, figures.organ), figures);
    }
  }
  return all;
}

}  // namespace viscera
