#include "kernels/heat/heat_room.h"

#include <algorithm>

namespace viscera {

HeatRoom heat_room(const Bioheat& heat, const HeatBrick& brick, int voxel) {
  const ThermalTissue& tissue = heat.tissue();
  const double edge = heat.voxel_volume();
  const float fraction = brick.geometry->fraction[voxel];
  HeatRoom room;
  room.kelvin = heat.options().body + static_cast<double>(brick.warm->excess[voxel]);
  room.capacity = heat.voxel_capacity(brick, voxel);
  room.to_boil = room.capacity * std::max(0.0, water::kBoiling - room.kelvin);
  room.latent = static_cast<double>(brick.water[voxel]) * tissue.density * tissue.water_fraction *
                fraction * edge * water::kLatentHeat;
  room.room = room.to_boil + room.latent +
              heat_capacity(tissue, 0.0, 1.0) * fraction * edge *
                  std::max(0.0, kHottest - std::max(room.kelvin, water::kBoiling));
  return room;
}

double heat_taken(const Bioheat& heat, const HeatBrick& brick, int voxel, double dt) {
  return static_cast<double>(brick.warm->source[voxel]) * heat.voxel_volume() * dt;
}

}  // namespace viscera
