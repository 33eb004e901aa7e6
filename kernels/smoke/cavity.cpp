#include "kernels/smoke/cavity.h"

#include <algorithm>
#include <cmath>

namespace viscera {
namespace {

constexpr double kDischarge = 0.61;  // Cd of a sharp-edged hole, recalled
/// The insufflator is as quick as it has to be; evacuators have lost their gas where the pressure
/// is that far under atmosphere's. Chosen by eye.
constexpr double kRestored = 0.1;     // [s]
constexpr double kCollapsed = 133.3;  // [Pa]
/// The wall lies on the organs where it would hold less than this share.
constexpr double kLeastVolume = 0.05;
constexpr double kLowest = -10e3, kHighest = 50e3;  // [Pa]

}  // namespace

Cavity::Cavity(const CavityParameters& parameters) : parameters_(parameters) {
  state_.gas = parameters.volume;
  state_.pressure = state_.least = state_.greatest = parameters.set_pressure;
}

bool Cavity::fits(const State& state) const {
  return std::isfinite(state.gas) && state.gas > 0.0 && std::isfinite(state.pressure) &&
         state.pressure >= kLowest && state.pressure <= kHighest &&
         std::isfinite(state.insufflation) && std::isfinite(state.drawn) &&
         std::ranges::all_of(state.leaks, [](double flow) { return std::isfinite(flow); });
}

/// Volume at a pressure -> as the book counts.
double Cavity::scale(double pressure) const {
  return (gas::kAtmosphere + pressure) / (gas::kAtmosphere + parameters_.set_pressure);
}

double Cavity::volume_at(double pressure) const {
  const double yielded = parameters_.compliance * (pressure - parameters_.set_pressure);
  return std::max(parameters_.volume + yielded, kLeastVolume * parameters_.volume);
}

double Cavity::volume() const {
  return volume_at(state_.pressure);
}

double Cavity::leak(double area, double pressure) const {
  // Out the cavity's gas, in air of its temperature.
  const double carbon_dioxide = parameters_.mixture.density();
  const double air = 1.0 / parameters_.mixture.volume_of(gas::kAirMolarMass);
  const double density = pressure > 0.0 ? carbon_dioxide : air;
  return std::copysign(kDischarge * area * std::sqrt(2.0 * std::abs(pressure) / density), pressure);
}

Cavity::Flows Cavity::flows(const Demand& demand, double pressure) const {
  const double yields =
      parameters_.compliance + parameters_.volume / (gas::kAtmosphere + parameters_.set_pressure);
  const double wanted = yields * (parameters_.set_pressure - pressure) / kRestored;
  const double drawn = std::clamp(1.0 + pressure / kCollapsed, 0.0, 1.0);
  return {std::clamp(wanted, 0.0, demand.insufflator), drawn * demand.evacuators, drawn};
}

void Cavity::step(const Demand& demand, double dt) {
  if (!(dt > 0.0) || !std::isfinite(dt)) return;
  const auto balance = [&](double pressure) {
    const Flows now = flows(demand, pressure);
    double in = now.insufflation - now.evacuation + demand.swelling;
    for (const double area : demand.leaks) in -= leak(area, pressure);
    return in * scale(pressure) * dt;
  };
  // What is there at a pressure over what came to be there by it rises with the pressure.
  double low = kLowest, high = kHighest;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    const double over = volume_at(middle) * scale(middle) - (state_.gas + balance(middle));
    (over > 0.0 ? high : low) = middle;
  }
  const double pressure = state_.pressure = 0.5 * (low + high);
  const Flows now = flows(demand, pressure);
  const double counted = scale(pressure) * dt;
  state_.insufflation = now.insufflation;
  state_.drawn = now.drawn;
  CavityBook& book = state_.book;
  book.insufflated += now.insufflation * counted;
  book.evacuated += now.evacuation * counted;
  book.swollen += demand.swelling * counted;
  double out = 0.0;
  state_.leaks.resize(demand.leaks.size());
  for (std::size_t i = 0; i < demand.leaks.size(); ++i) {
    const double flow = state_.leaks[i] = leak(demand.leaks[i], pressure);
    (flow > 0.0 ? book.leaked : book.air) += std::abs(flow) * counted;
    out += flow;
  }
  state_.gas += (now.insufflation - now.evacuation + demand.swelling - out) * counted;
  state_.least = std::min(state_.least, pressure);
  state_.greatest = std::max(state_.greatest, pressure);
}

}  // namespace viscera
