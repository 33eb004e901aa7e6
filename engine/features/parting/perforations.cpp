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

/// Voxels that touch, by a corner at least, are one place.
void count(const Gone& gone, const SurfaceTree& surface, WallFigures& figures) {
  BrickMap numbers;
  for (std::size_t i = 0; i < gone.voxels.size(); ++i)
    numbers.set(gone.voxels[i], static_cast<int>(i));
  DisjointSets places(gone.voxels.size());
  for (std::size_t i = 0; i < gone.voxels.size(); ++i)
    for (int side = 0; side < 27; ++side) {
      const BrickIndex beside(side % 3 - 1, side / 3 % 3 - 1, side / 9 - 1);
      const int other = numbers.find(gone.voxels[i] + beside);
      if (other != BrickMap::kNone) places.join(static_cast<int>(i), other);
    }
  std::vector<double> depths(gone.voxels.size(), 0.0);
  for (std::size_t i = 0; i < gone.voxels.size(); ++i) {
    // As deep as the voxel's far side.
    const double depth = 0.5 * gone.voxel - surface.signed_distance(gone.middles[i]);
    double& deepest = depths[static_cast<std::size_t>(places.root(static_cast<int>(i)))];
    deepest = std::max(deepest, depth);
  }
  for (const double depth : depths) {
    if (depth >= figures.wall) ++figures.perforations;
    figures.depth = std::max(figures.depth, depth);
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
