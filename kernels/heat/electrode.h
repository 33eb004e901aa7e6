// Monopolar current into tissue: what a generator drives through an electrode's contact, how it
// spreads, where it heats, and what the metal takes.
#pragma once

#include <cmath>

#include "kernels/heat/bioheat.h"
#include "kernels/heat/generator.h"

namespace viscera {

/// Metal and how it conducts heat. A stainless wire 1 mm thick, 5 mm of it the tip. [R]
struct Electrode {
  double tip_radius = 0.5e-3;         ///< of its curvature where it touches [m]
  double heat_capacity = 1.55e-2;     ///< of the tip [J/K]
  double shaft_conductance = 1.3e-3;  ///< from the tip up the shaft [W/K]
  double contact_conductance = 5e3;   ///< between metal and tissue [W/(m2 K)]
  double surface = 1.6e-5;            ///< of the tip, by which it cools in the gas [m2]
  double gas_transfer = 40.0;         ///< to the gas about a thin wire [W/(m2 K)]
  double emissivity = 0.8;            ///< of oxidised steel
};

/// Every value that can't be, by its name.
Result<void> check(const Electrode& electrode, double power);

/// Where the metal is to the tissue; in the organ's rest frame.
struct ElectrodeContact {
  Vec3 point = Vec3::Zero();     ///< of the tissue's surface nearest to the metal [m]
  Vec3 outward = Vec3::UnitZ();  ///< unit, away from the tissue
  double depth = 0.0;            ///< the metal presses in; negative: a gap [m]
  double area = 0.0;             ///< of touch [m2]; 0: from the tip's curvature and the depth

  static constexpr auto fields() {
    using E = ElectrodeContact;
    return std::tuple(field("point", &E::point), field("outward", &E::outward),
                      field("depth", &E::depth), field("area", &E::area));
  }
};
static_assert(fields_cover<ElectrodeContact>());

/// Radius of the disc through which current enters [m]; 0: none does. Where the metal doesn't
/// touch, sparks reach over the part of the tip that is near enough for `peak_voltage`.
double contact_radius(const Electrode& electrode, const ElectrodeContact& contact,
                      double peak_voltage);

/// What a step's current was; means over the step. What the generator gave is found again to
/// rounding: see generated().
struct CurrentReport {
  double power = 0.0;        ///< into tissue that is heated, by current and by sparks [W]
  double spark_power = 0.0;  ///< of that, by sparks from the gap [W]
  double body_power = 0.0;   ///< in the rest of the body and under the return pad [W]
  double metal_power = 0.0;  ///< of sparks, into the tip [W]
  /// Into gas, steam and fumes: sparks' columns, and what no tissue was left to take [W].
  double gas_power = 0.0;
  double current = 0.0;     ///< root mean square [A]
  double voltage = 0.0;     ///< of the generator, root mean square [V]
  double resistance = 0.0;  ///< voltage over current, of all that the generator sees [Ohm]
  double radius = 0.0;      ///< of the contact [m]
  double by_current = 0.0;  ///< share of the step in which the generator's current limited it
  double by_voltage = 0.0;  ///< and its voltage
  bool open = false;        ///< power was asked for, and no tissue was near enough
  bool sparks = false;      ///< the metal doesn't touch
  bool refused = false;     ///< power, place or time can't be; nothing happened

  double generated() const { return power + body_power + metal_power + gas_power; }  ///< [W]

  static constexpr auto fields() {
    using C = CurrentReport;
    return std::tuple(field("power", &C::power), field("spark_power", &C::spark_power),
                      field("body_power", &C::body_power), field("metal_power", &C::metal_power),
                      field("gas_power", &C::gas_power), field("current", &C::current),
                      field("voltage", &C::voltage), field("resistance", &C::resistance),
                      field("radius", &C::radius), field("by_current", &C::by_current),
                      field("by_voltage", &C::by_voltage), field("open", &C::open),
                      field("sparks", &C::sparks), field("refused", &C::refused));
  }
};
static_assert(fields_cover<CurrentReport>());

/// An electrode in use: its tip's own warmth lasts from step to step.
class ElectrodeTip {
 public:
  struct State {
    double excess = 0.0;  ///< of the tip over body temperature [K]
    static constexpr auto fields() { return std::tuple(field("excess", &State::excess)); }
  };

  explicit ElectrodeTip(const Electrode& electrode = {}, const Generator& generator = {})
      : electrode_(electrode), generator_(generator) {}

  const State& state() const { return state_; }
  void restore(State state) { state_ = state; }
  bool fits(const State& state) const { return std::isfinite(state.excess); }

  const Electrode& electrode() const { return electrode_; }
  double excess() const { return state_.excess; }  ///< of the tip over body temperature [K]

  /// Current at `power` [W] during the step of dt that follows, while the contact moves from `from`
  /// to `to`: heats the tissue (heat.step then spreads it) and trades warmth with the metal. With
  /// power 0 only the latter. Call it once a step for each tip on an organ.
  CurrentReport energise(Bioheat& heat, CurrentMode mode, double power,
                         const ElectrodeContact& from, const ElectrodeContact& to, double dt);
  /// Warmth between metal and the tissue under a disc of this radius [m], during dt.
  void trade_heat(Bioheat& heat, const ElectrodeContact& contact, double radius, double dt);
  /// A step away from tissue: up the shaft, to the gas, and by radiation.
  void cool(double dt);

 private:
  Electrode electrode_;
  Generator generator_;
  State state_;
};
static_assert(fields_cover<ElectrodeTip::State>());

}  // namespace viscera
