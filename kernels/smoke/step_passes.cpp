#include "kernels/smoke/step_passes.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "kernels/base/stopwatch.h"
#include "kernels/smoke/integrate.h"

namespace viscera {

template <class Pass>
void CpuSmokePasses::timed(const char* name, const Pass& pass) {
  const Stopwatch watch;
  pass();
  if (seconds_ != nullptr) (*seconds_)[name] += watch.seconds();
}

bool CpuSmokePasses::start(SmokeParticles& particles) {
  particles_ = &particles;
  fates_.assign(particles.size(), SmokeFate::kAirborne);
  deposited_ = 0.0;
  return true;
}

void CpuSmokePasses::exchange(float cell, ViscosityParameters parameters) {
  timed("bin", [&] { bin(*particles_, cell, bins_); });
  parameters.particles = static_cast<std::uint32_t>(particles_->size());
  timed("viscosity",
        [&] { viscosity_.run(particles_->positions, particles_->velocities, bins_, parameters); });
}

void CpuSmokePasses::integrate(IntegrateParameters parameters, std::span<const SwirlWave> waves,
                               SurroundingGas* gas) {
  parameters.particles = static_cast<std::uint32_t>(particles_->size());
  parameters.waves = static_cast<std::uint32_t>(waves.size());
  gas_.resize(gas != nullptr ? particles_->size() : 0);
  if (gas != nullptr) gas->velocity(particles_->positions, gas_);
  timed("integrate", [&] {
    viscera::integrate(particles_->positions, particles_->velocities, particles_->ids,
                       viscosity_.accelerations(), gas_, waves, parameters);
  });
}

CollideCounts CpuSmokePasses::collide(SurfaceCells& cells, const SurfaceMeeting& meeting,
                                      std::span<const SmokeCapsule> capsules,
                                      CollideParameters parameters) {
  parameters.particles = static_cast<std::uint32_t>(particles_->size());
  parameters.capsules = static_cast<std::uint32_t>(capsules.size());
  CollideCounts counts;
  timed("collide", [&] {
    cells.build(particles_->positions, particles_->velocities, meeting.fraction, meeting.dt,
                meeting.cell, meeting.reach, capsules);
    parameters.origin = cells.grid().origin;
    parameters.size = cells.grid().size;
    parameters.inverse_cell = cells.grid().inverse_cell;
    counts = viscera::collide(particles_->positions, particles_->velocities, particles_->masses,
                              cells, capsules, parameters, fates_);
  });
  deposited_ += counts.deposited;
  return counts;
}

float CpuSmokePasses::greatest_speed() {
  float most = 0.0f;
  for (const Float4& v : particles_->velocities) most = std::max(most, v.xyz().squaredNorm());
  return std::sqrt(most);
}

std::optional<double> CpuSmokePasses::finish(SmokeParticles& particles,
                                             std::vector<SmokeFate>& fates) {
  if (particles_ != &particles) return std::nullopt;
  std::swap(fates, fates_);
  particles_ = nullptr;
  return deposited_;
}

bool CpuSmokePasses::splat(const SmokeParticles& particles, SplatParameters& parameters,
                           SmokeGrid& grid) {
  timed("splat", [&] {
    viscera::splat(particles.positions, particles.velocities, particles.masses, parameters, grid);
  });
  return true;
}

std::size_t CpuSmokePasses::memory_bytes() const {
  return bins_.memory_bytes() + viscosity_.memory_bytes() + gas_.capacity() * sizeof(Float4) +
         fates_.capacity();
}

}  // namespace viscera
