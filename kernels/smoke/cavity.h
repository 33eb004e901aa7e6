// The cavity that gas holds open: one pressure in all of it, a wall that yields to it, what keeps
// the pressure and what lets gas go.
//
// Amounts of gas are counted as volumes V at the set pressure and the resting temperature. With
// pressures over atmosphere's, p0, and a wall that yields by the same volume to each pascal,
//   (p0 + p) (V_set + C (p - p_set)) = (p0 + p_set) V.
// A leak is a sharp-edged hole: Q = Cd A sqrt(2 |p| / rho), of the cavity's gas out or of air in.
// An evacuator draws what it is set to, until the wall is drawn onto its tip. The insufflator lets
// in what restores the pressure within kRestored, up to its limit.
#pragma once

#include <span>
#include <vector>

#include "kernels/base/fields.h"
#include "kernels/smoke/gas_mixture.h"

namespace viscera {

struct CavityParameters {
  GasMixture mixture;
  double set_pressure = 1600.0;  ///< over atmosphere [Pa]
  double volume = 3e-3;          ///< of gas at that pressure [m3]
  /// Of the wall [m3/Pa]: 1.27 L over the first 12 mmHg [Song2006].
  double compliance = 1.27e-3 / 1600.0;
};

/// Volumes at the set pressure and the resting temperature [m3].
///   at first + insufflated + swollen + air = now + evacuated + leaked.
struct CavityBook {
  double insufflated = 0.0;
  double swollen = 0.0;  ///< by what boils and what warms
  double air = 0.0;      ///< that came in through leaks
  double evacuated = 0.0, leaked = 0.0;

  static constexpr auto fields() {
    using B = CavityBook;
    return std::tuple(field("insufflated", &B::insufflated), field("swollen", &B::swollen),
                      field("air", &B::air), field("evacuated", &B::evacuated),
                      field("leaked", &B::leaked));
  }
};
static_assert(fields_cover<CavityBook>());

class Cavity {
 public:
  struct State {
    double gas = 0.0;       ///< volume [m3], as the book counts
    double pressure = 0.0;  ///< over atmosphere [Pa]
    CavityBook book;
    // Of the last step.
    double insufflation = 0.0;           ///< in, at the cavity's pressure [m3/s]
    double drawn = 1.0;                  ///< what evacuators get of what they are set to [1]
    std::vector<double> leaks;           ///< out; negative: air in [m3/s]
    double least = 0.0, greatest = 0.0;  ///< pressure so far [Pa]

    static constexpr auto fields() {
      using S = State;
      return std::tuple(field("gas", &S::gas), field("pressure", &S::pressure),
                        field("book", &S::book), field("insufflation", &S::insufflation),
                        field("drawn", &S::drawn), field("leaks", &S::leaks),
                        field("least", &S::least), field("greatest", &S::greatest));
    }
  };
  /// What a step asks of it.
  struct Demand {
    double insufflator = 0.0;            ///< the most that it lets in [m3/s]
    double evacuators = 0.0;             ///< what they are set to [m3/s]
    std::span<const double> leaks = {};  ///< areas [m2]
    double swelling = 0.0;               ///< of gas that is warmed or boils [m3/s]
  };

  /// At its set pressure.
  explicit Cavity(const CavityParameters& parameters);

  const State& state() const { return state_; }
  bool fits(const State& state) const;
  void restore(State state) { state_ = std::move(state); }
  const CavityParameters& parameters() const { return parameters_; }

  /// Advances by dt [s], implicit: stable for any.
  void step(const Demand& demand, double dt);
  double pressure() const { return state_.pressure; }  ///< over atmosphere [Pa]
  double volume() const;                               ///< now, at that pressure [m3]
  /// Out of a hole of that area at a pressure over atmosphere; negative: air in [m3/s].
  double leak(double area, double pressure) const;

 private:
  struct Flows {
    double insufflation, evacuation, drawn;
  };
  Flows flows(const Demand& demand, double pressure) const;
  double volume_at(double pressure) const;
  double scale(double pressure) const;

  CavityParameters parameters_;
  State state_;
};
static_assert(StateOwner<Cavity> && fields_cover<Cavity::State>());

}  // namespace viscera
