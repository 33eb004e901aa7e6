#include "kernels/smoke/splat.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <utility>

#include "kernels/base/lanes.h"
#include "kernels/base/parallel.h"
#include "kernels/base/wide.h"
#include "kernels/smoke/splat_levels.h"

namespace viscera {
namespace {

constexpr int kSlab = 4;  // layers of cells that one task fills
constexpr std::size_t kChunk = 16384;
/// What the greatest particle puts into one cell at most: below 2^31, and 2^33 of them below 2^63.
constexpr float kSteps = 0x1p30f;

/// What a cell holds, in steps: mass, heat, momentum; the rest is nothing. One row of lanes, so
/// that all that happens to a cell happens to its channels at once.
struct alignas(32) Amounts {
  std::array<float, kLanes> of = {};
};
struct alignas(64) Sums {
  std::array<std::int64_t, kLanes> of = {};
};

/// The two cells that a particle reaches along an axis, and the part of the first one. What would
/// fall outside the grid goes to its last cell.
struct Pair {
  int first, second;
  float part;

  // `at` in cells, cell i spans [i, i + 1).
  Pair(float at, int size) {
    const float middle = std::clamp(at, 0.0f, static_cast<float>(size)) - 0.5f;
    const float low = std::floor(middle);
    part = 1.0f - (middle - low);
    first = std::max(0, static_cast<int>(low));
    second = std::min(static_cast<int>(low) + 1, size - 1);
  }
};

/// Between which levels a particle is, and its share of the upper one.
struct Place {
  float share;
  std::int16_t level, first_slab, last_slab;
};

/// A part of the grid, counted from its own least cell, x fastest.
struct Region {
  Eigen::Vector3i least, size;

  std::size_t layer() const { return static_cast<std::size_t>(size.x()) * size.y(); }
  std::size_t cells() const { return layer() * size.z(); }
  std::size_t rows() const { return static_cast<std::size_t>(size.y()) * size.z(); }
};

/// Which rows along x hold anything: most of a plume's box is empty, and costs nothing.
using Rows = std::vector<char>;

/// Particles by level and slab; a particle stands in both slabs that it straddles.
class Lists {
 public:
  void sort(std::span<const Place> places, int levels, int slabs);
  std::span<const std::uint32_t> at(int level, int slab) const {
    const std::size_t key = static_cast<std::size_t>(level) * slabs_ + slab;
    return std::span(order_).subspan(begin_[key], begin_[key + 1] - begin_[key]);
  }

 private:
  std::size_t slabs_ = 0;
  std::vector<std::size_t> begin_, next_;
  std::vector<std::uint32_t> order_;
};

void Lists::sort(std::span<const Place> places, int levels, int slabs) {
  slabs_ = static_cast<std::size_t>(slabs);
  const std::size_t keys = static_cast<std::size_t>(levels) * slabs_;
  const std::size_t chunks = (places.size() + kChunk - 1) / kChunk;
  const auto each = [&](std::size_t i, const auto& visit) {
    const Place& place = places[i];
    for (int s = place.first_slab; s <= place.last_slab; ++s) visit(place.level * slabs_ + s);
  };
  next_.assign(chunks * keys, 0);
  parallel_chunks(places.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    std::size_t* counts = next_.data() + begin / kChunk * keys;
    for (std::size_t i = begin; i < end; ++i) each(i, [&](std::size_t key) { ++counts[key]; });
  });
  begin_.assign(keys + 1, 0);
  std::size_t sum = 0;
  for (std::size_t key = 0; key < keys; ++key) {
    begin_[key] = sum;
    for (std::size_t c = 0; c < chunks; ++c) sum += std::exchange(next_[c * keys + key], sum);
  }
  begin_[keys] = sum;
  order_.resize(sum);
  parallel_chunks(places.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    std::size_t* next = next_.data() + begin / kChunk * keys;
    for (std::size_t i = begin; i < end; ++i)
      each(i, [&](std::size_t key) { order_[next[key]++] = static_cast<std::uint32_t>(i); });
  });
}

/// Adds weight * amounts, rounded to whole steps: as a double of a known exponent a whole number
/// below 2^51 is its own low bits.
VISCERA_INLINE void add(Sums& cell, const Lanes& amounts, float weight) {
  using Doubles = double __attribute__((vector_size(32)));
  using Whole = std::int64_t __attribute__((vector_size(32)));
  const Lanes steps = weight * amounts;
  for (int part = 0; part < 2; ++part) {
    const int at = 4 * part;
    const Doubles four = {steps[at], steps[at + 1], steps[at + 2], steps[at + 3]};
    const Doubles rounded = four + 0x1.8p52;
    Whole bits, sums;
    std::memcpy(&bits, &rounded, sizeof bits);
    std::memcpy(&sums, cell.of.data() + 4 * part, sizeof sums);
    sums += bits - 0x4338'0000'0000'0000;
    std::memcpy(cell.of.data() + 4 * part, &sums, sizeof sums);
  }
}

struct Particles {
  std::span<const Float4> positions, velocities;
  std::span<const float> masses;
  const SplatParameters& parameters;
};

/// Others are nowhere.
bool is_somewhere(const Float4& at) {
  return std::isfinite(at.x + at.y + at.z);
}

/// Adds these particles to the layers [low, high) of the grid; `sums` holds those of the region.
/// and `filled` says which of their rows got any. Of each the share of the upper level counts, or
/// what is left for the lower one.
VISCERA_WIDE void add_particles(const Particles& particles, std::span<const std::uint32_t> list,
                                const Place* places, bool upper, const Region& region, int low,
                                int high, Sums* sums, char* filled) {
  const SplatParameters& parameters = particles.parameters;
  const int row = region.size.x();
  const auto layer = static_cast<std::ptrdiff_t>(region.layer());
  const Sums* const origin =
      sums - region.least.x() - static_cast<std::ptrdiff_t>(row) * region.least.y() - layer * low;
  for (const std::uint32_t i : list) {
    const Float4 &at = particles.positions[i], &v = particles.velocities[i];
    const Pair x(at.x * parameters.inverse_voxel, parameters.size.x);
    const Pair y(at.y * parameters.inverse_voxel, parameters.size.y);
    const Pair z(at.z * parameters.inverse_voxel, parameters.size.z);
    const float mass = particles.masses[i];
    const float momentum = mass * parameters.momentum_scale;
    const Lanes amounts = {mass * parameters.mass_scale, mass * at.w * parameters.heat_scale,
                           momentum * v.x, momentum * v.y, momentum * v.z};
    const float share = upper ? places[i].share : 1.0f - places[i].share;
    for (const bool last_z : {false, true}) {
      const int cz = last_z ? z.second : z.first;
      if (cz < low || cz >= high) continue;
      const float of_z = share * (last_z ? 1.0f - z.part : z.part);
      for (const bool last_y : {false, true}) {
        const float of_y = of_z * (last_y ? 1.0f - y.part : y.part);
        const int cy = last_y ? y.second : y.first;
        filled[(cz - low) * region.size.y() + cy - region.least.y()] = 1;
        Sums* const cells =
            const_cast<Sums*>(origin) + layer * cz + static_cast<std::ptrdiff_t>(row) * cy;
        add(cells[x.first], amounts, of_y * x.part);
        add(cells[x.second], amounts, of_y * (1.0f - x.part));
      }
    }
  }
}

/// Adds the sums to the amounts, and empties them. A sum of 64 bits becomes the nearest double:
/// its halves, each exact, make one by being the low bits of doubles of a known exponent.
VISCERA_WIDE void fold(Sums* sums, std::size_t cells, Amounts* amounts) {
  using Words = std::uint64_t __attribute__((vector_size(32)));
  using Doubles = double __attribute__((vector_size(32)));
  using Floats = float __attribute__((vector_size(16)));
  const Words zero = {};
  for (std::size_t c = 0; c < cells; ++c) {
    for (int part = 0; part < 2; ++part) {
      Words words;
      std::memcpy(&words, sums[c].of.data() + 4 * part, sizeof words);
      std::memcpy(sums[c].of.data() + 4 * part, &zero, sizeof zero);
      const Words high = (words >> 32) ^ 0x4530'0000'8000'0000ull;            // 2^84 + 2^63 + it
      const Words low = (words & 0xffff'ffffull) | 0x4330'0000'0000'0000ull;  // 2^52 + it
      Doubles high_part, low_part;
      std::memcpy(&high_part, &high, sizeof high);
      std::memcpy(&low_part, &low, sizeof low);
      const Doubles sum = (high_part - (0x1p84 + 0x1p63 + 0x1p52)) + low_part;
      Floats now;
      std::memcpy(&now, amounts[c].of.data() + 4 * part, sizeof now);
      now += Floats{static_cast<float>(sum[0]), static_cast<float>(sum[1]),
                    static_cast<float>(sum[2]), static_cast<float>(sum[3])};
      std::memcpy(amounts[c].of.data() + 4 * part, &now, sizeof now);
    }
  }
}

/// to = weights[0] * middle + weights[k] * (before[k] + after[k]): eight numbers a cell.
VISCERA_WIDE void weigh(float* to, std::size_t numbers, std::span<const float> weights,
                        const float* const* before, const float* const* after) {
  for (std::size_t n = 0; n < numbers; n += kLanes) {
    Lanes middle;
    load(middle, before[0] + n);
    Lanes sum = weights[0] * middle;
    for (std::size_t k = 1; k < weights.size(); ++k) {
      Lanes one, other;
      load(one, before[k] + n);
      load(other, after[k] + n);
      sum += weights[k] * (one + other);
    }
    std::memcpy(to + n, &sum, sizeof sum);
  }
}

/// The cell that stands for one outside: the grid's ends are mirrors, so that what would leave
/// stays.
int mirrored(int i, int size) {
  const int turn = 2 * size;
  const int within = ((i % turn) + turn) % turn;
  return within < size ? within : turn - 1 - within;
}

/// Blurs rows of `width` across themselves: `rows` holds what they were, those without anything
/// too, one after the other; the blurred ones go to `amounts`, `stride` apart. `filled` (of each
/// row, `step` apart) is what it was before, and then of the blurred ones.
void blur_across(Amounts* amounts, std::size_t stride, std::size_t width, int count,
                 std::span<const float> weights, const Amounts* rows, char* filled,
                 std::size_t step) {
  std::array<const float*, static_cast<std::size_t>(kWidestSplat) + 2> before, after;
  thread_local std::vector<char> was;
  was.resize(static_cast<std::size_t>(count));
  for (int r = 0; r < count; ++r) was[r] = filled[step * r];
  for (int r = 0; r < count; ++r) {
    bool any = false;
    for (int k = 0; k < static_cast<int>(weights.size()); ++k) {
      const int b = mirrored(r - k, count), a = mirrored(r + k, count);
      any = any || was[b] || was[a];
      before[k] = rows[width * b].of.data();
      after[k] = rows[width * a].of.data();
    }
    if (!any) continue;
    filled[step * r] = 1;
    weigh(amounts[stride * r].of.data(), width * kLanes, weights, before.data(), after.data());
  }
}

/// One row along itself; `padded` has room for the row and the reach on both sides.
void blur_along(const Amounts* row, int count, std::span<const float> weights, Amounts* padded,
                Amounts* to) {
  const int reach = static_cast<int>(weights.size()) - 1;
  std::copy_n(row, count, padded + reach);
  for (int i = 1; i <= reach; ++i) {
    padded[reach - i] = row[mirrored(-i, count)];
    padded[reach + count - 1 + i] = row[mirrored(count - 1 + i, count)];
  }
  std::array<const float*, static_cast<std::size_t>(kWidestSplat) + 2> before, after;
  for (int k = 0; k <= reach; ++k) {
    before[k] = padded[reach - k].of.data();
    after[k] = padded[reach + k].of.data();
  }
  weigh(to->of.data(), static_cast<std::size_t>(count) * kLanes, weights, before.data(),
        after.data());
}

void blur(const Region& region, std::span<const float> weights, Amounts* amounts, Rows& filled) {
  const int nx = region.size.x(), ny = region.size.y(), nz = region.size.z();
  const auto width = static_cast<std::size_t>(nx);
  const std::size_t layer = region.layer();
  const auto is_filled = [](char row) { return row != 0; };
  thread_local std::vector<Amounts> rows, padded;
  parallel_for_each_index(static_cast<std::size_t>(nz), 1, [&](std::size_t z) {
    char* const own = filled.data() + z * ny;
    if (std::none_of(own, own + ny, is_filled)) return;
    rows.resize(layer);
    padded.resize(width + 2 * weights.size());
    for (int y = 0; y < ny; ++y) {
      if (own[y])
        blur_along(amounts + layer * z + width * y, nx, weights, padded.data(),
                   rows.data() + width * y);
      else
        std::fill_n(rows.data() + width * y, width, Amounts());
    }
    blur_across(amounts + layer * z, width, width, ny, weights, rows.data(), own, 1);
  });
  parallel_for_each_index(static_cast<std::size_t>(ny), 1, [&](std::size_t y) {
    char* const own = filled.data() + y;
    bool any = false;
    rows.resize(width * nz);
    for (int z = 0; z < nz; ++z) {
      any = any || own[static_cast<std::size_t>(ny) * z];
      std::copy_n(amounts + layer * z + width * y, width, rows.data() + width * z);
    }
    if (any)
      blur_across(amounts + width * y, layer, width, nz, weights, rows.data(), own,
                  static_cast<std::size_t>(ny));
  });
}

struct Surveyed {
  SplatAmounts most;
  Eigen::AlignedBox3i cells;

  void extend(const Surveyed& other) {
    most.mass = std::max(most.mass, other.most.mass);
    most.heat = std::max(most.heat, other.most.heat);
    most.momentum = std::max(most.momentum, other.most.momentum);
    cells.extend(other.cells);
  }
};

/// The greatest of the particles, and the box of the cells that they reach before any blur.
Surveyed survey(const Particles& particles) {
  const SplatParameters& parameters = particles.parameters;
  const std::size_t count = particles.positions.size();
  std::vector<Surveyed> parts((count + kChunk - 1) / kChunk);
  parallel_chunks(count, kChunk, [&](std::size_t begin, std::size_t end) {
    SplatAmounts most;
    constexpr float kMost = std::numeric_limits<float>::max();
    Float4 low = {kMost, kMost, kMost}, high = {-kMost, -kMost, -kMost};
    for (std::size_t i = begin; i < end; ++i) {
      const Float4 &at = particles.positions[i], &v = particles.velocities[i];
      if (!is_somewhere(at)) continue;
      const float mass = particles.masses[i];
      most.mass = std::max(most.mass, mass);
      most.heat = std::max(most.heat, mass * std::abs(at.w));
      most.momentum =
          std::max(most.momentum, mass * std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}));
      low = {std::min(low.x, at.x), std::min(low.y, at.y), std::min(low.z, at.z), 0.0f};
      high = {std::max(high.x, at.x), std::max(high.y, at.y), std::max(high.z, at.z), 0.0f};
    }
    const float inverse = parameters.inverse_voxel;
    const Int4& size = parameters.size;
    Surveyed& part = parts[begin / kChunk];
    part.most = most;
    if (low.x > high.x) return;
    part.cells = Eigen::AlignedBox3i(
        Eigen::Vector3i(Pair(low.x * inverse, size.x).first, Pair(low.y * inverse, size.y).first,
                        Pair(low.z * inverse, size.z).first),
        Eigen::Vector3i(Pair(high.x * inverse, size.x).second,
                        Pair(high.y * inverse, size.y).second,
                        Pair(high.z * inverse, size.z).second));
  });
  Surveyed all;
  for (const Surveyed& part : parts) all.extend(part);
  return all;
}

float scale_of(float most) {
  return most > 0.0f ? std::min(kSteps / most, 1e37f) : 1.0f;
}

/// Densities and means of a row of cells.
void resolve(const Amounts* row, int count, const SplatParameters& parameters, float* density,
             float* temperature, Vec3f* velocity) {
  const double cell_volume = std::pow(1.0 / parameters.inverse_voxel, 3);
  const auto density_step = static_cast<float>(1.0 / (parameters.mass_scale * cell_volume));
  const auto heat_step =
      static_cast<float>(static_cast<double>(parameters.mass_scale) / parameters.heat_scale);
  const auto momentum_step =
      static_cast<float>(static_cast<double>(parameters.mass_scale) / parameters.momentum_scale);
  for (int x = 0; x < count; ++x) {
    const std::array<float, kLanes>& amounts = row[x].of;
    const float inverse = amounts[0] > 0.0f ? 1.0f / amounts[0] : 0.0f;
    density[x] = amounts[0] * density_step;
    temperature[x] = amounts[1] * heat_step * inverse;
    const float per_mass = momentum_step * inverse;
    velocity[x] = {amounts[2] * per_mass, amounts[3] * per_mass, amounts[4] * per_mass};
  }
}

}  // namespace

void set_scales(const SplatAmounts& greatest, SplatParameters& parameters) {
  parameters.mass_scale = scale_of(greatest.mass);
  parameters.heat_scale = scale_of(greatest.heat);
  parameters.momentum_scale = scale_of(greatest.momentum);
}

SplatParameters splat_parameters(const Box& domain, double voxel, double support,
                                 double viscosity) {
  assert(voxel > 0.0);
  SplatParameters parameters;
  // A hundredth of a cell less, so that a domain of whole cells doesn't gain one by rounding.
  const Vec3 cells = (domain.sizes() / voxel).array() - 0.01;
  const Eigen::Vector3i size = cells.array().ceil().max(1.0).cast<int>();
  parameters.size = {size.x(), size.y(), size.z(), size.prod()};
  parameters.inverse_voxel = static_cast<float>(1.0 / voxel);
  parameters.first_square = static_cast<float>(0.25 * support * support);
  parameters.growth = static_cast<float>(12.0 * viscosity);
  parameters.widest_square = static_cast<float>(6.25 * support * support);
  return parameters;
}

void splat(std::span<const Float4> positions, std::span<const Float4> velocities,
           std::span<const float> masses, SplatParameters& parameters, SmokeGrid& grid) {
  const std::size_t count = positions.size();
  const Int4& size = parameters.size;
  grid.size = {size.x, size.y, size.z};
  const auto voxels = static_cast<std::size_t>(size.w);
  grid.density.assign(voxels, 0.0f);
  grid.temperature.assign(voxels, 0.0f);
  grid.velocity.assign(voxels, Vec3f::Zero());
  parameters.particles = static_cast<std::uint32_t>(count);
  const Particles particles = {positions, velocities, masses, parameters};
  const Surveyed all = survey(particles);
  set_scales(all.most, parameters);
  if (all.cells.isEmpty()) return;

  const std::vector<SplatLevel> levels = splat_levels(parameters);
  int reach = 0;
  for (const SplatLevel& level : levels) reach += level.reach();
  const Eigen::Vector3i around = Eigen::Vector3i::Constant(reach);
  Region region;
  region.least = (all.cells.min() - around).cwiseMax(0);
  region.size =
      (all.cells.max() + around).cwiseMin(grid.size.array().matrix() - Eigen::Vector3i::Ones()) -
      region.least + Eigen::Vector3i::Ones();
  const int slabs = (region.size.z() + kSlab - 1) / kSlab;

  // Kept: fresh pages for every picture would cost more than the splat.
  thread_local std::vector<Place> places;
  thread_local std::vector<Amounts> kept_amounts;
  thread_local Lists lists;
  places.resize(count);
  parallel_for_each_index(count, kChunk, [&, place = places.data()](std::size_t i) {
    const float square = splat_square(parameters, velocities[i].w);
    std::size_t level = 0;
    while (level + 1 < levels.size() && square >= levels[level + 1].square) ++level;
    float share = 0.0f;
    if (level + 1 < levels.size()) {
      const float low = levels[level].square;
      share = (square - low) / (levels[level + 1].square - low);
    }
    if (!is_somewhere(positions[i])) {
      place[i] = {0.0f, 0, 0, -1};
      return;
    }
    const Pair z(positions[i].z * parameters.inverse_voxel, size.z);
    place[i] = {share, static_cast<std::int16_t>(level),
                static_cast<std::int16_t>((z.first - region.least.z()) / kSlab),
                static_cast<std::int16_t>((z.second - region.least.z()) / kSlab)};
  });
  lists.sort(places, static_cast<int>(levels.size()), slabs);

  // Nothing is left in it from the last picture.
  if (kept_amounts.size() < region.cells()) kept_amounts.resize(region.cells());
  Amounts* const amounts = kept_amounts.data();
  Rows filled(region.rows(), 0);
  bool any = false;
  for (int level = static_cast<int>(levels.size()) - 1; level >= 0; --level) {
    if (any && level + 1 < static_cast<int>(levels.size()))
      blur(region, levels[level + 1].weights, amounts, filled);
    // Each task owns a slab of layers and takes from every particle what falls into it: no two
    // tasks write the same cell.
    const auto fill = [&, place = places.data(), by_slab = &lists](std::size_t s) {
      const auto own = by_slab->at(level, static_cast<int>(s));
      const auto below = level > 0 ? by_slab->at(level - 1, static_cast<int>(s))
                                   : std::span<const std::uint32_t>();
      if (own.empty() && below.empty()) return;
      thread_local std::vector<Sums> sums;
      const int first = static_cast<int>(s) * kSlab;
      const int last = std::min(first + kSlab, region.size.z());
      const std::size_t cells = region.layer() * (last - first);
      if (sums.size() < cells) sums.resize(cells);
      const int low = region.least.z() + first, high = region.least.z() + last;
      const auto width = static_cast<std::size_t>(region.size.x());
      thread_local Rows added;
      added.assign(cells / width, 0);
      add_particles(particles, own, place, false, region, low, high, sums.data(), added.data());
      add_particles(particles, below, place, true, region, low, high, sums.data(), added.data());
      const std::size_t before = static_cast<std::size_t>(region.size.y()) * first;
      for (std::size_t row = 0; row < added.size(); ++row) {
        if (!added[row]) continue;
        filled[before + row] = 1;
        fold(sums.data() + width * row, width, amounts + width * (before + row));
      }
    };
    parallel_for_each_index(static_cast<std::size_t>(slabs), 1, fill);
    for (int s = 0; s < slabs && !any; ++s)
      any = !lists.at(level, s).empty() || (level > 0 && !lists.at(level - 1, s).empty());
  }

  parallel_for_each_index(static_cast<std::size_t>(region.size.z()), 1, [&](std::size_t z) {
    for (int y = 0; y < region.size.y(); ++y) {
      if (!filled[z * region.size.y() + y]) continue;
      Amounts* const row =
          amounts + region.layer() * z + static_cast<std::size_t>(region.size.x()) * y;
      const std::size_t cell =
          region.least.x() +
          static_cast<std::size_t>(size.x) *
              (region.least.y() + y + static_cast<std::size_t>(size.y) * (region.least.z() + z));
      resolve(row, region.size.x(), parameters, grid.density.data() + cell,
              grid.temperature.data() + cell, grid.velocity.data() + cell);
      std::fill_n(row, region.size.x(), Amounts());
    }
  });
}

SmokeGrid filled_part(const SmokeGrid& grid) {
  const Eigen::Vector3i& size = grid.size;
  Eigen::AlignedBox3i filled;
  for (int z = 0; z < size.z(); ++z) {
    for (int y = 0; y < size.y(); ++y) {
      const float* row = grid.density.data() + static_cast<std::size_t>(size.x()) *
                                                   (y + static_cast<std::size_t>(size.y()) * z);
      int low = 0, high = size.x() - 1;
      while (low <= high && !(row[low] > 0.0f)) ++low;
      if (low > high) continue;
      while (!(row[high] > 0.0f)) --high;
      filled.extend(Eigen::Vector3i(low, y, z)).extend(Eigen::Vector3i(high, y, z));
    }
  }
  if (filled.isEmpty()) filled.extend(Eigen::Vector3i::Zero());

  SmokeGrid part;
  part.first = grid.first + filled.min();
  part.size = filled.sizes() + Eigen::Vector3i::Ones();
  part.voxel = grid.voxel;
  const Vec3 corner = grid.domain.min() + grid.voxel * filled.min().cast<double>();
  part.domain = Box(corner, corner + grid.voxel * part.size.cast<double>());
  const auto copy = [&](const auto& from, auto& to) {
    to.reserve(static_cast<std::size_t>(part.size.prod()));
    for (int z = filled.min().z(); z <= filled.max().z(); ++z)
      for (int y = filled.min().y(); y <= filled.max().y(); ++y) {
        const auto row =
            from.begin() + filled.min().x() +
            static_cast<std::ptrdiff_t>(size.x()) * (y + static_cast<std::ptrdiff_t>(size.y()) * z);
        to.insert(to.end(), row, row + part.size.x());
      }
  };
  copy(grid.density, part.density);
  copy(grid.temperature, part.temperature);
  copy(grid.velocity, part.velocity);
  return part;
}

}  // namespace viscera
