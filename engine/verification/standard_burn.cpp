#include "engine/verification/standard_burn.h"

#include <cmath>

namespace viscera {
namespace {

constexpr double kFarthest = 15e-3;  // that temperatures are read [m]

}  // namespace

ThermalTissue muscle_outside() {
  ThermalTissue muscle;
  muscle.density = 1090.0;
  muscle.specific_heat = 3421.0;
  muscle.conductivity = 0.49;
  muscle.perfusion = muscle.metabolic_heat = 0.0;
  muscle.water_fraction = 0.76;
  muscle.electric_conductivity = 0.446;
  muscle.coagulation = {7.39e39, 2.577e5};
  return muscle;
}

double BurnResult::reach_of(double kelvin, double voxel) const {
  for (std::size_t i = 0; i < surface.size(); ++i) {
    if (surface[i] > kelvin) continue;
    const double before = i > 0 ? surface[i - 1] : kelvin;
    const double part = before > kelvin ? (before - kelvin) / (before - surface[i]) : 0.0;
    return (static_cast<double>(i) - 0.5 + part) * voxel;
  }
  return static_cast<double>(surface.size()) * voxel;
}

BurnResult make_burn(const StandardBurn& burn) {
  BioheatOptions options;
  options.voxel = burn.voxel;
  options.body = burn.rest;
  Bioheat heat(burn.tissue, options, [](const Vec3& p) { return p.z(); });
  Electrode ball;
  ball.tip_radius = burn.ball_radius;
  const bool two = burn.apart > 0.0;
  Generator generator;
  if (two) generator.body_resistance = 0.0;
  std::vector<ElectrodeTip> tips(two ? 2 : 1, ElectrodeTip(ball, generator));
  std::vector<ElectrodeContact> contacts(tips.size());
  for (ElectrodeContact& contact : contacts) contact.depth = burn.depth;
  contacts.front().point.x() -= 0.5 * burn.apart;
  contacts.back().point.x() += two ? 0.5 * burn.apart : 0.0;
  const ElectrodeContact& contact = contacts.front();
  BurnResult result;
  const int steps = static_cast<int>(std::lround(burn.seconds / burn.dt));
  for (int step = 0; step < steps; ++step) {
    BurnRow row;
    for (std::size_t t = tips.size(); t-- > 0;) {
      row.current = tips[t].energise(heat, burn.mode, burn.power / static_cast<double>(tips.size()),
                                     contacts[t], contacts[t], burn.dt);
      result.generated += row.current.generated() * burn.dt;
    }
    heat.step(burn.dt);
    row.time = (step + 1) * burn.dt;
    row.lesion = lesion_at(heat, contact.point, contact.outward);
    row.dead = lesion_at(heat, contact.point, contact.outward, LesionOf::kDead);
    row.greatest = heat.greatest_excess() + options.body;
    row.water = heat.vaporised_water();
    result.rows.push_back(row);
  }
  result.book = heat.book();
  result.warm_voxels = heat.warm_voxels();
  const int reach = static_cast<int>(std::ceil(kFarthest / burn.voxel));
  for (int x = 0; x < reach; ++x)
    result.surface.push_back(options.body + heat.bricks().excess_at({x, 0, -1}));
  for (int x = -reach; x < reach; ++x)
    for (int y = -reach; y < reach; ++y)
      if (options.body + heat.bricks().excess_at({x, y, -1}) > kCritical)
        result.warm_area += burn.voxel * burn.voxel;
  return result;
}

}  // namespace viscera
