#include "tests/support/lifted_block.h"

#include <algorithm>
#include <cmath>

#include "engine/features/beds/beds.h"
#include "engine/features/breathing/breathing_keys.h"
#include "engine/features/touching/touching_keys.h"
#include "engine/simulator/build.h"
#include "tests/support/small_world.h"

namespace viscera::test {

SceneDescription lifted_block(const LiftedBlock& options) {
  SceneDescription scene;
  scene.file = scene.name = "lifted_block";
  OrganDescription block;
  block.name = "block";
  block.geometry = block_geometry(Vec3(20e-3, 20e-3, 8e-3), 1e-3);
  block.tissue = "rubber";
  block.youngs_modulus = options.modulus;
  block.response = options.response;
  block.resolution.spacing = block.resolution.finest = 4e-3;
  Region upper;
  upper.a = Vec3(0, 0, 1e-3);
  upper.b = -Vec3::UnitZ();
  block.fixed = {upper};
  OrganDescription floor = block;
  floor.name = "floor";
  floor.geometry = block_geometry(Vec3(40e-3, 40e-3, 10e-3), 1e-3);
  floor.pose.position.z() = -9e-3;
  floor.deformable = options.soft_floor;
  floor.fixed[0].a = Vec3(0, 0, -2e-3);
  floor.fixed[0].b = Vec3::UnitZ();
  if (!options.soft_floor) floor.fixed.clear();
  scene.organs = {block, floor};
  if (const double far = options.way.norm(); far > 0.0)
    set_motion(
        scene.organs[0],
        {.amplitude = far, .direction = options.way / far, .period = options.period, .phase = 0.0});
  BedDescription bed;
  bed.name = "bed";
  bed.between = {"block", "floor"};
  bed.region.shape = Region::Shape::kBox;
  bed.region.a = Vec3::Constant(-15e-3);
  bed.region.b = Vec3::Constant(15e-3);
  bed.within = 0.5e-3;
  bed.pitch = 1e-3;
  bed.law = kLiftedBed;
  bed.parts_at = 373.15;
  scene.extras.set(BedDescriptions{bed});
  scene.extras.set(TouchingDescription{.organs = true, .friction = 0.0, .pitch = 1.0});
  scene.duration = options.period;
  return scene;
}

Vec3 pull_of_bed(const World& world) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& force : world.all<BedState>()[0].forces) sum += force;
  return sum;
}

Lifted lift(World& world, double time) {
  const auto place_of_block = [&] { return pose_of(world, world.model().organs()[0]).position; };
  Trace trace(stage_names());
  Lifted lifted;
  Vec3 before = place_of_block(), pull_before = pull_of_bed(world);
  const double area = bed_figures(world)[0].area;
  while (world.time() < time - 1e-9) {
    lifted.flags.raise(step_frame(world, trace).flags);
    const Vec3 at = place_of_block(), pull = pull_of_bed(world);
    lifted.work -= 0.5 * (pull + pull_before).dot(at - before);
    lifted.greatest = std::max(lifted.greatest, pull.norm());
    const double open = at.norm();
    const double exact = area * kLiftedBed.stiffness * kLiftedBed.left(open) * open;
    lifted.farthest_off = std::max(lifted.farthest_off, std::abs(pull.norm() - exact));
    before = at;
    pull_before = pull;
  }
  lifted.farthest_off /= lifted.greatest;
  return lifted;
}

}  // namespace viscera::test
