#include "kernels/smoke/viscosity.h"

#include <algorithm>
#include <cstring>

#include "kernels/base/parallel.h"
#include "kernels/base/wide.h"
#include "kernels/base/wider.h"

namespace viscera {
namespace {

constexpr std::size_t kChunk = 4096;
constexpr std::size_t kCellChunk = 64;

/// Copies these numbers of each column to columns `stride` apart, in whole lanes: up to kLanes - 1
/// too many are read and written.
VISCERA_WIDE void copy_run(std::span<const float* const> columns, std::size_t first,
                           std::size_t count, float* to, std::size_t stride) {
  for (std::size_t i = 0; i < count; i += kLanes) {
    for (std::size_t c = 0; c < columns.size(); ++c) {
      Lanes eight;
      load(eight, columns[c] + first + i);
      std::memcpy(to + c * stride + i, &eight, sizeof eight);
    }
  }
}

/// What surrounds a cell, gathered once for all its particles and padded to whole lanes with places
/// out of everyone's reach.
class Neighbourhood {
 public:
  /// Copies these columns of the nine runs; they go on for kLanes behind the last one.
  void gather(const std::array<SmokeBins::Run, 9>& runs, std::span<const float* const> columns) {
    std::size_t most = kWiderLanes;
    for (const auto& [first, last] : runs) most += last - first;
    if (most > capacity_) {
      const std::size_t blocks = 2 * most / kWiderLanes + 1;
      capacity_ = blocks * kWiderLanes;
      storage_.resize(kColumns * blocks);
    }
    count_ = 0;
    for (const auto& [first, last] : runs) {
      copy_run(columns, first, last - first, column(0) + count_, capacity_);
      count_ += last - first;
    }
    for (std::size_t c = 0; c < columns.size(); ++c) {
      std::fill_n(column(c) + count_, kWiderLanes, c == 0 ? kFar : 0.0f);
    }
  }
  float* column(std::size_t c) { return storage_.front().of.data() + c * capacity_; }
  std::size_t count() const { return count_; }

 private:
  static constexpr std::size_t kColumns = 8;
  static constexpr float kFar = 1e6f;
  struct alignas(64) Block {  // so that no load of sixteen straddles two cache lines
    std::array<float, kWiderLanes> of;
  };
  std::vector<Block> storage_;
  std::size_t capacity_ = 0, count_ = 0;
};

struct DensitySums {
  float cubes, squares;  ///< of q, over all but without regard to which is the particle itself
  float x, y, z;         ///< of q^2 times the vectors to neighbours
  float near;            ///< number within the support
};

template <class Wide>
VISCERA_INLINE void sum_densities_on(const float* x, const float* y, const float* z,
                                     std::size_t count, const float* own_x, const float* own_y,
                                     const float* own_z, std::size_t own, float inverse_square,
                                     DensitySums* sums) {
  using Lanes = typename Wide::Lanes;
  constexpr int kParts = Wide::kParts, kEach = kWiderLanes / kParts;
  for (std::size_t i = 0; i < own; ++i) {
    Lanes cubes[kParts] = {}, squares[kParts] = {}, near[kParts] = {};
    Lanes fx[kParts] = {}, fy[kParts] = {}, fz[kParts] = {};
    const Lanes zero = {}, one = zero + 1.0f;
    for (std::size_t j = 0; j < count; j += kWiderLanes) {
      for (int part = 0; part < kParts; ++part) {
        Lanes dx, dy, dz;
        load(dx, x + j + part * kEach);
        load(dy, y + j + part * kEach);
        load(dz, z + j + part * kEach);
        dx -= own_x[i];
        dy -= own_y[i];
        dz -= own_z[i];
        Lanes q = 1.0f - (dx * dx + dy * dy + dz * dz) * inverse_square;
        near[part] += q > zero ? one : zero;
        q = q > zero ? q : zero;
        const Lanes square = q * q;
        squares[part] += square;
        cubes[part] += square * q;
        fx[part] += square * dx;
        fy[part] += square * dy;
        fz[part] += square * dz;
      }
    }
    sums[i] = {Wide::sum(cubes), Wide::sum(squares), Wide::sum(fx),
               Wide::sum(fy),    Wide::sum(fz),      Wide::sum(near)};
  }
}

struct PairColumns {
  const float *x, *y, *z, *vx, *vy, *vz, *strength, *excess;
};

template <class Wide>
VISCERA_INLINE void sum_pairs_on(const PairColumns& other, std::size_t count,
                                 const PairColumns& self, std::size_t own, float inverse_square,
                                 float viscosity, float crowding, Float4* out) {
  using Lanes = typename Wide::Lanes;
  constexpr int kParts = Wide::kParts, kEach = kWiderLanes / kParts;
  for (std::size_t i = 0; i < own; ++i) {
    Lanes ax[kParts] = {}, ay[kParts] = {}, az[kParts] = {};
    const Lanes zero = {};
    const Lanes own_strength = zero + self.strength[i];
    const float excess = self.excess[i];
    for (std::size_t j = 0; j < count; j += kWiderLanes) {
      for (int part = 0; part < kParts; ++part) {
        const std::size_t at = j + part * kEach;
        Lanes dx, dy, dz, vx, vy, vz, g, e;
        load(dx, other.x + at);
        load(dy, other.y + at);
        load(dz, other.z + at);
        dx -= self.x[i];
        dy -= self.y[i];
        dz -= self.z[i];
        Lanes q = 1.0f - (dx * dx + dy * dy + dz * dz) * inverse_square;
        q = q > zero ? q : zero;
        load(g, other.strength + at);
        const Lanes mean = 0.5f * (g + own_strength);
        const Lanes bound = kMostRatio * (g < own_strength ? g : own_strength);
        const Lanes weight = q * q * (mean < bound ? mean : bound);
        load(e, other.excess + at);
        const Lanes exchange = viscosity * weight;
        const Lanes push = crowding * weight * (e + excess);
        load(vx, other.vx + at);
        load(vy, other.vy + at);
        load(vz, other.vz + at);
        ax[part] += exchange * (vx - self.vx[i]) - push * dx;
        ay[part] += exchange * (vy - self.vy[i]) - push * dy;
        az[part] += exchange * (vz - self.vz[i]) - push * dz;
      }
    }
    out[i].x = Wide::sum(ax);
    out[i].y = Wide::sum(ay);
    out[i].z = Wide::sum(az);
  }
}

// A pair of functions for each target; sum_pairs leaves w of `out` alone.
#define VISCERA_SUMS(target, Wide)                                                               \
  target void sum_densities(const float* x, const float* y, const float* z, std::size_t count,   \
                            const float* own_x, const float* own_y, const float* own_z,          \
                            std::size_t own, float inverse_square, DensitySums* sums) {          \
    sum_densities_on<Wide>(x, y, z, count, own_x, own_y, own_z, own, inverse_square, sums);      \
  }                                                                                              \
  target void sum_pairs(const PairColumns& other, std::size_t count, const PairColumns& self,    \
                        std::size_t own, float inverse_square, float viscosity, float crowding,  \
                        Float4* out) {                                                           \
    sum_pairs_on<Wide>(other, count, self, own, inverse_square, viscosity, crowding, out);       \
  }
#if VISCERA_THREE_TARGETS
VISCERA_SUMS(VISCERA_FOR_AVX512, OneWide)
VISCERA_SUMS(VISCERA_FOR_AVX2, TwoNarrow)
#endif
VISCERA_SUMS(VISCERA_FOR_ANY, TwoNarrow)
#undef VISCERA_SUMS

}  // namespace

void ViscosityPass::run(std::span<const Float4> positions, std::span<const Float4> velocities,
                        const SmokeBins& bins, const ViscosityParameters& parameters) {
  const std::size_t count = positions.size();
  for (std::vector<float>* values : {&x_, &y_, &z_, &vx_, &vy_, &vz_, &strength_, &excess_}) {
    values->resize(count + kLanes);  // gather() reads whole lanes
  }
  accelerations_.resize(count);
  parallel_for_each_index(count, kChunk, [&](std::size_t i) {
    x_[i] = positions[i].x, y_[i] = positions[i].y, z_[i] = positions[i].z;
    vx_[i] = velocities[i].x, vy_[i] = velocities[i].y, vz_[i] = velocities[i].z;
  });
  density(bins, parameters);
  pairs(bins, parameters);
  if (parameters.laplacian == Laplacian::paper) {
    add_paper_viscosity(positions, velocities, strength_, bins, parameters, accelerations_);
  }
}

void ViscosityPass::density(const SmokeBins& bins, const ViscosityParameters& parameters) {
  const auto cells = [&](std::size_t begin, std::size_t end) {
    thread_local Neighbourhood around;
    thread_local std::vector<DensitySums> sums;
    std::uint64_t isolated = 0;
    for (std::size_t c = begin; c < end; ++c) {
      const auto [first, last] = bins.own(bins.occupied[c]);
      around.gather(bins.runs(bins.occupied[c]),
                    std::array<const float*, 3>{x_.data(), y_.data(), z_.data()});
      sums.resize(last - first);
      sum_densities(around.column(0), around.column(1), around.column(2), around.count(),
                    x_.data() + first, y_.data() + first, z_.data() + first, last - first,
                    parameters.inverse_square, sums.data());
      for (std::size_t i = first; i < last; ++i) {
        const DensitySums& s = sums[i - first];
        const bool alone = s.near < static_cast<float>(parameters.fewest_neighbours + 1);  // itself
        isolated += alone;
        // Itself counts with q = 1 in both sums, so it drops out of the second moment
        // sum q^2 r^2/h^2 = sum q^2 (1 - q).
        const float moment = s.squares - s.cubes;
        const float first_square = (s.x * s.x + s.y * s.y + s.z * s.z) * parameters.inverse_square;
        const float relaxed = moment - 2.0f * first_square / std::max(s.squares - 1.0f, 1e-6f);
        const float used = std::max({relaxed, kLeastOfMoment * moment, kLeastOfDensity * s.cubes});
        strength_[i] = alone ? 0.0f : 6.0f * parameters.inverse_square / used;
        const float phi = parameters.fill * s.cubes;
        excess_[i] = std::clamp(phi - 1.0f, 0.0f, parameters.most_excess);
        accelerations_[i].w = parameters.gas_drag * std::max(0.0f, 1.0f - phi);
      }
    }
    return isolated;
  };
  isolated_ = parallel_sum(bins.occupied.size(), kCellChunk, std::uint64_t{0}, cells);
}

void ViscosityPass::pairs(const SmokeBins& bins, const ViscosityParameters& parameters) {
  const float viscosity = parameters.laplacian == Laplacian::pairwise ? parameters.viscosity : 0.0f;
  parallel_chunks(bins.occupied.size(), kCellChunk, [&](std::size_t begin, std::size_t end) {
    thread_local Neighbourhood around;
    const std::array<const float*, 8> columns = {x_.data(),        y_.data(),     z_.data(),
                                                 vx_.data(),       vy_.data(),    vz_.data(),
                                                 strength_.data(), excess_.data()};
    for (std::size_t c = begin; c < end; ++c) {
      const auto [first, last] = bins.own(bins.occupied[c]);
      around.gather(bins.runs(bins.occupied[c]), columns);
      const PairColumns other = {around.column(0), around.column(1), around.column(2),
                                 around.column(3), around.column(4), around.column(5),
                                 around.column(6), around.column(7)};
      const PairColumns self = {columns[0] + first, columns[1] + first, columns[2] + first,
                                columns[3] + first, columns[4] + first, columns[5] + first,
                                columns[6] + first, columns[7] + first};
      sum_pairs(other, around.count(), self, last - first, parameters.inverse_square, viscosity,
                parameters.crowding, accelerations_.data() + first);
    }
  });
}

std::size_t ViscosityPass::memory_bytes() const {
  return 8 * x_.capacity() * sizeof(float) + accelerations_.capacity() * sizeof(Float4);
}

}  // namespace viscera
