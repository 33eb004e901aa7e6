#include "kernels/smoke/swirl.h"

#include <cmath>
#include <cstring>

#include "kernels/base/lanes.h"
#include "kernels/base/random.h"
#include "kernels/base/wide.h"

namespace viscera {
namespace {

constexpr std::uint64_t kSwirlStream = 0x5749'524cull;

constexpr float kRound = 12582912.0f;  // 1.5 * 2^23: the next floats are whole numbers

}  // namespace

SwirlField::SwirlField(std::uint64_t seed, double size, double wavelength, double period)
    : active_(size > 0.0 && wavelength > 0.0 && period > 0.0) {
  if (!active_) return;
  const Random random(seed, kSwirlStream);
  // The square of a sine has the mean 1/2.
  const double amplitude = size * std::sqrt(2.0 / kWaves);
  for (int m = 0; m < kWaves; ++m) {
    const std::uint64_t first = 16 * static_cast<std::uint64_t>(m);
    const Vec3 along = random.direction(first);
    const Vec3 other = random.direction(first + 1);
    Vec3 across = along.cross(other);
    if (across.norm() < 1e-3) across = along.unitOrthogonal();
    // Wavelengths evenly in log scale, in strata, so that every set of waves has large and small.
    const double level = (m + random.uniform(first + 8)) / kWaves;
    const double length = 0.25 * wavelength * std::pow(6.0, level);
    const double turnover = period * std::pow(length / wavelength, 2.0 / 3.0);
    const double sign = random.uniform(first + 9) < 0.5 ? -1.0 : 1.0;
    waves_[m] = {.amplitude = (amplitude * across.normalized()).cast<float>(),
                 .wave_number = (along / length).cast<float>(),
                 .frequency = sign * (0.5 + random.uniform(first + 10)) / turnover,
                 .phase = random.uniform(first + 11)};
  }
}

std::vector<SwirlWave> SwirlField::waves(double t) const {
  std::vector<SwirlWave> waves;
  if (!active_) return waves;
  for (const Wave& wave : waves_) {
    const double turns = wave.phase + wave.frequency * t;
    waves.push_back(
        {Float4::from(wave.amplitude),
         Float4::from(wave.wave_number, static_cast<float>(turns - std::floor(turns)))});
  }
  return waves;
}

VISCERA_WIDE void sum_swirl(std::span<const SwirlWave> waves, SwirlBlock& block) {
  for (int first = 0; first < SwirlBlock::kSize; first += kLanes) {
    Lanes x, y, z;
    load(x, block.x.data() + first);
    load(y, block.y.data() + first);
    load(z, block.z.data() + first);
    Lanes ax = {}, ay = {}, az = {};
    for (std::size_t m = 0; m < waves.size(); ++m) {
      const Float4 &k = waves[m].wave_number, &e = waves[m].amplitude;
      // A sine made of two parabolas with a correction, within 0.0012, cheap in SIMD: the field's
      // divergence vanishes for any function of the phase. Adding and taking kRound rounds.
      Lanes phase = k.x * x + k.y * y + k.z * z + k.w;
      phase -= (phase + kRound) - kRound;
      const Lanes parabola = phase * (8.0f - 16.0f * (phase < 0.0f ? -phase : phase));
      const Lanes sine = parabola * (0.775f + 0.225f * (parabola < 0.0f ? -parabola : parabola));
      ax += e.x * sine;
      ay += e.y * sine;
      az += e.z * sine;
    }
    std::memcpy(block.ax.data() + first, &ax, sizeof ax);
    std::memcpy(block.ay.data() + first, &ay, sizeof ay);
    std::memcpy(block.az.data() + first, &az, sizeof az);
  }
}

}  // namespace viscera
