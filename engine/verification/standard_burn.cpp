#include "engine/verification/standard_burn.h"

#include <cmath>

namespace viscera {

BurnResult make_burn(const StandardBurn& burn) {
  BioheatOptions options;
  options.voxel = burn.voxel;
  Bioheat heat(burn.tissue, options, [](const Vec3& p) { return p.z(); });
  Electrode ball;
  ball.tip_radius = burn.ball_radius;
  ElectrodeTip tip(ball);
  ElectrodeContact contact;
  contact.depth = burn.depth;
  BurnResult result;
  const int steps = static_cast<int>(std::lround(burn.seconds / burn.dt));
  for (int step = 0; step < steps; ++step) {
    BurnRow row;
    row.current = tip.energise(heat, burn.mode, burn.power, contact, contact, burn.dt);
    heat.step(burn.dt);
    row.time = (step + 1) * burn.dt;
    row.lesion = lesion_at(heat, contact.point, contact.outward);
    row.greatest = heat.greatest_excess() + options.body;
    row.water = heat.vaporised_water();
    result.generated +=
        (row.current.power + row.current.far_power + row.current.spark_power) * burn.dt;
    result.rows.push_back(row);
  }
  result.book = heat.book();
  result.warm_voxels = heat.warm_voxels();
  return result;
}

}  // namespace viscera
