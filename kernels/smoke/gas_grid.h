// The gas of an insufflated cavity: a coarse incompressible flow on a staggered (MAC) grid
// [Harlow1965], with organs and wall as solid cells. It carries smoke, and smoke drives it.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "kernels/base/fields.h"
#include "kernels/base/result.h"
#include "kernels/smoke/gas_advection.h"
#include "kernels/smoke/gas_layout.h"
#include "kernels/smoke/gas_points.h"
#include "kernels/smoke/gas_pressure.h"
#include "kernels/smoke/gas_sources.h"
#include "kernels/smoke/gas_stencils.h"
#include "kernels/smoke/gas_viscosity.h"

namespace viscera {

struct GasParameters {
  Box domain;                            ///< world [m]
  int cells = 32;                        ///< along the longest axis; near cubes along the others
  double density = 1.76;                 ///< [kg/m3] (CO2 at 12 mmHg and 37 C)
  double kinematic_viscosity = 8.75e-6;  ///< [m2/s]
  double eddy_viscosity = 5e-6;          ///< added to it: eddies smaller than a cell [m2/s]
  bool no_slip = true;                   ///< at solids and closed sides, or gas slides along them
  /// Sides (-x, +x, -y, +y, -z, +z) open to gas at rest at the outside's pressure; others are
  /// walls.
  std::array<bool, 6> open{};
  double tolerance = 1e-4;    ///< of the divergence, relative (GasReport::divergence)
  double most_speed = 100.0;  ///< faster gas is slowed to this, and counted [m/s]
  double rest_speed = 1e-5;   ///< gas that nothing drives and that is slower has come to rest [m/s]
};

/// What is wrong with the parameters, each mistake in a line.
Result<void> check_gas(const GasParameters& parameters);

/// Of one step. Flows [m3/s] balance: inlets + displaced = evacuators + leaks + sides +
/// compression.
struct GasReport {
  bool moved = false;          ///< false: at rest, nothing was done, the rest is 0
  int iterations = 0;          ///< of the pressure
  bool converged = true;       ///< the pressure, to the tolerance
  double divergence = 0.0;     ///< root mean square that is left, over that before the projection
                               ///< or a tenth of (speed / cell), whichever is more
  double speed = 0.0;          ///< the greatest component on a face [m/s]
  double courant = 0.0;        ///< the greatest number of cells that gas passed along an axis
  std::size_t slowed = 0;      ///< faces faster than most_speed
  std::vector<double> inlets;  ///< in; 0 where solids block it
  std::vector<double> evacuators;  ///< out; 0 where solids block it
  std::vector<double> leaks;       ///< out; negative where outside gas is drawn in
  std::array<double, 6> sides{};   ///< out
  double displaced = 0.0;          ///< by moving solids: gas squeezed is positive
  /// What has nowhere to go: spread evenly over each closed region, where gas is compressed (> 0,
  /// the cavity's pressure rises) or expands.
  double compression = 0.0;
  Vec3 impulse_to_walls = Vec3::Zero();  ///< of add_momentum, on faces of solids [N s]

  static constexpr auto fields() {
    using R = GasReport;
    return std::tuple(
        field("moved", &R::moved), field("iterations", &R::iterations),
        field("converged", &R::converged), field("divergence", &R::divergence),
        field("speed", &R::speed), field("courant", &R::courant), field("slowed", &R::slowed),
        field("inlets", &R::inlets), field("evacuators", &R::evacuators), field("leaks", &R::leaks),
        field("sides", &R::sides), field("displaced", &R::displaced),
        field("compression", &R::compression), field("impulse_to_walls", &R::impulse_to_walls));
  }
};
static_assert(fields_cover<GasReport>());

/// Same digits for any number of threads. Costs a test a step while at rest.
class GasGrid {
 public:
  /// What lasts. Arrays over cells or faces have GasLayout::count entries.
  struct State {
    std::vector<std::uint8_t> solid;
    std::vector<Vec3f> solid_velocity;  ///< [m/s]; empty: all at rest
    std::vector<GasInlet> inlets;
    std::vector<GasEvacuator> evacuators;
    std::vector<GasLeak> leaks;
    GasFaces velocity;  ///< [m/s]
    /// Of add_momentum since the step [N s]; empty: none.
    std::array<std::vector<double>, 3> impulse;
    bool impulse_came = false;
    bool at_rest = true;
    std::vector<float> potential;  ///< pressure * dt / density: the next one's guess [m2/s]
    double potential_dt = 0.0;     ///< the dt in it [s]
    VectorX squeeze;               ///< of each closed region's cells in the last step [1/s]
    GasReport report;              ///< of the last step

    static constexpr auto fields() {
      return std::tuple(
          field("solid", &State::solid), field("solid_velocity", &State::solid_velocity),
          field("inlets", &State::inlets), field("evacuators", &State::evacuators),
          field("leaks", &State::leaks), field("velocity", &State::velocity),
          field("impulse", &State::impulse), field("impulse_came", &State::impulse_came),
          field("at_rest", &State::at_rest), field("potential", &State::potential),
          field("potential_dt", &State::potential_dt), field("squeeze", &State::squeeze),
          field("report", &State::report));
    }
  };

  /// The parameters must pass check_gas.
  explicit GasGrid(const GasParameters& parameters);

  const State& state() const { return state_; }
  /// Whether a state is one of a grid with these cells, and sound enough to go on from.
  bool fits(const State& state) const;
  /// Goes on from a state that fits, bit for bit as the grid that it was taken from. Places are
  /// forgotten: place() comes first.
  void restore(State state);

  const GasParameters& parameters() const { return parameters_; }
  const std::array<int, 3>& cells() const { return layout_.n; }
  const Vec3& spacing() const { return spacing_; }
  Vec3 cell_middle(int i, int j, int k) const;  ///< world [m]

  /// Cells that are solid (not 0), x fastest, and how they move [m/s] (empty: they don't). Gas in
  /// cells that become solid is gone; cells that become gas start with the solid's velocity.
  void set_solids(std::span<const std::uint8_t> solid, std::span<const Vec3f> velocities = {});
  bool is_solid(int i, int j, int k) const;

  void set_inlets(std::span<const GasInlet> inlets);
  void set_evacuators(std::span<const GasEvacuator> evacuators);
  void set_leaks(std::span<const GasLeak> leaks);  ///< costs as set_solids does, if they differ

  Vec3 velocity(const Vec3& world) const;  ///< [m/s]; outside the domain that of its side

  /// Sets the n places that the next three speak of; outside the domain they count as at its side.
  void place(const GasPoints& points);
  void velocity(const StridedVectors<float>& velocities) const;  ///< of the gas [m/s]
  /// How much of an exchange each particle may do so that the gas never overshoots: particles would
  /// draw the gas with `rates` m k dt [kg] (mass, rate, step); the share that is left is
  /// m_g / (m_g + sum of rates), the least of the faces about the particle, m_g a face's gas.
  void couple(std::span<const float> rates, std::span<float> shares);
  /// Gives impulses [N s] to the gas; counts from the next step.
  void add_momentum(const StridedVectors<const float>& impulses);

  /// Advances by dt > 0 [s]; stable for any.
  const GasReport& step(double dt);
  const GasReport& report() const { return state_.report; }  ///< of the last step
  bool at_rest() const { return state_.at_rest; }

  /// Sets every face's velocity from a field over the world [m/s]; walls keep theirs.
  void set_velocity(const std::function<Vec3(const Vec3&)>& field);
  Vec3 momentum() const;  ///< of the gas, with what add_momentum has given since the step [N s]
  double energy() const;  ///< kinetic [J]
  /// The greatest |divergence - what sources ask for| of any cell, times a cell over the speed.
  double divergence_error() const;
  std::size_t memory_bytes() const;

 private:
  void rebuild();
  void derive();
  void place_sources();
  void forget_flows();
  void hold_fixed_faces();
  void give_impulses();
  void drive_inlets(double dt);
  void slow_down();
  void project(double dt);
  void measure(double dt);
  bool driven() const;
  double cell_volume() const { return spacing_.prod(); }

  GasParameters parameters_;
  GasLayout layout_;
  Vec3 spacing_;
  State state_;

  // Of solids and sources alone.
  std::array<std::vector<std::uint8_t>, 3> free_;  // faces that gas crosses
  GasFaces weight_;                                // of the pressure's equation [1/m2]
  std::vector<float> opening_;                     // likewise, of leaks
  std::vector<float> outside_;  // of a cell to the outside: its leaks and open sides
  GasRegions regions_;
  std::vector<double> region_opening_;  // sum of the weights to the outside; 0: closed
  std::vector<GasSpread> inlet_cells_, evacuator_cells_, leak_cells_;
  std::vector<float> source_;  // divergence that inlets and evacuators ask for [1/s]

  // Made afresh by who uses it.
  std::array<std::vector<double>, 3> rate_sums_;  // of couple, 0 between calls [kg]
  GasFaces rate_;                                 // likewise, 0 on walls
  std::vector<float> right_;                      // side of the pressure's equation [1/s]
  // These keep openings and memory, and no history: ghosts in them are 0 for ever.
  GasAdvection advection_;
  GasViscosity viscosity_;
  GasPressure pressure_;
  GasStencils stencils_;
};
static_assert(StateOwner<GasGrid> && fields_cover<GasGrid::State>());

}  // namespace viscera
