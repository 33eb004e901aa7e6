// What an electrosurgical generator gives: its waveforms, its limits, and the sparks in its
// circuit.
#pragma once

#include <numbers>

namespace viscera {

/// Waveforms by their two numbers that matter to heat. Open-circuit peaks and crest factors are
/// those of a common generator's pure cut, blend, desiccate and fulgurate. [R]
enum class CurrentMode { kCut, kBlend, kCoagulate, kFulgurate };

/// A sine in bursts: on for a share of the time, off for the rest.
struct Waveform {
  double peak_voltage = 0.0;           ///< open circuit [V]
  double crest = std::numbers::sqrt2;  ///< peak over root mean square

  double greatest_voltage() const { return peak_voltage / crest; }  ///< root mean square [V]
  /// Share of the time that the bursts take. Within one the root mean square is the peak over the
  /// root of two, so over all of the time the peak times the root of half the duty.
  double duty() const { return 2.0 / (crest * crest); }
  /// Mean of the current's size over its root mean square. Within a burst it is 2 / pi of the peak.
  double mean_share() const { return 4.0 / (std::numbers::pi * crest); }
};
Waveform waveform_of(CurrentMode mode);

/// What the current meets besides the tissue, and where the generator stops. [R]
struct Generator {
  double body_resistance = 100.0;  ///< of the body and the return pad, at 500 kHz, 50 to 150 [Ohm]
  /// Below this load the current is held at what makes the power there, 64 to 100 for cut [Ohm].
  /// The Valleylab Force FX-8C does so in its cutting modes [Valleylab2000]; taken for all.
  double least_load = 100.0;
};

/// The widest gap that a peak breaks through [m]: some 450 V for any gap and then 2.7 MV/m in
/// carbon dioxide near the atmosphere's pressure. [R]
double spark_gap(double peak_voltage);

/// What a burning spark keeps of the voltage, whatever its current: where it ends on the metal and
/// on the tissue, and along its column [V]. There the energy goes, too.
struct SparkDrop {
  double metal = 0.0, tissue = 0.0, column = 0.0;
  double whole() const { return metal + tissue + column; }
};
/// Across a gap [m]. Sparks of electrosurgery are glow discharges that go out and burn again with
/// every half of a wave, of up to 1000 A/cm2 in a column of 1 to 2 S/cm [Shashurin2015]: some
/// 70 V/mm [A]. Each end is the cathode for half of the time, with a fall of some 300 V then and
/// next to none as the anode [R].
SparkDrop spark_drop(double gap);

/// What flows.
struct GeneratorOutput {
  enum class Limit { kPower, kCurrent, kVoltage };
  double current = 0.0;         ///< root mean square [A]
  double voltage = 0.0;         ///< root mean square [V]
  Limit limit = Limit::kPower;  ///< what kept it from more
};
/// Through `resistance` [Ohm], all of it, and a spark in series, of generator set to `power` [W].
/// A spark's drop has the sign of its current, so its power is the drop times the mean of the
/// current's size, and the peak of the voltage is the sum of both peaks.
GeneratorOutput output_of(const Generator& generator, const Waveform& wave, double power,
                          double resistance, double drop);

}  // namespace viscera
