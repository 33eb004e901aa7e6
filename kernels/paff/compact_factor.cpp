#include "kernels/paff/compact_factor.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "kernels/base/parallel.h"
#include "kernels/base/wide.h"
#include "kernels/paff/blas.h"

namespace viscera {
namespace {

constexpr double kMost = 32767;
/// A part is at most this share of all the work: several threads share what is larger.
constexpr double kLargestPart = 0.2;
/// Fronts with more numbers than this are shared; smaller ones take no longer than sharing does.
constexpr std::size_t kWideFront = 60'000;
/// Of a tile. Its columns are long enough to be read ahead.
constexpr std::size_t kTileRows = 256;

/// Eight numbers, spelt out: so GCC 12 makes two instructions of what turns sixteen bits to floats.
constexpr std::size_t kWide = 8;
using Floats = float __attribute__((vector_size(32)));
using Integers = std::int32_t __attribute__((vector_size(32)));
[[gnu::always_inline]] inline void load(const float* from, Floats& to) {
  std::memcpy(&to, from, sizeof to);
}
[[gnu::always_inline]] inline void load(const std::int16_t* from, Floats& to) {
  const Integers whole = {from[0], from[1], from[2], from[3], from[4], from[5], from[6], from[7]};
  to = __builtin_convertvector(whole, Floats);
}

/// Columns stand in fours, eight numbers of each after eight of another: a line of the cache, and
/// one way through memory.
constexpr std::size_t kFour = 4;
std::size_t padded(std::size_t n, std::size_t to) {
  return (n + to - 1) / to * to;
}

/// Of a front's tiles.
std::size_t padded_numbers(std::size_t own, std::size_t border) {
  std::size_t numbers = padded(border, kWide) * padded(own, kFour);
  for (std::size_t row = 0; row < own; row += kTileRows) {
    const std::size_t last = std::min(row + kTileRows, own);
    numbers += padded(last - row, kWide) * padded(last, kFour);
  }
  return numbers;
}

/// Tiles are read from one end to the other, in pieces that are too short for a machine to foresee:
/// so many numbers ahead. Chosen; measured with and without.
constexpr std::size_t kAhead = 512;

/// to += sum_m a_m c_m of four columns, n numbers of each.
VISCERA_WIDE void add_four(const std::int16_t* c, const float* a, float* __restrict to,
                           std::size_t n) {
  const float a0 = a[0], a1 = a[1], a2 = a[2], a3 = a[3];
  for (std::size_t i = 0; i < n; i += kWide, c += kFour * kWide) {
    Floats sum, c0, c1, c2, c3;
    load(to + i, sum);
    load(c, c0);
    load(c + kWide, c1);
    load(c + 2 * kWide, c2);
    load(c + 3 * kWide, c3);
    __builtin_prefetch(c + kAhead);
    sum += (a0 * c0 + a1 * c1) + (a2 * c2 + a3 * c3);
    std::memcpy(to + i, &sum, sizeof sum);
  }
}

/// Of a column, to the nearest whole unit.
VISCERA_WIDE void in_units(const double* from, std::size_t n, double unit, std::int16_t* to) {
  for (std::size_t i = 0; i < n; ++i) {
    const double units = from[i] / unit;
    to[i] = static_cast<std::int16_t>(static_cast<int>(units + std::copysign(0.5, units)));
  }
}

/// Products of four columns with x, each in eight sums.
VISCERA_WIDE void four_products(const std::int16_t* c, const float* x, std::size_t n, float* to) {
  Floats sums[kFour] = {};
  for (std::size_t i = 0; i < n; i += kWide, c += kFour * kWide) {
    Floats at, c0, c1, c2, c3;
    load(x + i, at);
    load(c, c0);
    load(c + kWide, c1);
    load(c + 2 * kWide, c2);
    load(c + 3 * kWide, c3);
    __builtin_prefetch(c + kAhead);
    sums[0] += c0 * at;
    sums[1] += c1 * at;
    sums[2] += c2 * at;
    sums[3] += c3 * at;
  }
  for (std::size_t m = 0; m < kFour; ++m) {
    const Floats& eight = sums[m];
    to[m] = ((eight[0] + eight[4]) + (eight[2] + eight[6])) +
            ((eight[1] + eight[5]) + (eight[3] + eight[7]));
  }
}

}  // namespace

CompactFactor::CompactFactor(const PackedFactor& factor) : order_(factor.order) {
  const std::size_t count = factor.fronts.size() / PackedFactor::kNumbersAFront;
  std::vector<int> parents;
  std::size_t border = 0, numbers = 0;
  for (std::size_t f = 0; f < count; ++f) {
    const int* of = factor.fronts.data() + PackedFactor::kNumbersAFront * f;
    Front front;
    front.first = 3 * static_cast<std::size_t>(of[0]);
    front.own = 3 * static_cast<std::size_t>(of[1] - of[0]);
    front.border = 3 * static_cast<std::size_t>(of[3]);
    front.targets = targets_.size();
    front.wide = front.own * (front.own / 2 + front.border) > kWideFront;
    numbers += padded_numbers(front.own, front.border);
    parents.push_back(of[2]);
    for (int b = 0; b < of[3]; ++b, ++border)
      for (int k = 0; k < 3; ++k) targets_.push_back(3 * factor.borders[border] + k);
    fronts_.push_back(front);
  }
  numbers_.reserve(numbers);
  if (!factor.single_panels.empty())
    take_panels(factor.single_panels);
  else
    take_panels(factor.full_panels);
  part_fronts(parents);
}

template <class Real>
void CompactFactor::take_panels(const std::vector<Real>& panels) {
  const Real* panel = panels.data();
  for (Front& front : fronts_) {
    const auto own = static_cast<Eigen::Index>(front.own),
               border = static_cast<Eigen::Index>(front.border), size = own + border;
    const MatrixX columns =
        Eigen::Map<const Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>>(panel, size, own)
            .template cast<double>();
    MatrixX m(size, own);
    m.topRows(own).setIdentity();
    m.bottomRows(border) = -columns.bottomRows(border);
    // By the Cholesky factor, whose columns are those of L times the root of D.
    const MatrixX square = columns.topRows(own);
    blas::solve_right(false, static_cast<int>(size), static_cast<int>(own), square.data(),
                      static_cast<int>(own), m.data(), static_cast<int>(size));
    m.topRows(own) = (square.diagonal().asDiagonal() * m.topRows(own)).eval();
    for (Eigen::Index j = 0; j < own; ++j)
      inverse_.push_back(static_cast<float>(1.0 / (square(j, j) * square(j, j))));
    take_front(front, m);
    panel += size * own;
  }
}

void CompactFactor::take_front(Front& front, const MatrixX& m) {
  std::vector<double> units;
  std::vector<std::int16_t> column(static_cast<std::size_t>(m.rows()));
  for (std::size_t j = 0; j < front.own; ++j) {
    units.push_back(m.col(static_cast<Eigen::Index>(j))
                        .tail(m.rows() - static_cast<Eigen::Index>(j))
                        .cwiseAbs()
                        .maxCoeff() /
                    kMost);
    units_.push_back(static_cast<float>(units.back()));
  }
  front.tiles = tiles_.size();
  // Rows [begin, end) of M, as padded ones from `from` on.
  const auto take = [&](std::size_t begin, std::size_t end, std::size_t from) {
    const bool of_square = begin == 0;
    for (std::size_t row = begin; row < end; row += kTileRows) {
      const std::size_t last = std::min(row + kTileRows, end);
      const Tile tile{from + (row - begin), padded(last - row, kWide),
                      padded(of_square ? last : front.own, kFour), numbers_.size()};
      numbers_.resize(numbers_.size() + tile.rows * tile.columns, 0);
      std::int16_t* const to = numbers_.data() + tile.numbers;
      for (std::size_t j = 0; j < std::min(tile.columns, front.own); ++j) {
        const std::size_t first = of_square ? std::max(row, j) : row;
        if (first >= last) continue;
        in_units(m.col(static_cast<Eigen::Index>(j)).data() + first, last - first, units[j],
                 column.data() + first);
        for (std::size_t i = first; i < last; ++i) {
          const std::size_t eight = (i - row) / kWide, at = (i - row) % kWide;
          to[kFour * kWide * (j / kFour * (tile.rows / kWide) + eight) + kWide * (j % kFour) + at] =
              column[i];
        }
      }
      tiles_.push_back(tile);
    }
  };
  take(0, front.own, 0);
  take(front.own, front.own + front.border, padded(front.own, kWide));
  front.last_tile = tiles_.size();
}

/// Subtrees that are small enough, and what is above them.
void CompactFactor::part_fronts(std::span<const int> parents) {
  const std::size_t count = fronts_.size();
  std::vector<double> work(count, 0.0);
  double all = 0.0;
  for (std::size_t f = 0; f < count; ++f) {
    const double own = static_cast<double>(fronts_[f].own) *
                       static_cast<double>(fronts_[f].own + 2 * fronts_[f].border);
    work[f] += own;
    all += own;
    if (parents[f] >= 0) work[static_cast<std::size_t>(parents[f])] += work[f];
  }
  std::vector<std::size_t> part_of(count, 0);  // plus one; 0: above them
  for (std::size_t f = count; f-- > 0;) {
    if (work[f] > kLargestPart * all) continue;
    const std::size_t above = parents[f] >= 0 ? part_of[static_cast<std::size_t>(parents[f])] : 0;
    if (above > 0) {
      part_of[f] = above;
      continue;
    }
    // The border of a subtree's root holds all that it reaches beyond itself.
    Part& part = parts_.emplace_back();
    part_of[f] = parts_.size();
    for (std::size_t b = 0; b < fronts_[f].border; ++b)
      part.beyond.push_back(static_cast<std::size_t>(targets_[fronts_[f].targets + b]));
  }
  for (std::size_t f = 0; f < count; ++f) {
    if (part_of[f] == 0) {
      top_.push_back(f);
      continue;
    }
    Part& part = parts_[part_of[f] - 1];
    part.fronts.push_back(f);
    for (std::size_t b = 0; b < fronts_[f].border; ++b) {
      std::ptrdiff_t& target = targets_[fronts_[f].targets + b];
      const auto at = std::ranges::lower_bound(part.beyond, static_cast<std::size_t>(target));
      if (at != part.beyond.end() && *at == static_cast<std::size_t>(target))
        target = -1 - (at - part.beyond.begin());
    }
  }
}

namespace {

/// Rows of a square's tile above a column's own, as far as they are whole eights.
std::size_t skipped(std::size_t first, std::size_t column) {
  return column > first ? (column - first) / kWide * kWide : 0;
}

}  // namespace

/// Its tiles, by several threads where that is worth it.
template <class Body>
void CompactFactor::each_tile(const Front& front, const Body& body) const {
  const std::size_t tiles = front.last_tile - front.tiles;
  const auto one = [&](std::size_t t) {
    const Tile& tile = tiles_[front.tiles + t];
    for (std::size_t j = 0; j < tile.columns; j += kFour) {
      const std::size_t from = tile.first < front.own ? skipped(tile.first, j) : 0;
      if (from < tile.rows)
        body(t, j, numbers_.data() + tile.numbers + j * tile.rows + kFour * from, tile.first + from,
             tile.rows - from);
    }
  };
  if (front.wide)
    parallel_for_each_index(tiles, 1, one);
  else
    for (std::size_t t = 0; t < tiles; ++t) one(t);
}

/// Its own unknowns take what they have by L^-1, and those of its border what they take from them.
void CompactFactor::up(const Front& front, Block& block, float* beyond, Work& work) const {
  const std::size_t count = block.columns, own = padded(front.own, kFour),
                    below = padded(front.own, kWide), size = below + padded(front.border, kWide);
  work.in.assign(own * count, 0.0f);
  work.out.assign(size * count, 0.0f);
  for (std::size_t c = 0; c < count; ++c)
    for (std::size_t j = 0; j < front.own; ++j)
      work.in[c * own + j] = block.column(c)[front.first + j] * units_[front.first + j];
  each_tile(front, [&](std::size_t, std::size_t j, const std::int16_t* numbers, std::size_t row,
                       std::size_t rows) {
    for (std::size_t c = 0; c < count; ++c)
      add_four(numbers, work.in.data() + c * own + j, work.out.data() + c * size + row, rows);
  });
  for (std::size_t c = 0; c < count; ++c) {
    const float* out = work.out.data() + c * size;
    for (std::size_t j = 0; j < front.own; ++j)
      block.column(c)[front.first + j] = out[j] * inverse_[front.first + j];
    for (std::size_t b = 0; b < front.border; ++b) {
      const std::ptrdiff_t target = targets_[front.targets + b];
      (target >= 0 ? block.column(c)[target]
                   : beyond[static_cast<std::size_t>(-1 - target) * count + c]) += out[below + b];
    }
  }
}

void CompactFactor::down(const Front& front, Block& block, const float* beyond, Work& work) const {
  const std::size_t count = block.columns, own = padded(front.own, kFour),
                    below = padded(front.own, kWide), size = below + padded(front.border, kWide),
                    tiles = front.last_tile - front.tiles;
  work.in.assign(size * count, 0.0f);
  for (std::size_t c = 0; c < count; ++c) {
    float* in = work.in.data() + c * size;
    std::copy_n(block.column(c) + front.first, front.own, in);
    for (std::size_t b = 0; b < front.border; ++b) {
      const std::ptrdiff_t target = targets_[front.targets + b];
      in[below + b] = target >= 0 ? block.column(c)[target]
                                  : beyond[static_cast<std::size_t>(-1 - target) * count + c];
    }
  }
  work.out.assign(tiles * count * own, 0.0f);
  each_tile(front, [&](std::size_t t, std::size_t j, const std::int16_t* numbers, std::size_t row,
                       std::size_t rows) {
    for (std::size_t c = 0; c < count; ++c)
      four_products(numbers, work.in.data() + c * size + row, rows,
                    work.out.data() + (t * count + c) * own + j);
  });
  for (std::size_t c = 0; c < count; ++c) {
    float* to = block.column(c) + front.first;
    std::fill_n(to, front.own, 0.0f);
    for (std::size_t t = 0; t < tiles; ++t)
      for (std::size_t j = 0; j < front.own; ++j) to[j] += work.out[(t * count + c) * own + j];
    for (std::size_t j = 0; j < front.own; ++j) to[j] *= units_[front.first + j];
  }
}

void CompactFactor::apply(std::span<const double> b, std::span<double> x,
                          std::size_t columns) const {
  const std::size_t rows = 3 * order_.size();
  Block block{std::vector<float>(rows * columns), rows, columns};
  // Single precision holds numbers of 1e-38 to 1e38 only; loads may be far from 1.
  std::vector<double> scales;
  for (std::size_t c = 0; c < columns; ++c) {
    const std::span<const double> from = b.subspan(c * rows, rows);
    double size = 0.0;
    for (const double value : from) size = std::max(size, std::abs(value));
    scales.push_back(size > 0.0 ? 1.0 / size : 1.0);
    for (std::size_t p = 0; p < order_.size(); ++p)
      for (std::size_t k = 0; k < 3; ++k)
        block.column(c)[3 * p + k] =
            static_cast<float>(scales[c] * from[3 * static_cast<std::size_t>(order_[p]) + k]);
  }

  std::vector<std::vector<float>> beyond(parts_.size());
  parallel_for_each_index(parts_.size(), 1, [&](std::size_t p) {
    const Part& part = parts_[p];
    beyond[p].assign(part.beyond.size() * columns, 0.0f);
    Work work;
    for (const std::size_t f : part.fronts) up(fronts_[f], block, beyond[p].data(), work);
  });
  for (std::size_t p = 0; p < parts_.size(); ++p)
    for (std::size_t i = 0; i < parts_[p].beyond.size(); ++i)
      for (std::size_t c = 0; c < columns; ++c)
        block.column(c)[parts_[p].beyond[i]] += beyond[p][i * columns + c];
  Work work;
  for (const std::size_t f : top_) up(fronts_[f], block, nullptr, work);
  for (std::size_t i = top_.size(); i-- > 0;) down(fronts_[top_[i]], block, nullptr, work);
  parallel_for_each_index(parts_.size(), 1, [&](std::size_t p) {
    const Part& part = parts_[p];
    for (std::size_t i = 0; i < part.beyond.size(); ++i)
      for (std::size_t c = 0; c < columns; ++c)
        beyond[p][i * columns + c] = block.column(c)[part.beyond[i]];
    Work own_work;
    for (std::size_t i = part.fronts.size(); i-- > 0;)
      down(fronts_[part.fronts[i]], block, beyond[p].data(), own_work);
  });

  for (std::size_t c = 0; c < columns; ++c)
    for (std::size_t p = 0; p < order_.size(); ++p)
      for (std::size_t k = 0; k < 3; ++k)
        x[c * rows + 3 * static_cast<std::size_t>(order_[p]) + k] =
            static_cast<double>(block.column(c)[3 * p + k]) / scales[c];
}

std::size_t CompactFactor::memory_bytes() const {
  const auto of = [](const auto& v) { return v.size() * sizeof(v[0]); };
  std::size_t sum = of(order_) + of(fronts_) + of(tiles_) + of(top_) + of(targets_) + of(numbers_) +
                    of(units_) + of(inverse_);
  for (const Part& part : parts_) sum += of(part.fronts) + of(part.beyond);
  return sum;
}

}  // namespace viscera
