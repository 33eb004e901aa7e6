// Monopolar current into tissue: what a generator drives through an electrode's contact, how it
// spreads, where it heats, and what the metal takes.
#pragma once

#include <cmath>

#include "kernels/heat/bioheat.h"

namespace viscera {

/// Waveforms by their two numbers that matter to heat. Open-circuit peaks and crest factors are
/// those of a common generator's pure cut, blend, desiccate and fulgurate. [R]
enum class CurrentMode { kCut, kBlend, kCoagulate, kFulgurate };

struct Waveform {
  double peak_voltage = 0.0;  ///< open circuit [V]
  double crest = 1.0;         ///< peak over root mean square; duty is about 2 / crest^2
  double greatest_voltage() const { return peak_voltage / crest; }  ///< root mean square [V]
};
Waveform waveform_of(CurrentMode mode);

/// Metal and how it conducts heat. A stainless wire 1 mm thick, 5 mm of it the tip. [R]
struct Electrode {
  double tip_radius = 0.5e-3;         ///< of its curvature where it touches [m]
  double heat_capacity = 1.55e-2;     ///< of the tip [J/K]
  double shaft_conductance = 1.3e-3;  ///< from the tip up the shaft [W/K]
  double contact_conductance = 5e3;   ///< between metal and tissue [W/(m2 K)]
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

/// The widest gap that a peak breaks through [m]: some 450 V for any gap and then 2.7 MV/m in
/// carbon dioxide near the atmosphere's pressure. [R]
double spark_gap(double peak_voltage);

/// What a step's current was; means over the step.
struct CurrentReport {
  double power = 0.0;        ///< into tissue that is heated [W]
  double far_power = 0.0;    ///< spread over the body beyond [W]
  double spark_power = 0.0;  ///< in sparks, through gas, steam and dried tissue [W]
  double current = 0.0;      ///< root mean square [A]
  double voltage = 0.0;      ///< root mean square [V]
  double resistance = 0.0;   ///< of contact and body [Ohm]
  double radius = 0.0;       ///< of the contact [m]
  bool open = false;         ///< power was asked for, and no tissue was near enough
  bool sparks = false;       ///< the metal doesn't touch
  bool limited = false;      ///< by the generator's voltage
  bool refused = false;      ///< power, place or time can't be; nothing happened

  static constexpr auto fields() {
    using C = CurrentReport;
    return std::tuple(field("power", &C::power), field("far_power", &C::far_power),
                      field("spark_power", &C::spark_power), field("current", &C::current),
                      field("voltage", &C::voltage), field("resistance", &C::resistance),
                      field("radius", &C::radius), field("open", &C::open),
                      field("sparks", &C::sparks), field("limited", &C::limited),
                      field("refused", &C::refused));
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

  explicit ElectrodeTip(const Electrode& electrode = {}) : electrode_(electrode) {}

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
  /// A step away from tissue.
  void cool(double dt);

 private:
  void trade_heat(Bioheat& heat, const ElectrodeContact& contact, double radius, double dt);

  Electrode electrode_;
  State state_;
};
static_assert(fields_cover<ElectrodeTip::State>());

}  // namespace viscera
