#include "engine/features/beds/heat_beds.h"

#include <algorithm>
#include <cmath>

#include "engine/features/beds/beds.h"
#include "engine/features/beds/cut_beds.h"
#include "engine/features/beds/strands_on_metal.h"
#include "engine/features/cautery/cautery.h"
#include "engine/features/parting/parting.h"
#include "engine/features/touching/touching.h"
#include "engine/simulation/tool_shape.h"
#include "kernels/heat/heat_bridge.h"

namespace viscera {
namespace {

/// A bond is divided into so many parts along each way over the surface at most.
constexpr int kMostBondParts = 8;

/// Tissue at one of a bond's ends is as hot as parts it.
bool is_burnt(const World& world, const Bed& bed, const BedPlaces& places, std::size_t bond) {
  for (std::size_t side = 0; side < 2; ++side) {
    const OrganBurn* burn = world.find<OrganBurn>(bed.organs[side]);
    if (!burn) continue;
    const HeatBricks& bricks = burn->heat.bricks();
    if (burn->heat.options().body + bricks.excess_at(bricks.voxel_of(places.ends[side][bond])) >=
        bed.parts_at)
      return true;
  }
  return false;
}

/// Metal that carries current: tips of hooks, blades of scissors.
std::vector<MetalBall> live_metal(const World& world) {
  std::vector<MetalBall> metal;
  const Pool<BurnTrace>& traces = world.all<BurnTrace>();
  for (std::size_t t = 0; t < traces.size(); ++t) {
    const InstrumentState& state = *world.find<InstrumentState>(traces.owner(t));
    const InstrumentBody& body = *world.find<InstrumentBody>(traces.owner(t));
    if (!(state.power > 0.0) || bipolar_of(body.description)) continue;
    const ToolShape tip = tool_shape(body, state, Pose{});
    for (const Vec3& probe : tip.probes()) metal.push_back({probe, tip.probe_radius()});
    if (const BladeDescription* blade = blade_of(body.description))
      for (const auto& edge : edges_of(body.description, state, Pose{}))
        for (const Vec3& place : edge) metal.push_back({place, 0.5 * blade->thickness});
  }
  return metal;
}

bool any_warm(const World& world, const Bed& bed) {
  return std::ranges::any_of(bed.organs, [&](Entity organ) {
    const OrganBurn* burn = world.find<OrganBurn>(organ);
    return burn && burn->heat.warm_bricks() > 0;
  });
}

/// A bed between two organs whose heat is followed.
class WarmBed {
 public:
  WarmBed(World& world, Entity entity, const std::array<OrganBurn*, 2>& burns)
      : places_(places_now(world, entity)),
        bonds_(world.find<BedState>(entity)->bonds),
        one_(burns[0]->heat),
        other_(burns[1]->heat) {
    const Bed& bed = *world.find<Bed>(entity);
    for (std::size_t side = 0; side < 2; ++side) {
      poses_[side] = &pose_of(world, bed.organs[side]);
      surfaces_[side] = &world.find<OrganBody>(bed.organs[side])->model->surface;
    }
    shift_ = apart(world, bed.organs);
  }

  void pass(double dt) {
    for (std::size_t bond = 0; bond < places_.layer.areas.size(); ++bond)
      if (holds(places_.layer, bonds_, bond) && places_.layer.law.left(bonds_.opened[bond]) > 0.0 &&
          is_near_warmth(bond))
        pass_through(bond, dt);
  }

 private:
  bool is_near_warmth(std::size_t bond) const {
    const auto warm_at = [&](const Bioheat& heat, const Vec3& end) {
      const HeatBrick* brick =
          heat.bricks().find(BrickField::brick_of(heat.bricks().voxel_of(end)));
      return brick && brick->warm;
    };
    return warm_at(one_, places_.ends[0][bond]) || warm_at(other_, places_.ends[1][bond]);
  }

  /// By parts as wide as a voxel, each between the tissue just below both surfaces.
  void pass_through(std::size_t bond, double dt) {
    const double voxel = one_.options().voxel, area = places_.layer.areas[bond];
    const int parts =
        std::clamp(static_cast<int>(std::lround(std::sqrt(area) / voxel)), 1, kMostBondParts);
    std::array<Vec3, 2> ends, normals;
    for (std::size_t side = 0; side < 2; ++side) {
      ends[side] = places_.ends[side][bond];
      normals[side] =
          area_vector(*surfaces_[side], places_.points[side][bond].triangle).normalized();
    }
    for (const Vec3& normal : normals)
      if (!(normal.squaredNorm() > 0.5)) return;  // of a triangle without an area
    // At rest, and farther by what has opened it at most; from the middles of voxels on both sides.
    const double gap =
        (poses_[0]->to_world(ends[0]) - poses_[1]->to_world(ends[1]) - shift_).norm();
    const double length = gap + bonds_.opened[bond] + voxel;
    const double conductance = 0.5 * (one_.tissue().conductivity + other_.tissue().conductivity) *
                               area / (parts * parts * length);
    const Vec3 along = normals[0].unitOrthogonal(), across = normals[0].cross(along);
    const double wide = std::sqrt(area) / parts;
    for (int i = 0; i < parts; ++i)
      for (int j = 0; j < parts; ++j) {
        const Vec3 aside =
            wide * ((i - 0.5 * (parts - 1)) * along + (j - 0.5 * (parts - 1)) * across);
        const Vec3 aside_there =
            poses_[1]->direction_to_local(poses_[0]->direction_to_world(aside));
        conduct(one_, ends[0] + aside - 0.5 * voxel * normals[0], other_,
                ends[1] + aside_there - 0.5 * voxel * normals[1], conductance, dt);
      }
  }

  const BedPlaces& places_;
  const BondStates& bonds_;
  Bioheat &one_, &other_;
  std::array<const Pose*, 2> poses_{};
  std::array<const TriangleSurface*, 2> surfaces_{};
  Vec3 shift_ = Vec3::Zero();  // by which the first organ's frame has come off the second's [m]
};

}  // namespace

bool beds_may_burn(const World& world) {
  return world.has<Bed>() && world.has<BurnTrace>();
}

bool beds_are_warm(const World& world) {
  for (const Bed& bed : world.all<Bed>())
    if (any_warm(world, bed)) return true;
  return false;
}

void warm_beds(World& world, const FrameContext& context) {
  const Pool<Bed>& beds = world.all<Bed>();
  for (std::size_t b = 0; b < beds.size(); ++b) {
    const std::array<OrganBurn*, 2> burns{world.find<OrganBurn>(beds[b].organs[0]),
                                          world.find<OrganBurn>(beds[b].organs[1])};
    if (!burns[0] || !burns[1] || !any_warm(world, beds[b])) continue;
    for (OrganBurn* burn : burns) burn->heat.fetch();
    WarmBed(world, beds.owner(b), burns).pass(context.dt);
  }
}

void burn_beds(World& world, const FrameContext&) {
  const Pool<Bed>& beds = world.all<Bed>();
  const std::vector<MetalBall> metal = live_metal(world);
  for (std::size_t b = 0; b < beds.size(); ++b) {
    if (!any_warm(world, beds[b]) && metal.empty()) continue;
    const BedPlaces& places = places_now(world, beds.owner(b));
    const StrandsOnMetal strands(world, beds[b], places, metal, 1.0);
    BondStates& bonds = world.find<BedState>(beds.owner(b))->bonds;
    for (std::size_t i = 0; i < bonds.parted_by.size(); ++i)
      if (holds(places.layer, bonds, i) &&
          (strands.touched(i) || is_burnt(world, beds[b], places, i)))
        bonds.parted_by[i] = kPartedByHeat;
  }
}

}  // namespace viscera
