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

}  // namespace

void integrate(std::span<Float4> positions, std::span<Float4> velocities,
               std::span<const std::uint32_t> ids, std::span<const Float4> accelerations,
               std::span<const Float4> gas, std::span<const SwirlWave> waves,
               const IntegrateParameters& parameters) {
  const float dt = parameters.step;
  const Float4& extent = parameters.extent;
  const auto open = [&](std::uint32_t side) { return (parameters.open_sides & side) != 0; };
  const auto move = [&](std::size_t i, const Vec3f& swirl) {
    Float4 &position = positions[i], &velocity = velocities[i];
    Vec3f v = velocity.xyz(), u = Vec3f::Zero();
    float eddies = parameters.turbulence * v.norm();
    if (!gas.empty()) u = gas[i].xyz(), eddies = gas[i].w;
    const RandomWords random = random_words(ids[i], parameters.substep, parameters.seed);
    const Vec3f noise(nearly_normal(random.x), nearly_normal(random.y), nearly_normal(random.z));
    const Vec3f flow = u + eddies * (swirl + parameters.white * noise);
    Vec3f acceleration = accelerations[i].xyz();
    acceleration.z() +=
        parameters.gravity * (position.w / (parameters.gas_temperature + position.w));
    const float rate = accelerations[i].w + parameters.entrainment * (v - u).norm();
    v = (v + dt * (acceleration + rate * flow)) / (1.0f + dt * rate);
    velocity.set_xyz(v);
    position.set_xyz(position.xyz() + dt * v);
    keep_inside(position.x, velocity.x, extent.x, extent.w, open(kOpenLowX), open(kOpenHighX));
    keep_inside(position.y, velocity.y, extent.y, extent.w, open(kOpenLowY), open(kOpenHighY));
    keep_inside(position.z, velocity.z, extent.z, extent.w, open(kOpenLowZ), open(kOpenHighZ));
    position.w /= 1.0f + dt * parameters.cooling * rate;
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
