#include "kernels/heat/electrode.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "kernels/heat/current_field.h"

namespace viscera {
namespace {

constexpr double kPi = std::numbers::pi;
/// A moist tip that just touches draws a meniscus: current has this much to go through [m].
constexpr double kLeastRadius = 0.2e-3;
/// Gas and steam in a dried layer are hot, some 800 K: so much thinner than in the gap, and broken
/// through over so much further (Paschen). [R]
constexpr double kThinGas = 2.5;
constexpr double kMostPower = 500.0;        // of any generator [W]
constexpr double kRadiation = 5.670374e-8;  // Stefan and Boltzmann's [W/(m2 K4)]
constexpr double kBody = kZeroCelsius + 37.0;
constexpr int kMostPlaces = 6;  // along the way of one step
constexpr int kMostParts = 64;  // of the time at one place, as tissue dries

bool usable(const ElectrodeContact& contact) {
  return contact.point.allFinite() && contact.outward.allFinite() &&
         std::abs(contact.outward.norm() - 1.0) < 1e-3 && std::isfinite(contact.depth) &&
         contact.area >= 0.0 && std::isfinite(contact.area);
}

ElectrodeContact between(const ElectrodeContact& from, const ElectrodeContact& to, double t) {
  ElectrodeContact contact;
  contact.point = from.point + t * (to.point - from.point);
  const Vec3 outward = from.outward + t * (to.outward - from.outward);
  contact.outward = outward.norm() > 1e-6 ? outward.normalized() : to.outward;
  contact.depth = from.depth + t * (to.depth - from.depth);
  contact.area = from.area + t * (to.area - from.area);
  return contact;
}

}  // namespace

Result<void> check(const Electrode& electrode, double power) {
  Error error;
  const auto within = [&](const char* name, double value, double low, double high) {
    if (!(value >= low && value <= high))
      error.messages.push_back(std::string(name) + ": expected " + std::to_string(low) + " to " +
                               std::to_string(high) + ", found " + std::to_string(value));
  };
  within("power [W]", power, 0.0, kMostPower);
  within("radius of the tip [m]", electrode.tip_radius, 1e-5, 1e-2);
  within("heat capacity of the tip [J/K]", electrode.heat_capacity, 1e-6, 10.0);
  within("conductance of the shaft [W/K]", electrode.shaft_conductance, 0.0, 10.0);
  within("contact conductance [W/(m2 K)]", electrode.contact_conductance, 0.0, 1e6);
  within("surface of the tip [m2]", electrode.surface, 0.0, 1e-2);
  within("transfer from the tip to the gas [W/(m2 K)]", electrode.gas_transfer, 0.0, 1e4);
  within("emissivity of the tip", electrode.emissivity, 0.0, 1.0);
  if (!error.messages.empty()) return std::unexpected(error);
  return {};
}

double contact_radius(const Electrode& electrode, const ElectrodeContact& contact,
                      double peak_voltage) {
  if (contact.area > 0.0) return std::max(kLeastRadius, std::sqrt(contact.area / kPi));
  const double tip = electrode.tip_radius;
  // A ball through a plane, at most half in.
  const auto cap = [&](double depth) {
    const double in = std::min(depth, tip);
    return std::sqrt(in * (2.0 * tip - in));
  };
  if (contact.depth >= 0.0) return std::max(kLeastRadius, cap(contact.depth));
  const double spare = spark_gap(peak_voltage) + contact.depth;
  return spare > 0.0 ? std::max(kLeastRadius, cap(spare)) : 0.0;
}

CurrentReport ElectrodeTip::energise(Bioheat& heat, CurrentMode mode, double power,
                                     const ElectrodeContact& from, const ElectrodeContact& to,
                                     double dt) {
  CurrentReport report;
  if (!(power >= 0.0 && power <= kMostPower) || !(dt > 0.0) || !std::isfinite(dt) ||
      !usable(from) || !usable(to)) {
    report.refused = true;
    return report;
  }
  const Waveform wave = waveform_of(mode);
  const double radius = contact_radius(electrode_, to, wave.peak_voltage);
  report.radius = radius;
  report.sparks = to.area <= 0.0 && to.depth < 0.0 && radius > 0.0;
  report.open = power > 0.0 && radius <= 0.0;
  if (power > 0.0 && radius > 0.0) {
    const double way = (to.point - from.point).norm();
    const int places = std::clamp(static_cast<int>(std::ceil(2.0 * way / radius)), 1, kMostPlaces);
    const SparkDrop drop = report.sparks ? spark_drop(-to.depth) : SparkDrop{};
    double currents = 0.0, voltages = 0.0;  // squares
    for (int p = 0; p < places; ++p) {
      const ElectrodeContact at = between(from, to, (p + 0.5) / places);
      CurrentField field(heat, at.point, at.outward, radius,
                         kThinGas * spark_gap(wave.peak_voltage), dt);
      if (!field.any_tissue()) {
        report.open = true;
        continue;
      }
      // The tip is at each place for its part of the step.
      const double least = dt / (places * kMostParts);
      for (double left = dt / places; left > 0.0;) {
        const double beyond = field.far_resistance() + generator_.body_resistance;
        const GeneratorOutput output =
            output_of(generator_, wave, power, field.near_resistance() + beyond, drop.whole());
        const double size = output.current * wave.mean_share();  // mean of the current's
        const double lasts = std::max(least, field.lasts(output.current, drop.tissue * size));
        const double time = lasts < left - least ? lasts : left;
        const double part = time / dt;
        const CurrentField::Heating given =
            field.heat_with(heat, output.current, time, drop.tissue * size);
        report.power += given.tissue / dt;
        report.spark_power += given.sparks / dt;
        report.body_power += output.current * output.current * beyond * part;
        report.metal_power += drop.metal * size * part;
        report.gas_power += given.gas / dt + drop.column * size * part;
        report.by_current += output.limit == GeneratorOutput::Limit::kCurrent ? part : 0.0;
        report.by_voltage += output.limit == GeneratorOutput::Limit::kVoltage ? part : 0.0;
        currents += output.current * output.current * part;
        voltages += output.voltage * output.voltage * part;
        left -= time;
        if (left > 0.0) field.follow(heat.tissue());
      }
    }
    report.current = std::sqrt(currents);
    report.voltage = std::sqrt(voltages);
    if (report.current > 0.0) report.resistance = report.voltage / report.current;
    state_.excess += report.metal_power * dt / electrode_.heat_capacity;
  }
  // Sparks don't carry the metal's warmth.
  if (!report.sparks && radius > 0.0) trade_heat(heat, to, radius, dt);
  cool(dt);
  return report;
}

void ElectrodeTip::cool(double dt) {
  const double hot = kBody + state_.excess;
  const double radiation = electrode_.emissivity * kRadiation * (hot * hot + kBody * kBody) *
                           (hot + kBody);  // exact for the difference [W/(m2 K)]
  const double conductance =
      electrode_.shaft_conductance + electrode_.surface * (electrode_.gas_transfer + radiation);
  state_.excess *= std::exp(-dt * conductance / electrode_.heat_capacity);
}

// Each spot of the contact in turn: two bodies that even out, exactly, so no step is too long.
void ElectrodeTip::trade_heat(Bioheat& heat, const ElectrodeContact& contact, double radius,
                              double dt) {
  constexpr int kAcross = 5;
  const Vec3 side = contact.outward.unitOrthogonal();
  const Vec3 other = contact.outward.cross(side);
  struct Spot {
    HeatBrick* brick;
    int voxel;
  };
  std::vector<Spot> spots;
  for (int j = 0; j < kAcross; ++j) {
    for (int i = 0; i < kAcross; ++i) {
      const double x = (2.0 * i + 1.0) / kAcross - 1.0, y = (2.0 * j + 1.0) / kAcross - 1.0;
      if (x * x + y * y > 1.0) continue;
      const Vec3 at = contact.point + radius * (x * side + y * other) -
                      0.5 * heat.options().voxel * contact.outward;
      const BrickIndex voxel = heat.bricks().voxel_of(at);
      const BrickIndex index = BrickField::brick_of(voxel);
      const HeatBrick* found = heat.bricks().find(index);
      // A cold tip on cold tissue warms nothing up.
      if (!(found && found->warm) && state_.excess < heat.options().followed) continue;
      HeatBrick* brick = heat.bricks().warm_up(index);
      if (!brick) continue;
      const int at_voxel = BrickField::place_in_brick(voxel, index);
      if (brick->geometry->fraction[at_voxel] > 0.0f) spots.push_back({brick, at_voxel});
    }
  }
  if (spots.empty()) return;
  const double each =
      electrode_.contact_conductance * kPi * radius * radius / static_cast<double>(spots.size());
  for (const Spot& spot : spots) {
    const double tissue = heat.voxel_capacity(*spot.brick, spot.voxel);
    const double both = 1.0 / (1.0 / tissue + 1.0 / electrode_.heat_capacity);
    const double difference = spot.brick->warm->excess[spot.voxel] - state_.excess;
    const double energy = difference * both * -std::expm1(-each * dt / both);
    heat.draw_from_voxel(*spot.brick, spot.voxel, energy);
    state_.excess += energy / electrode_.heat_capacity;
  }
}

}  // namespace viscera
