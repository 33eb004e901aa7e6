#include "kernels/smoke/smoke.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>

#include "kernels/base/finite.h"
#include "kernels/base/parallel.h"
#include "kernels/base/random.h"

namespace viscera {
namespace {

constexpr std::size_t kChunk = 1024;
constexpr std::uint64_t kEmissionStream = 0x454d'4954ull << 32;
constexpr std::uint64_t kOutletStream = 0x4f55'544cull << 32;
constexpr double kReferenceStep = 1.0 / 60.0;
constexpr int kMostSubsteps = 64;
constexpr double kSupportsAStep = 2.0;
constexpr float kWallRestitution = 0.2f;
constexpr std::uint32_t kFewestNeighbours = 4;
constexpr std::uint32_t kRounds = 6;
// Crowding stays as gentle as at this excess where a source overfills its surroundings.
constexpr float kMostExcess = 4.0f;

ViscosityParameters viscosity_parameters(const SmokeParameters& parameters, double dt,
                                         bool in_gas) {
  const double h = parameters.spacing, nu = effective_viscosity(parameters);
  // The kernel's norm is 315 / (64 pi h^3), and a particle stands for (h/2)^3: but for nothing
  // where there is gas.
  constexpr double kFill = 315.0 / (64.0 * std::numbers::pi) / 8.0;
  ViscosityParameters pass;
  pass.inverse_square = static_cast<float>(1.0 / (h * h));
  pass.viscosity = static_cast<float>(nu);
  pass.crowding = static_cast<float>(0.5 * parameters.crowding_speed * parameters.crowding_speed);
  pass.fill = in_gas ? 0.0f : static_cast<float>(kFill);
  pass.most_excess = kMostExcess;
  pass.gas_drag = static_cast<float>(jet_drag(parameters).linear);
  pass.fewest_neighbours = kFewestNeighbours;
  pass.laplacian = parameters.laplacian;
  pass.step = static_cast<float>(dt);
  return pass;
}

bool usable(const SmokeEmission& emission, const Box& domain) {
  return emission.position.allFinite() && domain.contains(emission.position) &&
         emission.direction.allFinite() && emission.direction.norm() > 0.0 &&
         std::isfinite(emission.speed) && std::isfinite(emission.radius) && emission.reach >= 0.0 &&
         emission.radius >= 0.0 && std::isfinite(emission.temperature) &&
         std::isfinite(emission.duration) && emission.duration >= 0.0 &&
         std::isfinite(emission.mass) && emission.mass > 0.0 && emission.particles > 0;
}

}  // namespace

double effective_viscosity(const SmokeParameters& parameters) {
  return parameters.gas_viscosity / parameters.gas_density + parameters.eddy_viscosity;
}

JetDrag jet_drag(const SmokeParameters& parameters) {
  const double h = parameters.spacing;
  return {parameters.gas_drag * 18.0 * effective_viscosity(parameters) / (h * h),
          2.0 * parameters.jet_entrainment / h};
}

double JetDrag::speed_after(double speed, double time) const {
  const double left = std::exp(-linear * time);
  const double slowed = linear > 0.0 ? -std::expm1(-linear * time) / linear : time;
  return speed * left / (1.0 + quadratic * speed * slowed);
}

double JetDrag::way_after(double speed, double time) const {
  const double slowed = linear > 0.0 ? -std::expm1(-linear * time) / linear : time;
  const double way = speed * slowed;
  return quadratic > 0.0 ? std::log1p(quadratic * way) / quadratic : way;
}

double JetDrag::speed_for(double reach) const {
  if (!(linear > 0.0)) return std::numeric_limits<double>::infinity();
  return linear * (quadratic > 0.0 ? std::expm1(quadratic * reach) / quadratic : reach);
}

SmokeVolume::SmokeVolume(const SmokeParameters& parameters)
    : parameters_(parameters),
      // Waves of unit deviation in each component.
      swirl_(parameters.seed, std::sqrt(3.0), parameters.eddies.wavelength,
             parameters.eddies.period) {
  assert(!parameters.domain.isEmpty() && parameters.spacing > 0.0);
  assert(parameters.gas_density > 0.0 && parameters.gas_temperature > 0.0);
}

bool SmokeVolume::fits(const State& state) const {
  const SmokeParticles& p = state.particles;
  const std::size_t count = p.size();
  const auto finite = [](const Float4& v) { return v.xyz().allFinite() && std::isfinite(v.w); };
  return p.velocities.size() == count && p.masses.size() == count && p.ids.size() == count &&
         count <= parameters_.max_particles && std::ranges::all_of(p.positions, finite) &&
         std::ranges::all_of(p.velocities, finite) &&
         std::ranges::all_of(p.masses, [](float mass) { return std::isfinite(mass); }) &&
         std::isfinite(state.time) && SurfaceCells::fits(state.surfaces.state());
}

bool SmokeVolume::emit(const SmokeEmission& emission) {
  if (!usable(emission, parameters_.domain)) {
    ++state_.counters.refused;
    return false;
  }
  const auto number = static_cast<std::size_t>(emission.particles);
  const float mass = static_cast<float>(emission.mass / emission.particles);
  state_.counters.emitted += number;
  state_.book.emitted += static_cast<double>(mass) * emission.particles;

  const Vec3f extent = parameters_.domain.sizes().cast<float>();
  const Vec3 direction = emission.direction.normalized();
  const JetDrag drag = jet_drag(parameters_);
  const double speed = std::min(emission.speed, drag.speed_for(emission.reach));
  const float temperature = static_cast<float>(emission.temperature);
  for (std::size_t i = 0; i < number; ++i) {
    const Random random(parameters_.seed, kEmissionStream + state_.next_id);
    const double age = emission.duration * random.uniform(2);
    const double way = drag.way_after(speed, age);
    const double radius = emission.radius + 2.0 * parameters_.jet_entrainment * way;
    const Vec3 offset = radius * std::cbrt(random.uniform(3)) * random.direction(0);
    const Vec3f position =
        (emission.position + offset + way * direction - parameters_.domain.min()).cast<float>();
    const Vec3 velocity = drag.speed_after(speed, age) * direction;
    state_.particles.positions.push_back(
        Float4::from(position.cwiseMax(Vec3f::Zero()).cwiseMin(extent), temperature));
    state_.particles.velocities.push_back(
        Float4::from(velocity.cast<float>(), static_cast<float>(age)));
    state_.particles.masses.push_back(mass);
    state_.particles.ids.push_back(state_.next_id++);
  }
  if (state_.particles.size() > parameters_.max_particles) {
    end_oldest(state_.particles.size() - parameters_.max_particles);
  }
  return true;
}

void SmokeVolume::step(double dt, const SmokeSurroundings& around) {
  if (!(dt > 0.0) || !std::isfinite(dt)) return;
  state_.counters.isolated = state_.counters.tested = state_.counters.touching = 0;
  const bool in_gas = around.gas != nullptr;
  if (state_.particles.size() == 0) {
    state_.surfaces.advance({}, parameters_.domain.min());
    state_.time += dt;
  } else {
    // In a later turn none are known where there were no particles in the first.
    if (around.from == 0.0 || state_.surfaces.state().surfaces.empty())
      state_.surfaces.advance(around.surfaces, parameters_.domain.min());
    const double share = around.to - around.from, whole = dt / share;
    const double first_way = greatest_way(dt);
    hand_over();
    const double nu = effective_viscosity(parameters_);
    const double longest =
        nu > 0.0 ? longest_viscous_step(parameters_.spacing, nu) : kReferenceStep;
    const int exchanges = std::max(1, static_cast<int>(std::ceil(dt / longest)));
    exchange_step_ = dt / exchanges;
    for (int e = 0; e < exchanges; ++e) {
      exchange(in_gas);
      // Neither particles nor what they may meet go further than two support radii: cells of the
      // gas, and bodies, are wider.
      double way = e == 0 ? first_way / exchanges
                          : exchange_step_ * static_cast<double>(passes().greatest_speed());
      const Eigen::AlignedBox3f domain(Vec3f::Zero(), parameters_.domain.sizes().cast<float>());
      way = std::max<double>(way, share * state_.surfaces.greatest_way(domain) / exchanges);
      for (const SmokeObstacle& obstacle : around.obstacles) {
        way = std::max({way, share * (obstacle.from - obstacle.from_before).norm() / exchanges,
                        share * (obstacle.to - obstacle.to_before).norm() / exchanges});
      }
      const double wanted = std::ceil(way / (kSupportsAStep * parameters_.spacing));
      const int substeps = static_cast<int>(std::clamp<double>(wanted, 1.0, kMostSubsteps));
      for (int s = 0; s < substeps; ++s) {
        const double parts = static_cast<double>(exchanges) * substeps;
        const double from = around.from + share * (e * substeps + s) / parts,
                     to = around.from + share * (e * substeps + s + 1) / parts;
        substep(exchange_step_ / substeps, from, to, whole, around);
      }
    }
    take_back();
    end_aged_and_gone();
    if (in_gas) take_temperatures(*around.gas);
  }
  take_out(dt, around.outlets);
}

/// Of a particle in dt [m]: what leaves a jet slows on its way, all others have.
double SmokeVolume::greatest_way(double dt) const {
  const JetDrag drag = jet_drag(parameters_);
  double way = 0.0;
  for (const Float4& velocity : state_.particles.velocities) {
    const double speed = static_cast<double>(velocity.xyz().norm());
    const bool jet = static_cast<double>(velocity.w) <= dt;
    way = std::max(way, jet ? drag.way_after(speed, dt) : speed * dt);
  }
  return way;
}

/// They are as warm as the gas about them.
void SmokeVolume::take_temperatures(SurroundingGas& gas) {
  excess_.resize(state_.particles.size());
  gas.excess(state_.particles.positions, excess_);
  for (std::size_t i = 0; i < excess_.size(); ++i) state_.particles.positions[i].w = excess_[i];
}

void SmokeVolume::hand_over() {
  any_trapped_ = false;
  if (passes().start(state_.particles)) return;
  drop_device();
  cpu_.start(state_.particles);
}

void SmokeVolume::take_back() {
  state_.counters.isolated = passes().isolated();
  if (const std::optional<double> deposited = passes().finish(state_.particles, fates_)) {
    state_.book.deposited += *deposited;
    return;
  }
  drop_device();
  fates_.assign(state_.particles.size(), SmokeFate::kAirborne);
}

void SmokeVolume::drop_device() {
  if (!device_) return;
  device_failure_ = device_->trouble();
  device_.reset();
}

/// Sorts the particles and finds what neighbours do to each.
void SmokeVolume::exchange(bool in_gas) {
  // The fates travel with the particles only between two sorts.
  if (any_trapped_) {
    take_back();
    remove_ended();
    hand_over();
  }
  passes().exchange(static_cast<float>(parameters_.spacing),
                    viscosity_parameters(parameters_, exchange_step_, in_gas));
}

void SmokeVolume::substep(double dt, double from, double to, double whole,
                          const SmokeSurroundings& around) {
  IntegrateParameters pass;
  pass.extent = Float4::from(parameters_.domain.sizes().cast<float>(), kWallRestitution);
  pass.step = static_cast<float>(dt);
  pass.white = static_cast<float>(parameters_.eddies.white * std::sqrt(kReferenceStep / dt));
  pass.entrainment = static_cast<float>(jet_drag(parameters_).quadratic);
  pass.gas_temperature = static_cast<float>(parameters_.gas_temperature);
  if (around.gas == nullptr) {
    pass.gravity = static_cast<float>(parameters_.gravity);
    pass.cooling = static_cast<float>(1.0 / parameters_.prandtl);
    pass.turbulence = static_cast<float>(parameters_.eddies.share);
  }
  pass.seed = static_cast<std::uint32_t>(parameters_.seed ^ parameters_.seed >> 32);
  pass.substep = state_.substeps++;
  pass.open_sides = parameters_.open_sides;
  const std::vector<SwirlWave> waves = swirl_.waves(state_.time);
  passes().integrate(pass, waves, around.gas);
  state_.time += dt;
  meet_surfaces(dt, from, to, whole, around);
}

void SmokeVolume::meet_surfaces(double dt, double from, double to, double whole,
                                const SmokeSurroundings& around) {
  if (around.surfaces.empty() && around.obstacles.empty()) return;
  const double h = parameters_.spacing, nu = effective_viscosity(parameters_);
  const Vec3 origin = parameters_.domain.min();
  const Eigen::AlignedBox3f domain(Vec3f::Zero(), parameters_.domain.sizes().cast<float>());
  double way = (to - from) * state_.surfaces.greatest_way(domain);

  capsules_.clear();
  for (const SmokeObstacle& obstacle : around.obstacles) {
    const Vec3 from_way = obstacle.from - obstacle.from_before;
    const Vec3 to_way = obstacle.to - obstacle.to_before;
    way = std::max({way, (to - from) * from_way.norm(), (to - from) * to_way.norm()});
    SmokeCapsule capsule;
    capsule.from = Float4::from((obstacle.from_before + to * from_way - origin).cast<float>(),
                                static_cast<float>(obstacle.radius));
    capsule.to = Float4::from((obstacle.to_before + to * to_way - origin).cast<float>());
    capsule.from_motion = Float4::from((from_way / whole).cast<float>());
    capsule.to_motion = Float4::from((to_way / whole).cast<float>());
    capsules_.push_back(capsule);
  }

  CollideParameters pass;
  pass.gap = static_cast<float>(parameters_.surface_gap);
  // A parcel of edge h/2 touches when its middle is half of that away; the surface drags it by the
  // shear over that distance, and takes smoke from the half that faces it.
  pass.touch = static_cast<float>(std::max(0.25 * h, parameters_.surface_gap));
  pass.friction = static_cast<float>(-std::expm1(-dt * 8.0 * nu / (h * h)));
  pass.kept = static_cast<float>(std::exp(-dt * parameters_.deposition_velocity / (0.5 * h)));
  pass.rounds = kRounds;
  pass.extent = Float4::from(domain.max());
  pass.open_sides = parameters_.open_sides;

  // What went into a surface in this substep is no deeper than both have moved; getting out, it
  // comes as far as that and the gap again.
  const SurfaceReach reach = {static_cast<float>(way) + 2.0f * pass.gap + pass.touch,
                              static_cast<float>(dt)};
  const CollideCounts counts =
      passes().collide(state_.surfaces, {to, whole, static_cast<float>(h), reach}, capsules_, pass);
  state_.counters.tested = counts.tested;
  state_.counters.touching = counts.touching;
  state_.counters.trapped += counts.trapped;
  any_trapped_ = any_trapped_ || counts.trapped > 0;
}

/// Particles at an outlet go through it as the gas does, and the background thins.
void SmokeVolume::take_out(double dt, std::span<const SmokeOutlet> outlets) {
  double evacuation = 0.0, leak = parameters_.background_leak;
  fates_.assign(state_.particles.size(), SmokeFate::kAirborne);
  bool any = false;
  const Random random(parameters_.seed, kOutletStream + state_.substeps);
  for (const SmokeOutlet& outlet : outlets) {
    if (!(outlet.flow > 0.0)) continue;
    (outlet.leak ? leak : evacuation) += outlet.flow;
    const Vec3f at = (outlet.position - parameters_.domain.min()).cast<float>();
    const float square = static_cast<float>(outlet.radius * outlet.radius);
    const double ball = 4.0 / 3.0 * std::numbers::pi * std::pow(outlet.radius, 3);
    const double share = -std::expm1(-dt * outlet.flow / ball);
    for (std::size_t i = 0; i < state_.particles.size(); ++i) {
      if (fates_[i] != SmokeFate::kAirborne) continue;
      if (!((state_.particles.position(i) - at).squaredNorm() < square)) continue;
      if (random.uniform(state_.particles.ids[i]) >= share) continue;
      fates_[i] = outlet.leak ? SmokeFate::kLeaked : SmokeFate::kEvacuated;
      any = true;
    }
  }
  if (any) remove_ended();
  state_.book.flow_out(parameters_.cavity_volume, evacuation, leak, dt);
}

void SmokeVolume::end_aged_and_gone() {
  const float lifetime = static_cast<float>(parameters_.lifetime);
  const Vec3f extent = parameters_.domain.sizes().cast<float>();
  for (std::size_t i = 0; i < state_.particles.size(); ++i) {
    if (fates_[i] != SmokeFate::kAirborne) continue;
    const Vec3f at = state_.particles.position(i);
    bool gone = state_.particles.age(i) > lifetime;
    for (int axis = 0; axis < 3; ++axis) {
      gone = gone || ((parameters_.open_sides & kOpenLowX << 2 * axis) && at[axis] < 0.0f) ||
             ((parameters_.open_sides & kOpenHighX << 2 * axis) && at[axis] > extent[axis]);
    }
    if (gone) fates_[i] = SmokeFate::kBackground;
  }
  remove_ended();
}

void SmokeVolume::end_strays() {
  SmokeParticles& particles = state_.particles;
  fates_.assign(particles.size(), SmokeFate::kAirborne);
  for (std::size_t i = 0; i < particles.size(); ++i) {
    const bool carries = std::isfinite(particles.masses[i]);
    if (!carries) particles.masses[i] = 0.0f;
    if (!carries || first_stray(particles.positions[i]) || first_stray(particles.velocities[i]))
      fates_[i] = SmokeFate::kBackground;
  }
  remove_ended();
}

// Ids count up, so the oldest are the least.
void SmokeVolume::end_oldest(std::size_t count) {
  state_.counters.crowded_out += count;
  std::vector<std::uint32_t> ids = state_.particles.ids;
  std::ranges::nth_element(ids, ids.begin() + static_cast<std::ptrdiff_t>(count - 1));
  const std::uint32_t last = ids[count - 1];
  fates_.resize(state_.particles.size());
  std::ranges::transform(state_.particles.ids, fates_.begin(), [&](std::uint32_t id) {
    return id <= last ? SmokeFate::kBackground : SmokeFate::kAirborne;
  });
  remove_ended();
}

void SmokeVolume::remove_ended() {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < state_.particles.size(); ++i) {
    const double mass = state_.particles.masses[i];
    switch (fates_[i]) {
      case SmokeFate::kAirborne:
        if (kept != i) state_.particles.copy(i, state_.particles, kept);
        ++kept;
        continue;
      case SmokeFate::kBackground:
        state_.book.background += mass;
        break;
      case SmokeFate::kEvacuated:
        state_.book.evacuated += mass;
        break;
      case SmokeFate::kLeaked:
        state_.book.leaked += mass;
        break;
      case SmokeFate::kDeposited:
        state_.book.deposited += mass;
        break;
    }
    ++state_.counters.retired;
  }
  state_.particles.resize(kept);
  fates_.assign(kept, SmokeFate::kAirborne);
}

double SmokeVolume::airborne() const {
  return parallel_sum(state_.particles.size(), kChunk, 0.0,
                      [&](std::size_t begin, std::size_t end) {
                        double sum = 0.0;
                        for (std::size_t i = begin; i < end; ++i) sum += state_.particles.masses[i];
                        return sum;
                      });
}

std::size_t SmokeVolume::memory_bytes() const {
  return state_.particles.memory_bytes() + cpu_.memory_bytes() + state_.surfaces.memory_bytes() +
         fates_.capacity() + (device_ ? device_->memory_bytes() : 0);
}

float spread_radius(const SmokeParameters& parameters, float age) {
  const double h = parameters.spacing;
  const double grown = 0.25 * h * h + 12.0 * effective_viscosity(parameters) * age;
  return static_cast<float>(std::min(std::sqrt(grown), 2.5 * h));
}

void splat(const SmokeVolume& smoke, double voxel, SmokeGrid& grid) {
  const SmokeParameters& parameters = smoke.parameters();
  SplatParameters pass = splat_parameters(parameters.domain, voxel, parameters.spacing,
                                          effective_viscosity(parameters));
  const SmokeParticles& particles = smoke.particles();
  if (smoke.device() == nullptr || !smoke.device()->splat(particles, pass, grid)) {
    splat(particles.positions, particles.velocities, particles.masses, pass, grid);
  }
  grid.voxel = voxel;
  grid.domain =
      Box(parameters.domain.min(), parameters.domain.min() + voxel * grid.size.cast<double>());
}

}  // namespace viscera
