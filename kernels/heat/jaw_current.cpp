#include "kernels/heat/jaw_current.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "kernels/heat/current_field.h"

namespace viscera {
namespace {

/// Dried tissue still conducts this share of wet: some current always creeps.
constexpr double kLeastShare = 1e-3;
/// Of a voxel with less tissue nothing is kept; nearly all of one.
constexpr double kSomeTissue = 0.05, kAlmost = 1e-6;

/// The same, none wider than a voxel: squares beside each other.
std::vector<JawColumn> filaments_of(std::span<const JawColumn> columns, double voxel) {
  Vec3 along = Vec3::Zero();
  for (const JawColumn& column : columns) along += column.lower - column.upper;
  const Vec3 x = along.unitOrthogonal(), y = along.cross(x).normalized();
  std::vector<JawColumn> all;
  for (const JawColumn& column : columns) {
    const double side = std::sqrt(column.area);
    const int across = std::max(1, static_cast<int>(std::ceil(side / voxel)));
    for (int j = 0; j < across; ++j)
      for (int i = 0; i < across; ++i) {
        const Vec3 aside = side * (((i + 0.5) / across - 0.5) * x + ((j + 0.5) / across - 0.5) * y);
        all.push_back(
            {column.upper + aside, column.lower + aside, column.area / (across * across)});
      }
  }
  return all;
}

}  // namespace

Electrode electrode_of_jaws() {
  Electrode jaws;
  jaws.heat_capacity = 0.1;
  jaws.shaft_conductance = 2e-3;
  jaws.surface = 8e-5;
  return jaws;
}

JawCurrent::JawCurrent(Bioheat& heat, std::span<const JawColumn> columns, double gap) {
  const ThermalTissue& tissue = heat.tissue();
  const double body = heat.options().body;
  const double least = kLeastShare * electric_conductivity(tissue, 1.0, body);
  std::map<std::pair<HeatBrick*, int>, std::size_t> numbers;
  for (const JawColumn& column : filaments_of(columns, heat.options().voxel)) {
    const Vec3 way = column.lower - column.upper;
    const int count =
        std::max(1, static_cast<int>(std::ceil(2.0 * way.norm() / heat.options().voxel)));
    const double length = way.norm() / count;
    Column one{parts_.size(), parts_.size(), 0.0};
    double thick = 0.0;  // of tissue [m]
    for (int i = 0; i < count; ++i) {
      const Vec3 place = column.upper + (i + 0.5) / count * way;
      const BrickIndex voxel = heat.bricks().voxel_of(place);
      const BrickIndex index = BrickField::brick_of(voxel);
      HeatBrick* brick = heat.bricks().warm_up(index);
      if (!brick) continue;
      const BrickIndex local = voxel - index * HeatBricks::kEdge;
      const int at = local.x() + HeatBricks::kEdge * (local.y() + HeatBricks::kEdge * local.z());
      const double fraction = brick->geometry->fraction[at];
      if (fraction < kSomeTissue) continue;
      thick += fraction * length;
      const double kelvin = body + static_cast<double>(brick->warm->excess[at]);
      const double conducts =
          kelvin < CurrentField::kHottest
              ? electric_conductivity(tissue, static_cast<double>(brick->water[at]), kelvin)
              : 0.0;
      const auto [known, fresh] = numbers.try_emplace({brick, at}, voxels_.size());
      if (fresh) {
        const double latent = static_cast<double>(brick->water[at]) * tissue.density *
                              tissue.water_fraction * fraction * heat.voxel_volume() *
                              water::kLatentHeat;
        voxels_.push_back(
            {brick, at,
             heat.voxel_capacity(*brick, at) * std::max(0.0, CurrentField::kHottest - kelvin) +
                 latent});
      }
      parts_.push_back({known->second,
                        fraction * length / (column.area * std::max(least, conducts)),
                        fraction * column.area * length});
      one.resistance += parts_.back().resistance;
    }
    // What is thinner than the gap doesn't touch both jaws.
    if (!(thick > gap * (1.0 - kAlmost))) {
      parts_.resize(one.first);
      continue;
    }
    const double squeezed = gap / thick;
    one.last = parts_.size();
    for (std::size_t p = one.first; p < one.last; ++p) parts_[p].resistance *= squeezed * squeezed;
    one.resistance *= squeezed * squeezed;
    columns_.push_back(one);
  }
}

double JawCurrent::resistance() const {
  double conductance = 0.0;
  for (const Column& column : columns_) conductance += 1.0 / column.resistance;
  return conductance > 0.0 ? 1.0 / conductance : std::numeric_limits<double>::infinity();
}

double JawCurrent::coagulated() const {
  double all = 0.0, done = 0.0;
  for (const Part& part : parts_) {
    all += part.volume;
    const Voxel& voxel = voxels_[part.voxel];
    if (voxel.brick->coagulation[voxel.index] >= 1.0f) done += part.volume;
  }
  return all > 0.0 ? done / all : 0.0;
}

CurrentReport JawCurrent::pass(Bioheat& heat, const BipolarGenerator& generator, double power,
                               double dt) {
  CurrentReport report;
  if (columns_.empty()) {
    report.open = power > 0.0;
    return report;
  }
  const double resistance = this->resistance();
  const double asked = std::sqrt(power / resistance);
  const double by_voltage = generator.most_voltage / resistance;
  report.current = std::min({asked, by_voltage, generator.most_current});
  report.voltage = report.current * resistance;
  report.resistance = resistance;
  report.by_voltage = report.current < asked && by_voltage <= generator.most_current ? 1.0 : 0.0;
  report.by_current = report.current < asked && report.by_voltage == 0.0 ? 1.0 : 0.0;
  for (const Column& column : columns_) {
    const double current = report.voltage / column.resistance;
    for (std::size_t p = column.first; p < column.last; ++p)
      voxels_[parts_[p].voxel].power += current * current * parts_[p].resistance;
  }
  // Beyond its room nothing is left of a voxel but char: the rest goes off with steam and fumes.
  for (Voxel& voxel : voxels_) {
    const double asked_of = std::exchange(voxel.power, 0.0);
    const double taken = std::min(asked_of, voxel.room / dt);
    heat.heat_voxel(*voxel.brick, voxel.index, taken);
    report.power += taken;
    report.gas_power += asked_of - taken;
  }
  return report;
}

}  // namespace viscera
