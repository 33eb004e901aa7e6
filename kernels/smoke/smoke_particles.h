// The particles of one smoke volume.
#pragma once

#include <cstdint>
#include <vector>

#include "kernels/smoke/smoke_passes.h"

namespace viscera {

/// Parcels of smoky gas, in arrays that the GPU takes as they are; order changes from step to step,
/// `ids` don't.
struct SmokeParticles {
  std::vector<Float4> positions;   ///< from the domain's least corner [m]; w: excess [K]    (n)
  std::vector<Float4> velocities;  ///< [m/s]; w: age [s]                                    (n)
  std::vector<float> masses;       ///< of smoke carried [kg]                                (n)
  std::vector<std::uint32_t> ids;  ///< number of emission: key of its random numbers        (n)

  std::size_t size() const { return positions.size(); }
  Vec3f position(std::size_t i) const { return positions[i].xyz(); }
  Vec3f velocity(std::size_t i) const { return velocities[i].xyz(); }
  float temperature(std::size_t i) const { return positions[i].w; }  ///< over the gas [K]
  float age(std::size_t i) const { return velocities[i].w; }         ///< [s]

  void resize(std::size_t count) {
    positions.resize(count);
    velocities.resize(count);
    masses.resize(count);
    ids.resize(count);
  }
  void copy(std::size_t from, const SmokeParticles& source, std::size_t to) {
    positions[to] = source.positions[from];
    velocities[to] = source.velocities[from];
    masses[to] = source.masses[from];
    ids[to] = source.ids[from];
  }
  std::size_t memory_bytes() const {
    return 2 * positions.capacity() * sizeof(Float4) + 2 * ids.capacity() * sizeof(float);
  }
  static constexpr auto fields() {
    using P = SmokeParticles;
    return std::tuple(field("positions", &P::positions), field("velocities", &P::velocities),
                      field("masses", &P::masses), field("ids", &P::ids));
  }
};
static_assert(is_flat<Float4>() && fields_cover<SmokeParticles>());

}  // namespace viscera
