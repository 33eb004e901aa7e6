// A block on a bed, whose upper part something carries away: a scene for tests.
#pragma once

#include "engine/features/beds/beds_keys.h"
#include "engine/scene/scene.h"
#include "engine/simulation/frame_flag.h"
#include "engine/simulation/world.h"

namespace viscera::test {

inline constexpr CohesiveLaw kLiftedBed{6e3, 7e6, 10.0};

struct LiftedBlock {
  Response response = Response::kLinear;
  Vec3 way = Vec3(0, 0, 4e-3);  ///< of what holds it, at its farthest [m]
  double period = 2.0;          ///< of its way there and back [s]
  double modulus = 300e3;       ///< [Pa]
  bool soft_floor = false;      ///< it deforms, too
};

/// Organs: block, 20 x 20 x 8 mm about the origin, and floor, below it; bed: "bed", of kLiftedBed.
SceneDescription lifted_block(const LiftedBlock& options);

/// Of its bed on the block, world [N].
Vec3 pull_of_bed(const World& world);

struct Lifted {
  double work = 0.0;          ///< of what carries the block, against its bed [J]
  double greatest = 0.0;      ///< pull [N]
  double farthest_off = 0.0;  ///< of the pull from what the law has at that opening, whose block
                              ///< doesn't yield, over the greatest
  FlagSet flags;
};
/// Steps until `time`.
Lifted lift(World& world, double time);

}  // namespace viscera::test
