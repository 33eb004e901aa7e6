#include "kernels/smoke/smoke_forces.h"

#include <algorithm>
#include <limits>
#include <numbers>

#include "kernels/base/parallel.h"

namespace viscera {
namespace {

constexpr std::size_t kChunk = 256;
constexpr int kLanes = 4;
using Lanes = Eigen::Array4f;

// Crowding stays as gentle as at this excess where a source overfills its surroundings.
constexpr double kMostExcess = 4.0;

// The kernel's norm 315 / (64 pi), its value at r = 0 in units of 1/h^3.
constexpr double kKernelNorm = 315.0 / (64.0 * std::numbers::pi);

inline Lanes load(const std::vector<float>& values, std::size_t first) {
  return Eigen::Map<const Lanes>(values.data() + first);
}

// q = 1 - r^2/h^2 inside the support, 0 outside and in lanes past the end of a run.
inline Lanes closeness(const Lanes& dx, const Lanes& dy, const Lanes& dz, float inverse_square,
                       std::size_t left) {
  static const Lanes lane(0.0f, 1.0f, 2.0f, 3.0f);
  const Lanes q = (1.0f - (dx * dx + dy * dy + dz * dz) * inverse_square).max(0.0f);
  if (left >= kLanes) return q;
  return (lane < static_cast<float>(left)).select(q, 0.0f);
}

}  // namespace

double effective_viscosity(const SmokeParameters& parameters) {
  return parameters.gas_viscosity / parameters.gas_density + parameters.eddy_viscosity;
}

void SmokeForces::compute(const SmokeParticles& particles, const SmokeBins& bins,
                          const SmokeParameters& parameters) {
  const std::size_t count = particles.size();
  const double h = parameters.spacing;
  const double nu = effective_viscosity(parameters);
  const float inverse_square = static_cast<float>(1.0 / (h * h));

  for (std::vector<float>* values : {&x_, &y_, &z_, &vx_, &vy_, &vz_, &excess_, &number_density_}) {
    values->resize(count + kLanes, 0.0f);
  }
  accelerations_.resize(count);
  drag_.resize(count);
  parallel_for_each_index(count, 4 * kChunk, [&](std::size_t i) {
    x_[i] = particles.positions[i].x();
    y_[i] = particles.positions[i].y();
    z_[i] = particles.positions[i].z();
    vx_[i] = particles.velocities[i].x();
    vy_[i] = particles.velocities[i].y();
    vz_[i] = particles.velocities[i].z();
  });

  const double rest_drag = parameters.surrounding_drag * 18.0 * nu / (h * h);
  const double fill = kKernelNorm / 8.0;  // phi per sum of q^3: norm / h^3 times V = (h/2)^3
  isolated_ =
      parallel_sum(count, kChunk, std::uint64_t{0}, [&](std::size_t begin, std::size_t end) {
        std::uint64_t isolated = 0;
        for (std::size_t i = begin; i < end; ++i) {
          Lanes cubes = Lanes::Zero(), near = Lanes::Zero();
          for (const auto& [first, last] : bins.runs(particles.positions[i])) {
            for (std::size_t j = first; j < last; j += kLanes) {
              const Lanes q = closeness(load(x_, j) - x_[i], load(y_, j) - y_[i],
                                        load(z_, j) - z_[i], inverse_square, last - j);
              cubes += q * q * q;
              near += (q > 0.0f).select(Lanes::Ones(), 0.0f);
            }
          }
          const bool alone = near.sum() < 1.0f + kFewestNeighbours;
          isolated += alone;
          const float sum = cubes.sum();
          number_density_[i] = alone ? std::numeric_limits<float>::infinity() : sum;
          const double phi = fill * sum;
          drag_[i] = static_cast<float>(rest_drag * std::max(0.0, 1.0 - phi));
          excess_[i] = static_cast<float>(std::clamp(phi - 1.0, 0.0, kMostExcess));
        }
        return isolated;
      });

  // 2 / (n_i + n_j) (-W'/r) is 12 q^2 / h^2 / (n_i + n_j) with n in units of the kernel's norm. The
  // infinite density of an isolated particle takes its pairs out.
  const float viscous = static_cast<float>(24.0 * nu / (h * h));
  const float crowding =
      static_cast<float>(12.0 * parameters.crowding_speed * parameters.crowding_speed / (h * h));
  parallel_for_each_index(count, kChunk, [&](std::size_t i) {
    Lanes ax = Lanes::Zero(), ay = Lanes::Zero(), az = Lanes::Zero();
    const float own = number_density_[i];
    if (own < std::numeric_limits<float>::infinity()) {
      for (const auto& [first, last] : bins.runs(particles.positions[i])) {
        for (std::size_t j = first; j < last; j += kLanes) {
          const Lanes dx = load(x_, j) - x_[i], dy = load(y_, j) - y_[i], dz = load(z_, j) - z_[i];
          const Lanes q = closeness(dx, dy, dz, inverse_square, last - j);
          if (!(q > 0.0f).any()) continue;
          const Lanes weight = q * q / (load(number_density_, j) + own);
          const Lanes push = -crowding * weight * (load(excess_, j) + excess_[i]);
          const Lanes exchange = viscous * weight;
          ax += exchange * (load(vx_, j) - vx_[i]) + push * dx;
          ay += exchange * (load(vy_, j) - vy_[i]) + push * dy;
          az += exchange * (load(vz_, j) - vz_[i]) + push * dz;
        }
      }
    }
    accelerations_[i] = {ax.sum(), ay.sum(), az.sum()};
  });
}

std::size_t SmokeForces::memory_bytes() const {
  return (7 * x_.capacity() + number_density_.capacity() + drag_.capacity()) * sizeof(float) +
         accelerations_.capacity() * sizeof(Vec3f);
}

}  // namespace viscera
