// The smoke of one volume: particles, the passes that move them, and their mass book.
// [De2006] eq. 13-15.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "kernels/smoke/smoke_book.h"
#include "kernels/smoke/smoke_particles.h"
#include "kernels/smoke/splat.h"
#include "kernels/smoke/step_passes.h"
#include "kernels/smoke/surface_cells.h"
#include "kernels/smoke/surrounding_gas.h"
#include "kernels/smoke/swirl.h"

namespace viscera {

/// The eddies that carry smoke besides the flow of the gas. Their speed is that of eddies which the
/// gas's grid doesn't resolve (GasGrid::eddies), or without one a share of the parcel's own.
struct SmokeEddies {
  double share = 0.25;        ///< of the parcel's speed, as in free plumes; without a grid [1]
  double wavelength = 20e-3;  ///< of their waves, spread from 0.25 to 1.5 times this [m]
  double period = 0.6;        ///< in which those of this wavelength change [s]
  /// Their white part, of their speed: the deviation of each component over 1/60 s, scaled by
  /// sqrt((1/60 s) / dt), so that the diffusion doesn't depend on the step [1].
  double white = 0.25;
};

struct SmokeParameters {
  Box domain;                       ///< world [m]
  std::uint32_t open_sides = 0;     ///< bits: smoke leaves there; along the others it slides
  double spacing = 3e-3;            ///< smoothing length h (support radius) of the particles [m]
  double gas_density = 1.76;        ///< rho [kg/m3] (CO2 at 12 mmHg and 37 C)
  double gas_viscosity = 1.54e-5;   ///< mu [Pa s]
  double gas_temperature = 310.15;  ///< [K]
  double prandtl = 0.76;   ///< of the gas, which takes a parcel's heat where it stands still
  double gravity = 9.81;   ///< [m/s2]; buoyancy acts along +z
  double lifetime = 20.0;  ///< older particles join the background [s]
  std::uint64_t seed = 1;
  std::size_t max_particles = 25000;  ///< the oldest end when more are emitted, and are counted
  Laplacian laplacian = Laplacian::kPairwise;

  SmokeEddies eddies;

  /// Added to mu / rho [m2/s]: eddies smaller than h.
  double eddy_viscosity = 5e-6;
  /// Drag by the gas around, as a share of what follows from viscosity (viscosity.h): 1, or 0
  /// without gas.
  double gas_drag = 1.0;
  /// A jet of radius b that entrains gas slows by a = -(2 alpha / b) |v - u| (v - u); b is h, the
  /// width that a parcel has. alpha of jets [Morton1956].
  double jet_entrainment = 0.08;
  /// Where no gas is computed, particles stand for it, and it can't pile up: closer than h/2 on
  /// average they push each other apart with the pressure rho c^2 of their excess (viscosity.h);
  /// c [m/s].
  double crowding_speed = 0.02;

  double surface_gap = 2e-4;  ///< that particles keep to surfaces [m]
  /// Of smoke onto what it touches: that in which its droplets settle (droplet_optics.h) [m/s].
  double deposition_velocity = 1.6e-5;
  double cavity_volume = 3e-3;   ///< of gas that the background is mixed into [m3]
  double background_leak = 0.0;  ///< flow that leaks from the cavity besides the outlets [m3/s]
};

/// An opening that takes gas out: a suction evacuator, or a trocar that leaks. From a ball about it
/// particles go as the gas does, each with the share of the ball's gas that is drawn off.
struct SmokeOutlet {
  Vec3 position = Vec3::Zero();  ///< world [m]
  double radius = 0.0;           ///< of the ball [m]
  double flow = 0.0;             ///< [m3/s]
  bool leak = false;             ///< books what it takes as leaked, not as evacuated
};

/// An instrument's part in the world, at the end of a step and at its start.
struct SmokeObstacle {
  Vec3 from = Vec3::Zero(), to = Vec3::Zero();  ///< [m]
  Vec3 from_before = Vec3::Zero(), to_before = Vec3::Zero();
  double radius = 0.0;  ///< [m]
  static constexpr auto fields() {
    using S = SmokeObstacle;
    return std::tuple(field("from", &S::from), field("to", &S::to),
                      field("from_before", &S::from_before), field("to_before", &S::to_before),
                      field("radius", &S::radius));
  }
};

/// What a step finds around the particles; nothing by default, and gas at rest.
struct SmokeSurroundings {
  SurroundingGas* gas = nullptr;
  std::span<const SmokeSurface> surfaces = {};
  std::span<const SmokeObstacle> obstacles = {};
  std::span<const SmokeOutlet> outlets = {};
  /// A step may be one part of a longer one, in which surfaces and obstacles go all of their way:
  /// from this share of it to that. Parts follow one another from 0 to 1.
  double from = 0.0, to = 1.0;
};

struct SmokeCounters {
  std::uint64_t emitted = 0, retired = 0;  ///< particles
  std::uint64_t crowded_out = 0;           ///< of the retired, those that made room for new ones
  std::uint64_t refused = 0;   ///< emissions that were not usable: outside, not finite, no mass
  std::uint64_t isolated = 0;  ///< particles without enough neighbours, last step: no viscosity
  std::uint64_t tested = 0;    ///< against surfaces, last step
  std::uint64_t touching = 0;  ///< of them, last step
  std::uint64_t trapped = 0;   ///< between surfaces, in all: deposited

  static constexpr auto fields() {
    using C = SmokeCounters;
    return std::tuple(field("emitted", &C::emitted), field("retired", &C::retired),
                      field("crowded_out", &C::crowded_out), field("refused", &C::refused),
                      field("isolated", &C::isolated), field("tested", &C::tested),
                      field("touching", &C::touching), field("trapped", &C::trapped));
  }
};
static_assert(fields_cover<SmokeCounters>());

struct SmokeEmission {
  Vec3 position = Vec3::Zero();    ///< world [m]
  Vec3 direction = Vec3::UnitZ();  ///< of the jet: outward from the tissue
  double speed = 0.15;             ///< [m/s]
  double reach = 1.0;              ///< room in that direction: the jet goes no farther [m]
  double radius = 1e-3;            ///< of the source [m]
  double temperature = 60.0;       ///< excess over the gas [K]
  double mass = 0.0;               ///< of smoke to emit in this step [kg]
  int particles = 0;               ///< number to emit in this step; without any, no mass leaves
  double duration = 0.0;           ///< over which they left [s]: spreads them along the jet
};

/// mu / rho plus the eddy viscosity [m2/s].
double effective_viscosity(const SmokeParameters& parameters);

/// How a parcel runs ahead of gas at rest: dv/dt = -k v - c v^2.
struct JetDrag {
  double linear = 0.0;     ///< k [1/s]
  double quadratic = 0.0;  ///< c [1/m]

  double speed_after(double speed, double time) const;  ///< [m/s]
  double way_after(double speed, double time) const;    ///< [m]
  /// At which it gets that far in the end [m/s]; any: as fast as you like.
  double speed_for(double reach) const;
};
JetDrag jet_drag(const SmokeParameters& parameters);

/// The smoke of one volume. Deterministic for any number of threads.
class SmokeVolume {
 public:
  /// What lasts. It is complete between steps, whatever computes them: a device has given the
  /// particles back by the end of one.
  struct State {
    SmokeParticles particles;
    SmokeCounters counters;
    SmokeBook book;
    SurfaceCells surfaces;
    double time = 0.0;           ///< since the start [s]
    std::uint32_t substeps = 0;  ///< since then: key of random numbers, as ids are
    std::uint32_t next_id = 0;

    static constexpr auto fields() {
      return std::tuple(field("particles", &State::particles), field("counters", &State::counters),
                        field("book", &State::book), field("surfaces", &State::surfaces),
                        field("time", &State::time), field("substeps", &State::substeps),
                        field("next_id", &State::next_id));
    }
  };

  explicit SmokeVolume(const SmokeParameters& parameters);

  const State& state() const { return state_; }
  /// Whether a state is one of a volume with these parameters, and sound enough to go on from.
  bool fits(const State& state) const;
  /// Goes on from a state that fits, bit for bit as the volume that it was taken from where the
  /// same computes both (compute_on, which stays).
  void restore(State state) { state_ = std::move(state); }

  /// The passes of its steps run on that from now on; null: on the CPU. The mass book, emission,
  /// outlets and the gas stay on the CPU. A device that fails in a step loses what it did since it
  /// took the particles: they stay where they were, the rest runs on the CPU, and device_failure()
  /// tells.
  void compute_on(std::shared_ptr<SmokePasses> passes) { device_ = std::move(passes); }
  SmokePasses* device() const { return device_.get(); }
  const std::string& device_failure() const { return device_failure_; }  ///< empty: none

  /// Particles appear evenly along the way that the jet has gone since the last step, in balls that
  /// widen with it. False, and nothing is emitted, where something isn't finite, mass, number or
  /// direction is not positive, or the source lies outside the domain.
  bool emit(const SmokeEmission& emission);
  /// Advances by dt [s]. [De2006] eq. 14. Particles exchange momentum as often as the explicit
  /// bound of viscosity asks for (once a frame of 1/60 s with the defaults); in between they and
  /// the surfaces move in substeps of at most 2 h (at most 64). Where gas is given, it alone is
  /// warm and rises; without, the particles are and do.
  void step(double dt, const SmokeSurroundings& surroundings = {});

  /// Ends particles with a number that isn't finite; what they carried joins the background.
  void end_strays();

  const SmokeParticles& particles() const { return state_.particles; }
  const SmokeParameters& parameters() const { return parameters_; }
  const SmokeCounters& counters() const { return state_.counters; }
  const SmokeBook& book() const { return state_.book; }
  double airborne() const;                     ///< mass that particles carry [kg]
  double time() const { return state_.time; }  ///< since the start [s]
  const SurfaceCells& surface_cells() const { return state_.surfaces; }
  std::size_t memory_bytes() const;

 private:
  SmokePasses& passes() { return device_ ? *device_ : cpu_; }
  void hand_over();
  void take_back();
  void drop_device();
  void exchange(bool in_gas);
  double greatest_way(double dt) const;
  void take_temperatures(SurroundingGas& gas);
  void substep(double dt, double from, double to, double whole, const SmokeSurroundings& around);
  void meet_surfaces(double dt, double from, double to, double whole,
                     const SmokeSurroundings& around);
  void take_out(double dt, std::span<const SmokeOutlet> outlets);
  void end_aged_and_gone();
  void end_oldest(std::size_t count);
  void remove_ended();

  SmokeParameters parameters_;
  SwirlField swirl_;  // of parameters and time
  State state_;
  // Of a step, or kept for its memory.
  CpuSmokePasses cpu_;
  std::shared_ptr<SmokePasses> device_;  // null: cpu_
  std::string device_failure_;
  std::vector<SmokeCapsule> capsules_;
  std::vector<SmokeFate> fates_;  // of the particles, where these are here
  std::vector<float> excess_;
  bool any_trapped_ = false;    // since they were handed over
  double exchange_step_ = 0.0;  // between two exchanges of momentum [s]
};

static_assert(StateOwner<SmokeVolume> && fields_cover<SmokeVolume::State>());

/// How far a particle's smoke has spread by its age [s] (splat.h) [m].
float spread_radius(const SmokeParameters& parameters, float age);

/// Splats the particles on cubic cells of edge `voxel` [m] over the domain (splat.h).
void splat(const SmokeVolume& smoke, double voxel, SmokeGrid& grid);

}  // namespace viscera
