#include "kernels/smoke/viscosity.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "kernels/base/parallel.h"
#include "kernels/base/wider.h"

#if VISCERA_THREE_TARGETS
#include <immintrin.h>
#endif

namespace viscera {
namespace {

constexpr std::size_t kChunk = 4096;
constexpr std::size_t kCellChunk = 64;

template <std::size_t kColumns>
using Columns = std::array<const float*, kColumns>;
using Runs = std::array<SmokeBins::Run, 9>;

/// The box about a cell's own particles, and how far they reach.
struct Reach {
  std::array<float, 3> low, high;
  float inverse_square;
  // A particle that rounding alone keeps out of reach is taken.
  static constexpr float kFurthest = 1.0f + 1e-5f;

  Reach(const Columns<3>& own, std::size_t count, float inverse_square_)
      : inverse_square(inverse_square_) {
    for (int axis = 0; axis < 3; ++axis) {
      const float* at = own[axis];
      float least = at[0], most = at[0];  // in registers, so that nothing branches
      for (std::size_t i = 1; i < count; ++i) {
        least = at[i] < least ? at[i] : least;
        most = at[i] > most ? at[i] : most;
      }
      low[axis] = least, high[axis] = most;
    }
  }
};

/// Which particles of a cell's runs may be within reach, as copy_near leaves it to copy_noted: by
/// sixteen a mask for each sixteen of a run; else their number in each block of a run and then
/// their places in it. At most as many as there are particles and runs and blocks.
using Note = std::uint16_t;
constexpr std::size_t kBlock = 64;

/// Copies of each column the numbers of those particles in the runs that may be within reach, in
/// their order, to columns `stride` apart; up to kWiderLanes behind them are written. Notes which
/// they were, and moves `notes` on. Returns how many there are. The columns are places.
VISCERA_INLINE std::size_t copy_near_on(const Columns<3>& columns, const Runs& runs,
                                        const Reach& reach, float* to, std::size_t stride,
                                        Note*& notes) {
  std::size_t kept = 0;
  for (const auto& [first, last] : runs) {
    for (std::size_t begin = first; begin < last; begin += kBlock) {
      const std::size_t length = std::min(kBlock, last - begin);
      std::array<float, kBlock> squares = {};
      for (int axis = 0; axis < 3; ++axis) {
        const float* at = columns[axis] + begin;
        const float low = reach.low[axis], high = reach.high[axis];
        for (std::size_t i = 0; i < length; ++i) {
          const float below = low - at[i], above = at[i] - high;
          const float beside = below > above ? below : above;
          const float way = beside > 0.0f ? beside : 0.0f;
          squares[i] += way * way;
        }
      }
      Note* taken = notes + 1;
      std::size_t number = 0;
      for (std::size_t i = 0; i < length; ++i) {
        taken[number] = static_cast<Note>(i);
        number += squares[i] * reach.inverse_square < Reach::kFurthest;
      }
      *notes = static_cast<Note>(number);
      for (std::size_t c = 0; c < 3; ++c) {
        for (std::size_t i = 0; i < number; ++i)
          to[c * stride + kept + i] = columns[c][begin + taken[i]];
      }
      notes += 1 + number;
      kept += number;
    }
  }
  return kept;
}

/// The same particles' numbers in other columns.
VISCERA_INLINE std::size_t copy_noted_on(const Columns<8>& columns, const Runs& runs,
                                         const Note*& notes, float* to, std::size_t stride) {
  std::size_t kept = 0;
  for (const auto& [first, last] : runs) {
    for (std::size_t begin = first; begin < last; begin += kBlock) {
      const std::size_t number = *notes;
      const Note* taken = notes + 1;
      for (std::size_t c = 0; c < 8; ++c) {
        for (std::size_t i = 0; i < number; ++i)
          to[c * stride + kept + i] = columns[c][begin + taken[i]];
      }
      notes += 1 + number;
      kept += number;
    }
  }
  return kept;
}

#if VISCERA_THREE_TARGETS
VISCERA_FOR_AVX512 VISCERA_INLINE std::size_t copy_near_by_sixteen(const Columns<3>& given,
                                                                   const Runs& runs,
                                                                   const Reach& reach, float* to,
                                                                   std::size_t stride,
                                                                   Note*& notes) {
  const Columns<3> columns = given;
  const WiderLanes zero = {};
  std::size_t kept = 0;
  for (const auto& [first, last] : runs) {
    for (std::size_t i = first; i < last; i += kWiderLanes) {
      const std::size_t left = last - i;
      const auto there = static_cast<__mmask16>(left < kWiderLanes ? (1u << left) - 1u : 0xffffu);
      WiderLanes square = zero;
      WiderLanes at[3];
      for (int axis = 0; axis < 3; ++axis) {
        at[axis] = _mm512_maskz_loadu_ps(there, columns[axis] + i);
        const WiderLanes below = reach.low[axis] - at[axis], above = at[axis] - reach.high[axis];
        const WiderLanes beside = below > above ? below : above;
        const WiderLanes way = beside > zero ? beside : zero;
        square += way * way;
      }
      const __mmask16 near = _mm512_mask_cmp_ps_mask(there, square * reach.inverse_square,
                                                     zero + Reach::kFurthest, _CMP_LT_OQ);
      for (int axis = 0; axis < 3; ++axis)
        _mm512_storeu_ps(to + axis * stride + kept, _mm512_maskz_compress_ps(near, at[axis]));
      *notes++ = near;
      kept += static_cast<std::size_t>(std::popcount(near));
    }
  }
  return kept;
}

VISCERA_FOR_AVX512 VISCERA_INLINE std::size_t copy_noted_by_sixteen(const Columns<8>& given,
                                                                    const Runs& runs,
                                                                    const Note*& notes, float* to,
                                                                    std::size_t stride) {
  const Columns<8> columns = given;
  const Note* note = notes;
  std::size_t kept = 0;
  for (const auto& [first, last] : runs) {
    for (std::size_t i = first; i < last; i += kWiderLanes) {
      const __mmask16 near = *note++;
      for (std::size_t c = 0; c < 8; ++c) {
        const __m512 all = _mm512_maskz_loadu_ps(near, columns[c] + i);
        _mm512_storeu_ps(to + c * stride + kept, _mm512_maskz_compress_ps(near, all));
      }
      kept += static_cast<std::size_t>(std::popcount(near));
    }
  }
  notes = note;
  return kept;
}
#endif

#define VISCERA_COPIES(target, near_, noted_)                                                    \
  target std::size_t copy_near(const Columns<3>& columns, const Runs& runs, const Reach& reach,  \
                               float* to, std::size_t stride, Note*& notes) {                    \
    return near_(columns, runs, reach, to, stride, notes);                                       \
  }                                                                                              \
  target std::size_t copy_noted(const Columns<8>& columns, const Runs& runs, const Note*& notes, \
                                float* to, std::size_t stride) {                                 \
    return noted_(columns, runs, notes, to, stride);                                             \
  }
#if VISCERA_THREE_TARGETS
VISCERA_COPIES(VISCERA_FOR_AVX512, copy_near_by_sixteen, copy_noted_by_sixteen)
VISCERA_COPIES(VISCERA_FOR_AVX2, copy_near_on, copy_noted_on)
#endif
VISCERA_COPIES(VISCERA_FOR_ANY, copy_near_on, copy_noted_on)
#undef VISCERA_COPIES

/// What surrounds a cell, gathered once for all its particles and padded to whole lanes with places
/// out of everyone's reach.
class Neighbourhood {
 public:
  /// Copies the places of what is near in the nine runs; appends to `notes` which that is.
  void find(const Runs& runs, const Reach& reach, const Columns<3>& places,
            std::vector<Note>& notes) {
    const std::size_t most = reserve(runs), begin = notes.size();
    notes.resize(begin + 2 * most + 2 * runs.size());
    Note* end = notes.data() + begin;
    count_ = copy_near(places, runs, reach, column(0), capacity_, end);
    notes.resize(static_cast<std::size_t>(end - notes.data()));
    pad(3);
  }
  /// Copies these columns of what was found so; moves `notes` on.
  void copy(const Runs& runs, const Columns<8>& columns, const Note*& notes) {
    reserve(runs);
    count_ = copy_noted(columns, runs, notes, column(0), capacity_);
    pad(8);
  }
  float* column(std::size_t c) { return storage_.front().of.data() + c * capacity_; }
  std::size_t count() const { return count_; }

 private:
  static constexpr std::size_t kMostColumns = 8;
  static constexpr float kFar = 1e6f;
  std::size_t reserve(const Runs& runs) {
    std::size_t most = kWiderLanes;
    for (const auto& [first, last] : runs) most += last - first;
    if (most > capacity_) {
      const std::size_t blocks = 2 * most / kWiderLanes + 1;
      capacity_ = blocks * kWiderLanes;
      storage_.resize(kMostColumns * blocks);
    }
    return most;
  }
  void pad(std::size_t columns) {
    for (std::size_t c = 0; c < columns; ++c)
      std::fill_n(column(c) + count_, kWiderLanes, c == 0 ? kFar : 0.0f);
  }
  struct alignas(64) Block {  // so that no load of sixteen straddles two cache lines
    std::array<float, kWiderLanes> of;
  };
  std::vector<Block> storage_;
  std::size_t capacity_ = 0, count_ = 0;
};

/// In the order in which sums_of_eight leaves them.
struct DensitySums {
  float cubes;  ///< of q, over all, the particle itself included
  float x, z;   ///< of q^2 times the vectors from neighbours
  float unused;
  float squares;  ///< of q
  float y;        ///< as x and z
  float near;     ///< number within the support
  float unused_too;
};
static_assert(sizeof(DensitySums) == sizeof(Lanes));

/// own - what is there; the same to the bit as the other's vector to itself, but for its sign.
template <class Lanes>
VISCERA_INLINE void from_own(Lanes& to, float own, const float* other) {
  Lanes there;
  load(there, other);
  to = own - there;
}

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
        const std::size_t at = j + part * kEach;
        Lanes dx, dy, dz;
        from_own(dx, own_x[i], x + at);
        from_own(dy, own_y[i], y + at);
        from_own(dz, own_z[i], z + at);
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
    viscera::Lanes all[8] = {}, found;
    Wide::fold(cubes, all[0]), Wide::fold(squares, all[1]);
    Wide::fold(fx, all[2]), Wide::fold(fy, all[3]);
    Wide::fold(fz, all[4]), Wide::fold(near, all[5]);
    sums_of_eight(all, found);
    std::memcpy(&sums[i], &found, sizeof found);
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
    Lanes px[kParts] = {}, py[kParts] = {}, pz[kParts] = {};
    const Lanes zero = {};
    const Lanes own_strength = zero + self.strength[i];
    for (std::size_t j = 0; j < count; j += kWiderLanes) {
      for (int part = 0; part < kParts; ++part) {
        const std::size_t at = j + part * kEach;
        Lanes dx, dy, dz, vx, vy, vz, g, e;
        from_own(dx, self.x[i], other.x + at);
        from_own(dy, self.y[i], other.y + at);
        from_own(dz, self.z[i], other.z + at);
        Lanes q = 1.0f - (dx * dx + dy * dy + dz * dz) * inverse_square;
        q = q > zero ? q : zero;
        load(g, other.strength + at);
        // Twice the weight w_ij, and with it what is summed.
        const Lanes sum = g + own_strength;
        const Lanes bound = (2.0f * kMostRatio) * (g < own_strength ? g : own_strength);
        const Lanes weight = q * q * (sum < bound ? sum : bound);
        from_own(vx, self.vx[i], other.vx + at);
        from_own(vy, self.vy[i], other.vy + at);
        from_own(vz, self.vz[i], other.vz + at);
        ax[part] += weight * vx;
        ay[part] += weight * vy;
        az[part] += weight * vz;
        load(e, other.excess + at);
        const Lanes push = weight * (e + self.excess[i]);
        px[part] += push * dx;
        py[part] += push * dy;
        pz[part] += push * dz;
      }
    }
    for (int part = 0; part < kParts; ++part) {
      ax[part] = crowding * px[part] - viscosity * ax[part];
      ay[part] = crowding * py[part] - viscosity * ay[part];
      az[part] = crowding * pz[part] - viscosity * az[part];
    }
    viscera::Lanes all[8] = {}, found;
    Wide::fold(ax, all[0]), Wide::fold(ay, all[2]), Wide::fold(az, all[4]);
    sums_of_eight(all, found);
    out[i].x = 0.5f * found[0];
    out[i].y = 0.5f * found[1];
    out[i].z = 0.5f * found[2];
  }
}

// A pair of functions for each target; sum_pairs leaves w of `out` alone.
#define VISCERA_SUMS(target, Wide)                                                              \
  target void sum_densities(const float* x, const float* y, const float* z, std::size_t count,  \
                            const float* own_x, const float* own_y, const float* own_z,         \
                            std::size_t own, float inverse_square, DensitySums* sums) {         \
    sum_densities_on<Wide>(x, y, z, count, own_x, own_y, own_z, own, inverse_square, sums);     \
  }                                                                                             \
  target void sum_pairs(const PairColumns& other, std::size_t count, const PairColumns& self,   \
                        std::size_t own, float inverse_square, float viscosity, float crowding, \
                        Float4* out) {                                                          \
    sum_pairs_on<Wide>(other, count, self, own, inverse_square, viscosity, crowding, out);      \
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
    values->resize(count);
  }
  accelerations_.resize(count);
  notes_.resize((bins.occupied.size() + kCellChunk - 1) / kCellChunk);
  parallel_for_each_index(count, kChunk, [&](std::size_t i) {
    x_[i] = positions[i].x, y_[i] = positions[i].y, z_[i] = positions[i].z;
    vx_[i] = velocities[i].x, vy_[i] = velocities[i].y, vz_[i] = velocities[i].z;
  });
  density(bins, parameters);
  pairs(bins, parameters);
  if (parameters.laplacian == Laplacian::kPaper) {
    add_paper_viscosity(positions, velocities, strength_, bins, parameters, accelerations_);
  }
}

void ViscosityPass::density(const SmokeBins& bins, const ViscosityParameters& parameters) {
  const auto cells = [&](std::size_t begin, std::size_t end) {
    thread_local Neighbourhood around;
    thread_local std::vector<DensitySums> sums;
    std::uint64_t isolated = 0;
    std::vector<Note>& notes = notes_[begin / kCellChunk];
    notes.clear();
    for (std::size_t c = begin; c < end; ++c) {
      const auto [first, last] = bins.own(bins.occupied[c]);
      const Columns<3> own = {x_.data() + first, y_.data() + first, z_.data() + first};
      around.find(bins.runs(bins.occupied[c]), Reach(own, last - first, parameters.inverse_square),
                  Columns<3>{x_.data(), y_.data(), z_.data()}, notes);
      sums.resize(last - first);
      sum_densities(around.column(0), around.column(1), around.column(2), around.count(), own[0],
                    own[1], own[2], last - first, parameters.inverse_square, sums.data());
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
  const float viscosity =
      parameters.laplacian == Laplacian::kPairwise ? parameters.viscosity : 0.0f;
  parallel_chunks(bins.occupied.size(), kCellChunk, [&](std::size_t begin, std::size_t end) {
    thread_local Neighbourhood around;
    const Note* note = notes_[begin / kCellChunk].data();
    const Columns<8> columns = {x_.data(),  y_.data(),  z_.data(),        vx_.data(),
                                vy_.data(), vz_.data(), strength_.data(), excess_.data()};
    for (std::size_t c = begin; c < end; ++c) {
      const auto [first, last] = bins.own(bins.occupied[c]);
      around.copy(bins.runs(bins.occupied[c]), columns, note);
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
  std::size_t notes = 0;
  for (const std::vector<std::uint16_t>& of_chunk : notes_) notes += of_chunk.capacity();
  return 8 * x_.capacity() * sizeof(float) + accelerations_.capacity() * sizeof(Float4) +
         notes * sizeof(std::uint16_t);
}

}  // namespace viscera
