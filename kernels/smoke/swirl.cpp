#include "kernels/smoke/swirl.h"

#include <algorithm>
#include <cmath>

#include "kernels/base/random.h"

namespace viscera {
namespace {

constexpr std::uint64_t kSwirlStream = 0x5749'524cull;

// sin(2 pi t), within 2e-5: a polynomial, so that the loop over particles vectorises. The field's
// divergence vanishes for any function of the phase.
inline float sine_of_turns(float t) {
  t -= std::floor(t + 0.5f);
  // Folded to a quarter turn: sin(pi - x) = sin x.
  const float magnitude = std::min(std::abs(t), 0.5f - std::abs(t));
  const float x = std::copysign(magnitude, t);
  const float q = x * x;
  return x * (6.2831853f + q * (-41.341702f + q * (81.60525f - 73.9f * q)));
}

}  // namespace

SwirlField::SwirlField(std::uint64_t seed, double acceleration, double wavelength, double period)
    : active_(acceleration > 0.0 && wavelength > 0.0 && period > 0.0) {
  if (!active_) return;
  const Random random(seed, kSwirlStream);
  // The square of a sine has the mean 1/2.
  const double amplitude = acceleration * std::sqrt(2.0 / kWaves);
  for (int m = 0; m < kWaves; ++m) {
    const std::uint64_t first = 16 * static_cast<std::uint64_t>(m);
    const Vec3 along = random.direction(first);
    const Vec3 other = random.direction(first + 1);
    Vec3 across = along.cross(other);
    if (across.norm() < 1e-3) across = along.unitOrthogonal();
    // Wavelengths evenly in log scale, in strata, so that every set of waves has large and small.
    const double level = (m + random.uniform(first + 8)) / kWaves;
    const double length = 0.5 * wavelength * std::pow(3.0, level);
    const double sign = random.uniform(first + 9) < 0.5 ? -1.0 : 1.0;
    waves_[m] = {.amplitude = (amplitude * across.normalized()).cast<float>(),
                 .wave_number = (along / length).cast<float>(),
                 .frequency = sign * (0.5 + random.uniform(first + 10)) / period,
                 .phase = random.uniform(first + 11)};
  }
}

void SwirlField::add(double t, std::span<const Vec3f> positions,
                     std::span<Vec3f> accelerations) const {
  if (!active_) return;
  constexpr std::size_t kBlock = 64;
  std::array<float, kBlock> x, y, z, ax, ay, az;
  for (std::size_t begin = 0; begin < positions.size(); begin += kBlock) {
    const std::size_t count = std::min(kBlock, positions.size() - begin);
    x.fill(0.0f), y.fill(0.0f), z.fill(0.0f);
    ax.fill(0.0f), ay.fill(0.0f), az.fill(0.0f);
    for (std::size_t i = 0; i < count; ++i) {
      x[i] = positions[begin + i].x();
      y[i] = positions[begin + i].y();
      z[i] = positions[begin + i].z();
    }
    for (const Wave& wave : waves_) {
      const double turns = wave.phase + wave.frequency * t;
      const float phase = static_cast<float>(turns - std::floor(turns));
      const float kx = wave.wave_number.x(), ky = wave.wave_number.y(), kz = wave.wave_number.z();
      const float ex = wave.amplitude.x(), ey = wave.amplitude.y(), ez = wave.amplitude.z();
      for (std::size_t i = 0; i < kBlock; ++i) {
        const float s = sine_of_turns(kx * x[i] + ky * y[i] + kz * z[i] + phase);
        ax[i] += ex * s;
        ay[i] += ey * s;
        az[i] += ez * s;
      }
    }
    for (std::size_t i = 0; i < count; ++i) {
      accelerations[begin + i] += Vec3f(ax[i], ay[i], az[i]);
    }
  }
}

}  // namespace viscera
