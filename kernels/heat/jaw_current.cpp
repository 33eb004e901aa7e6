#include "kernels/heat/jaw_current.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/heat/current_field.h"

namespace viscera {
namespace {

/// Dried tissue still conducts this share of wet: some current always creeps.
constexpr double kLeastShare = 1e-3;

}  // namespace

Electrode electrode_of_jaws() {
  Electrode jaws;
  jaws.heat_capacity = 1.25;
  jaws.shaft_conductance = 1e-2;
  jaws.surface = 4e-4;
  return jaws;
}

JawCurrent::JawCurrent(Bioheat& heat, std::span<const JawColumn> columns, double squeezed) {
  const ThermalTissue& tissue = heat.tissue();
  const double body = heat.options().body;
  const double least = kLeastShare * electric_conductivity(tissue, 1.0, body);
  for (const JawColumn& column : columns) {
    const Vec3 way = column.lower - column.upper;
    const int count =
        std::max(1, static_cast<int>(std::ceil(2.0 * way.norm() / heat.options().voxel)));
    const double length = way.norm() / count;
    Column one{parts_.size(), parts_.size(), 0.0};
    for (int i = 0; i < count; ++i) {
      const Vec3 place = column.upper + (i + 0.5) / count * way;
      const BrickIndex voxel = heat.bricks().voxel_of(place);
      const BrickIndex index = BrickField::brick_of(voxel);
      HeatBrick* brick = heat.bricks().warm_up(index);
      if (!brick) continue;
      const BrickIndex local = voxel - index * HeatBricks::kEdge;
      const int at = local.x() + HeatBricks::kEdge * (local.y() + HeatBricks::kEdge * local.z());
      if (!(brick->geometry->fraction[at] > 0.0f)) continue;
      const double kelvin = body + static_cast<double>(brick->warm->excess[at]);
      const double conducts =
          kelvin < CurrentField::kHottest
              ? electric_conductivity(tissue, static_cast<double>(brick->water[at]), kelvin)
              : 0.0;
      parts_.push_back({brick, at,
                        squeezed * squeezed * length / (column.area * std::max(least, conducts)),
                        column.area * length});
      one.resistance += parts_.back().resistance;
    }
    one.last = parts_.size();
    if (one.last > one.first) columns_.push_back(one);
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
    if (part.brick->coagulation[part.voxel] >= 1.0f) done += part.volume;
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
    for (std::size_t p = column.first; p < column.last; ++p) {
      const Part& part = parts_[p];
      const double one = current * current * part.resistance;
      // Beyond this nothing is left to warm but char: it goes off with steam and fumes.
      if (heat.options().body + static_cast<double>(part.brick->warm->excess[part.voxel]) <
          CurrentField::kHottest) {
        heat.heat_voxel(*part.brick, part.voxel, one);
        report.power += one;
      } else {
        report.gas_power += one;
      }
    }
  }
  return report;
}

}  // namespace viscera
