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
#include "kernels/smoke/gas_content.h"
#include "kernels/smoke/gas_layout.h"
#include "kernels/smoke/gas_mixture.h"
#include "kernels/smoke/gas_points.h"
#include "kernels/smoke/gas_pressure.h"
#include "kernels/smoke/gas_sources.h"
#include "kernels/smoke/gas_stencils.h"
#include "kernels/smoke/gas_viscosity.h"

namespace viscera {

struct GasParameters {
  Box domain;                            ///< world [m]
  int cells = 32;                        ///< along the longest axis; near cubes along the others
  GasMixture mixture;                    ///< its gas at rest gives inertia everywhere
  double kinematic_viscosity = 8.75e-6;  ///< [m2/s]
  double heat_diffusivity = 1.16e-5;     ///< [m2/s]
  double vapour_diffusivity = 1.97e-5;   ///< [m2/s]
  double eddy_viscosity = 5e-6;          ///< added to all three: eddies smaller than a cell [m2/s]
  double gravity = 9.81;                 ///< along -z [m/s2]
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

/// Of one step. Flows [m3/s] balance: inlets + swelling + displaced = evacuators + leaks + sides +
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
  std::vector<double> leaks;       ///< out; negative where air comes in; 0 where blocked
  std::array<double, 6> sides{};   ///< out
  double displaced = 0.0;          ///< by moving solids: gas squeezed is positive
  double swelling = 0.0;           ///< by what is given to gas, condenses in it or cools at walls
  /// What has nowhere to go: spread evenly over each closed region, where gas is compressed (> 0,
  /// the cavity's pressure rises) or expands.
  double compression = 0.0;
  Vec3 impulse_to_walls = Vec3::Zero();  ///< of what was given, on faces of solids [N s]
  int substeps = 0;                      ///< of what gas carries
  std::size_t held = 0;                  ///< cells whose gas was too fast to carry all it holds

  static constexpr auto fields() {
    using R = GasReport;
    return std::tuple(field("moved", &R::moved), field("iterations", &R::iterations),
                      field("converged", &R::converged), field("divergence", &R::divergence),
                      field("speed", &R::speed), field("courant", &R::courant),
                      field("slowed", &R::slowed), field("inlets", &R::inlets),
                      field("evacuators", &R::evacuators), field("leaks", &R::leaks),
                      field("sides", &R::sides), field("displaced", &R::displaced),
                      field("swelling", &R::swelling), field("compression", &R::compression),
                      field("impulse_to_walls", &R::impulse_to_walls),
                      field("substeps", &R::substeps), field("held", &R::held));
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
    std::vector<GasSource> sources;  ///< given since the step
    GasContents contents;
    bool at_rest = true;
    std::vector<float> potential;  ///< pressure * dt / density: the next one's guess [m2/s]
    double potential_dt = 0.0;     ///< the dt in it [s]
    VectorX squeeze;               ///< of each closed region's cells in the last step [1/s]
    /// Divergence of what was given, condensed or cooled in it [1/s]; empty: none.
    std::vector<float> swelling;
    GasReport report;  ///< of the last step

    static constexpr auto fields() {
      return std::tuple(
          field("solid", &State::solid), field("solid_velocity", &State::solid_velocity),
          field("inlets", &State::inlets), field("evacuators", &State::evacuators),
          field("leaks", &State::leaks), field("velocity", &State::velocity),
          field("impulse", &State::impulse), field("impulse_came", &State::impulse_came),
          field("sources", &State::sources), field("contents", &State::contents),
          field("at_rest", &State::at_rest), field("potential", &State::potential),
          field("potential_dt", &State::potential_dt), field("squeeze", &State::squeeze),
          field("swelling", &State::swelling), field("report", &State::report));
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
  /// A smaller opening or source is spread as far as this [m].
  double opening_radius() const { return least_spread(spacing_); }
  Vec3 cell_middle(int i, int j, int k) const;  ///< world [m]

  /// Cells that are solid (not 0), x fastest, and how they move [m/s] (empty: they don't). Gas in
  /// cells that become solid is gone; cells that become gas start with the solid's velocity.
  void set_solids(std::span<const std::uint8_t> solid, std::span<const Vec3f> velocities = {});
  bool is_solid(int i, int j, int k) const;

  void set_inlets(std::span<const GasInlet> inlets);
  void set_evacuators(std::span<const GasEvacuator> evacuators);
  void set_leaks(std::span<const GasLeak> leaks);
  /// Counts from the next step. What isn't finite, or has no gas in reach, is left out; whether it
  /// came in.
  bool give(const GasSource& source);

  Vec3 velocity(const Vec3& world) const;  ///< [m/s]; outside the domain that of its side

  GasContent content(int i, int j, int k) const;  ///< of a cell
  double excess(const Vec3& world) const;         ///< temperature over the resting gas's [K]
  double droplets(const Vec3& world) const;       ///< of condensed steam [kg/m3]

  /// Sets the n places that the next ones speak of; outside the domain they count as at its side.
  void place(const GasPoints& points);
  void velocity(const StridedVectors<float>& velocities) const;  ///< of the gas [m/s]
  /// How fast eddies are that are smaller than a cell: the deviation of each component of their
  /// velocity, sqrt(2/3 k). By Smagorinsky's viscosity and its relation to their energy k,
  /// (Cs D)^2 |S| = Ck D sqrt(k), with D a cell, |S| the rate of strain [Lilly1967],
  /// [Yoshizawa1985] [m/s].
  void eddies(std::span<float> speeds) const;
  void excess(std::span<float> kelvin) const;  ///< temperature over the resting gas's [K]
  /// Gives impulses [N s] to the gas; counts from the next step.
  void add_momentum(const StridedVectors<const float>& impulses);

  /// Advances by dt > 0 [s]; stable for any.
  const GasReport& step(double dt);
  const GasReport& report() const { return state_.report; }  ///< of the last step
  bool at_rest() const { return state_.at_rest; }
  /// Heat, water or air that can be felt, or that is to come in the next step.
  bool holds_any() const { return felt_ || !state_.sources.empty(); }

  /// Sets every face's velocity from a field over the world [m/s]; walls keep theirs.
  void set_velocity(const std::function<Vec3(const Vec3&)>& field);
  Vec3 momentum() const;  ///< of the gas, with what add_momentum has given since the step [N s]
  double energy() const;  ///< kinetic [J]
  /// What it holds in all: [J], [kg].
  GasContent stored() const { return state_.contents.stored(layout_, cell_volume()); }
  const GasBook& book() const { return state_.contents.book; }
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
  void move_contents(double dt);
  void take_sources(double dt);
  void push_along(const GasSource& source);
  void let_air_in(double dt);
  void condense(double dt);
  void lift(double dt);
  void find_eddies();
  void lose_contents(std::size_t cell);
  void follow_contents();
  GasTransport::Least least() const;
  void drive_inlets(double dt);
  void slow_down();
  void project(double dt);
  void measure(double dt);
  bool driven() const;
  double cell_volume() const { return spacing_.prod(); }
  float swelling(std::size_t cell) const {
    return state_.swelling.empty() ? 0.0f : state_.swelling[cell];
  }

  GasParameters parameters_;
  GasLayout layout_;
  Vec3 spacing_;
  State state_;

  // Of solids and sources alone.
  std::array<std::vector<std::uint8_t>, 3> free_;  // faces that gas crosses
  GasFaces weight_;                                // of the pressure's equation [1/m2]
  std::vector<float> outside_;                     // of a cell to the outside: its open sides
  std::vector<float> walls_;                       // sum over a cell's walls of 2 / h^2 [1/m2]
  GasRegions regions_;
  std::vector<double> region_opening_;  // sum of the weights to the outside; 0: closed
  std::vector<GasSpread> inlet_cells_, evacuator_cells_, leak_cells_;
  std::vector<float> source_;  // divergence that inlets, evacuators and leaks ask for [1/s]
  std::vector<float> sinks_;   // of it, what is drawn off [1/s]

  // Made afresh by who uses it.
  std::vector<float> right_;     // side of the pressure's equation [1/s]
  std::vector<float> to_walls_;  // heat, of the step [J/m3]
  std::vector<float> lack_;      // of density, as a share [1]
  // Of velocity or contents alone.
  std::vector<float> eddies_;  // in cells [m/s]
  bool felt_ = false;          // contents are more than nothing
  // These keep openings and memory, and no history: ghosts in them are 0 for ever.
  GasAdvection advection_;
  GasViscosity viscosity_;
  GasPressure pressure_;
  GasTransport transport_;
  GasStencils stencils_;
};
static_assert(StateOwner<GasGrid> && fields_cover<GasGrid::State>());

}  // namespace viscera
