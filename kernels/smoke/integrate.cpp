#include "kernels/smoke/integrate.h"

#include <algorithm>
#include <cmath>

#include "kernels/base/parallel.h"
#include "kernels/smoke/swirl.h"

namespace viscera {
namespace {

constexpr std::size_t kChunk = 16 * SwirlBlock::kSize;

/// Inelastic sides: the overshoot comes back shortened and slowed, motion along the side goes on.
inline void keep_inside(float& position, float& velocity, float extent, float restitution,
                        bool low_open, bool high_open) {
  if (position < 0.0f && !low_open) {
    position = std::min(-restitution * position, extent);
    velocity = -restitution * velocity;
  } else if (position > extent && !high_open) {
    position = std::max(extent - restitution * (position - extent), 0.0f);
    velocity = -restitution * velocity;
  }
}

inline float drag_rate(const Vec3f& velocity, const Vec3f& gas, float drag, float entrainment) {
  return drag + entrainment * (velocity - gas).norm();
}

}  // namespace

void exchanged_mass(std::span<const Float4> velocities, std::span<const Float4> accelerations,
                    std::span<const Float4> gas, const IntegrateParameters& parameters,
                    std::span<float> exchanged) {
  const float mass = parameters.parcel_mass * parameters.step;
  parallel_for_each_index(velocities.size(), kChunk, [&](std::size_t i) {
    exchanged[i] = mass * drag_rate(velocities[i].xyz(), gas[i].xyz(), accelerations[i].w,
                                    parameters.entrainment);
  });
}

void integrate(std::span<Float4> positions, std::span<Float4> velocities,
               std::span<const std::uint32_t> ids, std::span<const Float4> accelerations,
               std::span<const Float4> gas, std::span<const SwirlWave> waves,
               const IntegrateParameters& parameters, std::span<Float4> impulses) {
  const float dt = parameters.step;
  const Float4& extent = parameters.extent;
  const auto open = [&](std::uint32_t side) { return (parameters.open_sides & side) != 0; };
  const auto move = [&](std::size_t i, const Vec3f& swirl) {
    Float4 &position = positions[i], &velocity = velocities[i];
    const float turbulence = 1.0f + parameters.plume_turbulence * std::max(0.0f, position.w);
    const RandomWords random = random_words(ids[i], parameters.substep, parameters.seed);
    const Vec3f noise(nearly_normal(random.x), nearly_normal(random.y), nearly_normal(random.z));
    Vec3f acceleration = accelerations[i].xyz() + turbulence * (swirl + parameters.white * noise);
    acceleration.z() +=
        parameters.gravity * (position.w / (parameters.gas_temperature + position.w));

    Vec3f u = Vec3f::Zero();
    float theta = 1.0f;
    if (!gas.empty()) u = gas[i].xyz(), theta = gas[i].w;
    Vec3f v = velocity.xyz();
    const float rate = theta * drag_rate(v, u, accelerations[i].w, parameters.entrainment);
    v = (v + dt * (acceleration + rate * u)) / (1.0f + dt * rate);
    if (!impulses.empty()) {
      impulses[i] = Float4::from(parameters.parcel_mass * rate * dt * (v - u));
    }
    velocity.set_xyz(v);
    position.set_xyz(position.xyz() + dt * v);
    keep_inside(position.x, velocity.x, extent.x, extent.w, open(kOpenLowX), open(kOpenHighX));
    keep_inside(position.y, velocity.y, extent.y, extent.w, open(kOpenLowY), open(kOpenHighY));
    keep_inside(position.z, velocity.z, extent.z, extent.w, open(kOpenLowZ), open(kOpenHighZ));
    position.w *= parameters.cooling;
    velocity.w += dt;
  };
  parallel_chunks(positions.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    SwirlBlock block = {};
    for (std::size_t first = begin; first < end; first += SwirlBlock::kSize) {
      const std::size_t count = std::min<std::size_t>(SwirlBlock::kSize, end - first);
      for (std::size_t i = 0; i < count; ++i) {
        block.x[i] = positions[first + i].x;
        block.y[i] = positions[first + i].y;
        block.z[i] = positions[first + i].z;
      }
      if (!waves.empty()) sum_swirl(waves, block);
      for (std::size_t i = 0; i < count; ++i) {
        move(first + i, {block.ax[i], block.ay[i], block.az[i]});
      }
    }
  });
}

}  // namespace viscera
