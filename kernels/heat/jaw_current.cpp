#include "kernels/heat/jaw_current.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "kernels/heat/heat_room.h"

namespace viscera {
namespace {

/// Dried tissue still conducts this share of wet: some current always creeps.
constexpr double kLeastShare = 1e-3;
/// Of a voxel with less tissue nothing is kept; a filament of which so much is tissue is as long as
/// its column; nearly all of one.
constexpr double kSomeTissue = 0.05, kInside = 0.7, kAlmost = 1e-6;
/// Filaments are as wide as a voxel, or wider where they would be more than this.
constexpr double kMostFilaments = 4096.0;

/// Squares beside each other that the columns consist of.
std::vector<JawColumn> filaments_of(std::span<const JawColumn> columns, double voxel) {
  Vec3 along = Vec3::Zero();
  double area = 0.0;
  for (const JawColumn& column : columns) {
    along += column.lower - column.upper;
    area += column.area;
  }
  const double wide = std::max(voxel, std::sqrt(area / kMostFilaments));
  const Vec3 x = along.unitOrthogonal(), y = along.cross(x).normalized();
  std::vector<JawColumn> all;
  for (const JawColumn& column : columns) {
    const double side = std::sqrt(column.area);
    const int across = std::max(1, static_cast<int>(std::ceil(side / wide)));
    for (int j = 0; j < across; ++j)
      for (int i = 0; i < across; ++i) {
        const Vec3 aside = side * (((i + 0.5) / across - 0.5) * x + ((j + 0.5) / across - 0.5) * y);
        all.push_back(
            {column.upper + aside, column.lower + aside, column.area / (across * across)});
      }
  }
  return all;
}

/// Visits the places along a filament, half a voxel apart at most: (voxel, length [m]).
template <class Visit>
void along(const JawColumn& filament, const Bioheat& heat, const Visit& visit) {
  const Vec3 way = filament.lower - filament.upper;
  const int count =
      std::max(1, static_cast<int>(std::ceil(2.0 * way.norm() / heat.options().voxel)));
  for (int i = 0; i < count; ++i)
    visit(heat.bricks().voxel_of(filament.upper + (i + 0.5) / count * way), way.norm() / count);
}

void warm_up(std::span<const JawColumn> filaments, Bioheat& heat) {
  std::vector<BrickIndex> wanted;
  for (const JawColumn& filament : filaments)
    along(filament, heat, [&](const BrickIndex& voxel, double) {
      const BrickIndex brick = BrickField::brick_of(voxel);
      if (wanted.empty() || wanted.back() != brick) wanted.push_back(brick);
    });
  const auto before = [](const BrickIndex& a, const BrickIndex& b) {
    return std::tuple(a.z(), a.y(), a.x()) < std::tuple(b.z(), b.y(), b.x());
  };
  std::ranges::sort(wanted, before);
  wanted.erase(std::unique(wanted.begin(), wanted.end()), wanted.end());
  heat.bricks().warm_up(wanted);
}

}  // namespace

Electrode electrode_of_jaws() {
  Electrode jaws;
  jaws.heat_capacity = 0.1;
  jaws.shaft_conductance = 2e-3;
  jaws.surface = 8e-5;
  return jaws;
}

double coagulated_between(const Bioheat& heat, std::span<const JawColumn> columns) {
  double all = 0.0, done = 0.0;
  for (const JawColumn& filament : filaments_of(columns, heat.options().voxel))
    along(filament, heat, [&](const BrickIndex& voxel, double length) {
      const BrickIndex index = BrickField::brick_of(voxel);
      const HeatBrick* brick = heat.bricks().find(index);
      const int at = BrickField::place_in_brick(voxel, index);
      // Where nothing was ever warm, all is sound; of tissue or not isn't known there.
      const double fraction = brick ? static_cast<double>(brick->geometry->fraction[at]) : 1.0;
      all += fraction * filament.area * length;
      if (brick && brick->coagulation[at] >= 1.0f) done += fraction * filament.area * length;
    });
  return all > 0.0 ? done / all : 0.0;
}

JawCurrent::JawCurrent(Bioheat& heat, std::span<const JawColumn> columns, double gap) {
  const ThermalTissue& tissue = heat.tissue();
  const double body = heat.options().body;
  const double least = kLeastShare * electric_conductivity(tissue, 1.0, body);
  const std::vector<JawColumn> filaments = filaments_of(columns, heat.options().voxel);
  warm_up(filaments, heat);
  for (const JawColumn& filament : filaments) {
    Column one{parts_.size(), parts_.size(), 0.0};
    double thick = 0.0;  // of tissue [m]
    along(filament, heat, [&](const BrickIndex& voxel, double length) {
      const BrickIndex index = BrickField::brick_of(voxel);
      HeatBrick* brick = heat.bricks().warm_up(index);
      const int at = BrickField::place_in_brick(voxel, index);
      if (!brick || brick->geometry->fraction[at] < kSomeTissue) return;
      const double share = static_cast<double>(brick->geometry->fraction[at]) * length;
      const double kelvin = body + static_cast<double>(brick->warm->excess[at]);
      const double conducts =
          kelvin < kHottest
              ? electric_conductivity(tissue, static_cast<double>(brick->water[at]), kelvin)
              : 0.0;
      thick += share;
      parts_.push_back({brick, at, share / (filament.area * std::max(least, conducts))});
      one.resistance += parts_.back().resistance;
    });
    const double whole = (filament.lower - filament.upper).norm();
    const double stretched = thick > kInside * whole ? whole / thick : 1.0;
    thick *= stretched;
    // What is thinner than the gap doesn't touch both jaws.
    if (!(thick > gap * (1.0 - kAlmost))) {
      parts_.resize(one.first);
      continue;
    }
    one.last = parts_.size();
    const double squeezed = (gap / thick) * (gap / thick) * stretched;
    for (std::size_t p = one.first; p < one.last; ++p) parts_[p].resistance *= squeezed;
    one.resistance *= squeezed;
    columns_.push_back(one);
  }
}

double JawCurrent::resistance() const {
  double conductance = 0.0;
  for (const Column& column : columns_) conductance += 1.0 / column.resistance;
  return conductance > 0.0 ? 1.0 / conductance : std::numeric_limits<double>::infinity();
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
      const double asked_of = current * current * part.resistance;
      // Beyond its room nothing is left of a voxel but char: that goes off with steam and fumes.
      const double left = heat_room(heat, *part.brick, part.voxel).room -
                          heat_taken(heat, *part.brick, part.voxel, dt);
      const double taken = std::min(asked_of, std::max(0.0, left) / dt);
      heat.heat_voxel(*part.brick, part.voxel, taken);
      report.power += taken;
      report.gas_power += asked_of - taken;
    }
  }
  return report;
}

}  // namespace viscera
