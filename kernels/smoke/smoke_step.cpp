#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <span>

#include "kernels/base/parallel.h"
#include "kernels/base/random.h"
#include "kernels/smoke/smoke.h"

namespace viscera {
namespace {

constexpr std::size_t kChunk = 256;
constexpr std::uint64_t kEmissionStream = 0x454d'4954ull << 32;
constexpr double kReferenceStep = 1.0 / 60.0;
constexpr int kMostSubsteps = 32;
constexpr float kWallRestitution = 0.2f;

// Half of the usual bound 0.1 h^2 / nu: clustered particles exchange momentum at up to 24 nu / h^2.
double longest_viscous_step(const SmokeParameters& parameters) {
  const double nu = effective_viscosity(parameters);
  return nu > 0.0 ? 0.05 * parameters.spacing * parameters.spacing / nu : kReferenceStep;
}

// A standard normal number to the accuracy that a random force needs: the sum of four uniform ones
// from one word (mean 0, variance 1, bounded at 3.5), ten times faster than
// [Box1958].
inline float nearly_normal(std::uint64_t bits) {
  const float sum = static_cast<float>((bits & 0xffff) + (bits >> 16 & 0xffff) +
                                       (bits >> 32 & 0xffff) + (bits >> 48));
  constexpr float kMean = 2.0f * 65535.0f;
  constexpr float kInverseDeviation = 1.7320508f / 65536.0f;  // variance of one: 65536^2 / 12
  return (sum - kMean) * kInverseDeviation;
}

// Inelastic walls: the overshoot comes back shortened and slowed, motion along the wall goes on.
void keep_inside(float& position, float& velocity, float extent) {
  if (position < 0.0f) {
    position = std::min(-kWallRestitution * position, extent);
    velocity = -kWallRestitution * velocity;
  } else if (position > extent) {
    position = std::max(extent - kWallRestitution * (position - extent), 0.0f);
    velocity = -kWallRestitution * velocity;
  }
}

}  // namespace

SmokeVolume::SmokeVolume(const SmokeParameters& parameters)
    : parameters_(parameters),
      swirl_(parameters.seed, parameters.swirl_acceleration, parameters.swirl_wavelength,
             parameters.swirl_time) {
  assert(!parameters.domain.isEmpty() && parameters.spacing > 0.0);
  assert(parameters.gas_density > 0.0 && parameters.gas_temperature > 0.0);
}

void SmokeVolume::emit(const SmokeEmission& emission) {
  const bool usable = emission.position.allFinite() && emission.direction.allFinite() &&
                      emission.direction.norm() > 0.0 && std::isfinite(emission.speed) &&
                      std::isfinite(emission.temperature) && std::isfinite(emission.mass) &&
                      emission.mass > 0.0 && emission.particles > 0;
  if (!usable) return;
  const auto number = static_cast<std::size_t>(emission.particles);
  const float mass = static_cast<float>(emission.mass / emission.particles);
  counters_.emitted += number;
  counters_.emitted_mass += static_cast<double>(mass) * emission.particles;
  if (!parameters_.domain.contains(emission.position)) {
    counters_.left_domain += number;
    counters_.left_mass += static_cast<double>(mass) * emission.particles;
    return;
  }

  const Vec3f extent = parameters_.domain.sizes().cast<float>();
  const Vec3 velocity = emission.speed * emission.direction.normalized();
  for (std::size_t i = 0; i < number; ++i) {
    const Random random(parameters_.seed, kEmissionStream + next_id_);
    const double age = emission.duration * random.uniform(2);
    const Vec3 offset = emission.radius * std::cbrt(random.uniform(3)) * random.direction(0);
    const Vec3f position =
        (emission.position + offset + age * velocity - parameters_.domain.min()).cast<float>();
    particles_.positions.push_back(position.cwiseMax(Vec3f::Zero()).cwiseMin(extent));
    particles_.velocities.push_back(velocity.cast<float>());
    particles_.temperatures.push_back(static_cast<float>(emission.temperature));
    particles_.masses.push_back(mass);
    particles_.ages.push_back(static_cast<float>(age));
    particles_.ids.push_back(next_id_++);
  }
  if (particles_.size() > parameters_.max_particles) {
    retire_oldest(particles_.size() - parameters_.max_particles);
  }
}

void SmokeVolume::step(double dt) {
  if (!(dt > 0.0) || !std::isfinite(dt)) return;
  if (particles_.size() == 0) {
    time_ += dt;
    return;
  }
  const int exchanges =
      std::max(1, static_cast<int>(std::ceil(dt / longest_viscous_step(parameters_))));
  for (int i = 0; i < exchanges; ++i) exchange_and_move(dt / exchanges);
  retire_aged();
}

void SmokeVolume::exchange_and_move(double dt) {
  bins_.sort(particles_, static_cast<float>(parameters_.spacing));
  forces_.compute(particles_, bins_, parameters_);
  counters_.isolated = forces_.isolated();

  float most = 0.0f;
  for (const Vec3f& velocity : particles_.velocities) most = std::max(most, velocity.squaredNorm());
  const double displacement = dt * std::sqrt(static_cast<double>(most));
  const double wanted = std::ceil(displacement / (0.5 * parameters_.spacing));
  const int substeps = static_cast<int>(std::clamp<double>(wanted, 1.0, kMostSubsteps));
  for (int i = 0; i < substeps; ++i) {
    move(dt / substeps);
    time_ += dt / substeps;
    ++substeps_;
  }
}

// dv/dt = (mu lap v + f) / rho [De2006] eq. 14, f being the random force and buoyancy, and the drag
// of the gas at rest and of entrained gas, both implicit, so that no step makes them overshoot.
void SmokeVolume::move(double dt) {
  const float step = static_cast<float>(dt);
  const Vec3f extent = parameters_.domain.sizes().cast<float>();
  const float white =
      static_cast<float>(parameters_.random_acceleration * std::sqrt(kReferenceStep / dt));
  const float lift = static_cast<float>(parameters_.gravity / parameters_.gas_temperature);
  const float plume_turbulence =
      static_cast<float>(parameters_.plume_turbulence / parameters_.gas_temperature);
  const float entrainment = static_cast<float>(parameters_.entrainment);
  const float cooling = parameters_.cooling_time > 0.0
                            ? static_cast<float>(std::exp(-dt / parameters_.cooling_time))
                            : 0.0f;

  parallel_chunks(particles_.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    std::array<Vec3f, kChunk> accelerations;
    std::copy(forces_.accelerations().begin() + begin, forces_.accelerations().begin() + end,
              accelerations.begin());
    std::array<float, kChunk> turbulence;
    for (std::size_t i = begin; i < end; ++i) {
      turbulence[i - begin] = 1.0f + plume_turbulence * std::max(0.0f, particles_.temperatures[i]);
    }
    swirl_.add(time_, std::span(particles_.positions).subspan(begin, end - begin), turbulence,
               accelerations);
    for (std::size_t i = begin; i < end; ++i) {
      const Random random(parameters_.seed, particles_.ids[i]);
      Vec3f acceleration = accelerations[i - begin];
      const float noise = white * turbulence[i - begin];
      for (int axis = 0; axis < 3; ++axis) {
        acceleration[axis] += noise * nearly_normal(random.bits(3 * substeps_ + axis));
      }
      acceleration.z() += lift * particles_.temperatures[i];

      Vec3f& velocity = particles_.velocities[i];
      Vec3f& position = particles_.positions[i];
      const float drag = forces_.drag()[i] + entrainment * velocity.norm();
      velocity = (velocity + step * acceleration) / (1.0f + step * drag);
      position += step * velocity;
      for (int axis = 0; axis < 3; ++axis) {
        keep_inside(position[axis], velocity[axis], extent[axis]);
      }
      particles_.temperatures[i] *= cooling;
      particles_.ages[i] += step;
    }
  });
}

void SmokeVolume::retire_aged() {
  const float lifetime = static_cast<float>(parameters_.lifetime);
  std::vector<std::uint8_t> ending(particles_.size());
  std::ranges::transform(particles_.ages, ending.begin(),
                         [&](float age) { return age > lifetime; });
  remove(ending);
}

// Ids count up, so the oldest are the least.
void SmokeVolume::retire_oldest(std::size_t count) {
  counters_.crowded_out += count;
  std::vector<std::uint32_t> ids = particles_.ids;
  std::ranges::nth_element(ids, ids.begin() + static_cast<std::ptrdiff_t>(count - 1));
  const std::uint32_t last = ids[count - 1];
  std::vector<std::uint8_t> ending(particles_.size());
  std::ranges::transform(particles_.ids, ending.begin(),
                         [&](std::uint32_t id) { return id <= last; });
  remove(ending);
}

void SmokeVolume::remove(const std::vector<std::uint8_t>& ending) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < particles_.size(); ++i) {
    if (ending[i]) {
      ++counters_.retired;
      counters_.retired_mass += particles_.masses[i];
      continue;
    }
    if (kept != i) {
      particles_.positions[kept] = particles_.positions[i];
      particles_.velocities[kept] = particles_.velocities[i];
      particles_.temperatures[kept] = particles_.temperatures[i];
      particles_.masses[kept] = particles_.masses[i];
      particles_.ages[kept] = particles_.ages[i];
      particles_.ids[kept] = particles_.ids[i];
    }
    ++kept;
  }
  particles_.positions.resize(kept);
  particles_.velocities.resize(kept);
  particles_.temperatures.resize(kept);
  particles_.masses.resize(kept);
  particles_.ages.resize(kept);
  particles_.ids.resize(kept);
}

std::size_t SmokeVolume::memory_bytes() const {
  return particles_.memory_bytes() + bins_.memory_bytes() + forces_.memory_bytes();
}

}  // namespace viscera
