#include "kernels/paff/compact_factor.h"

#include <algorithm>
#include <cmath>

#include "kernels/base/parallel.h"
#include "kernels/base/wide.h"

namespace viscera {
namespace {

constexpr long kMost = 32767;
/// A part is at most this share of all the work: enough parts for some threads to end together, few
/// fronts above them.
constexpr double kLargestPart = 0.5;

/// to += a c, n numbers.
VISCERA_WIDE void add_column(const std::int16_t* __restrict c, float a, float* __restrict to,
                             std::size_t n) {
#pragma GCC ivdep
  for (std::size_t i = 0; i < n; ++i) to[i] += a * static_cast<float>(c[i]);
}

/// The same of four columns of n numbers, one after another.
VISCERA_WIDE void add_four(const std::int16_t* __restrict c, const float* a, float* __restrict to,
                           std::size_t n) {
  const float a0 = a[0], a1 = a[1], a2 = a[2], a3 = a[3];
  const std::int16_t *c1 = c + n, *c2 = c1 + n, *c3 = c2 + n;
#pragma GCC ivdep
  for (std::size_t i = 0; i < n; ++i)
    to[i] += (a0 * static_cast<float>(c[i]) + a1 * static_cast<float>(c1[i])) +
             (a2 * static_cast<float>(c2[i]) + a3 * static_cast<float>(c3[i]));
}

/// c . x in sixteen sums, in a fixed order.
constexpr std::size_t kSums = 16;
VISCERA_WIDE float column_product(const std::int16_t* c, const float* x, std::size_t n) {
  float sums[kSums] = {};
  std::size_t i = 0;
  for (; i + kSums <= n; i += kSums)
    for (std::size_t k = 0; k < kSums; ++k) sums[k] += static_cast<float>(c[i + k]) * x[i + k];
  float sum = 0.0f;
  for (; i < n; ++i) sum += static_cast<float>(c[i]) * x[i];
  for (const float part : sums) sum += part;
  return sum;
}

/// The same of four columns of n numbers, one after another, each in eight sums.
VISCERA_WIDE void four_products(const std::int16_t* c, const float* x, std::size_t n, float* to) {
  constexpr std::size_t kWide = 8;
  float sums[4][kWide] = {};
  std::size_t i = 0;
  for (; i + kWide <= n; i += kWide)
    for (std::size_t m = 0; m < 4; ++m)
      for (std::size_t k = 0; k < kWide; ++k)
        sums[m][k] += static_cast<float>(c[m * n + i + k]) * x[i + k];
  for (std::size_t m = 0; m < 4; ++m) {
    float sum = 0.0f;
    for (std::size_t rest = i; rest < n; ++rest)
      sum += static_cast<float>(c[m * n + rest]) * x[rest];
    for (const float part : sums[m]) sum += part;
    to[m] = sum;
  }
}

/// Below the diagonal of a front's own columns.
std::size_t numbers_of(std::size_t own, std::size_t border) {
  return own > 0 ? own * (own - 1) / 2 + own * border : 0;
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
    front.numbers = numbers;
    parents.push_back(of[2]);
    for (int b = 0; b < of[3]; ++b, ++border)
      for (int k = 0; k < 3; ++k) targets_.push_back(3 * factor.borders[border] + k);
    numbers += numbers_of(front.own, front.border);
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
  const Real* column = panels.data();
  for (const Front& front : fronts_) {
    const std::size_t size = front.own + front.border;
    for (std::size_t j = 0; j < front.own; ++j, column += size) {
      Real most = 0;
      for (std::size_t i = j + 1; i < size; ++i) most = std::max(most, std::abs(column[i]));
      units_.push_back(static_cast<float>(most / static_cast<Real>(kMost)));
      inverse_.push_back(static_cast<float>(Real(1) / column[j]));
    }
    const auto take = [&](std::size_t j, std::size_t begin, std::size_t end) {
      const Real unit = static_cast<Real>(units_[front.first + j]);
      const Real* at = column - (front.own - j) * size;
      for (std::size_t i = begin; i < end; ++i)
        numbers_.push_back(static_cast<std::int16_t>(
            unit > 0 ? std::clamp(std::lround(at[i] / unit), -kMost, kMost) : 0L));
    };
    for (std::size_t j = 0; j < front.own; ++j) take(j, j + 1, front.own);
    for (std::size_t j = 0; j < front.own; ++j) take(j, front.own, size);
  }
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

/// Its own unknowns are solved for; what they take from those of its border is added there.
void CompactFactor::forward(const Front& front, float* x, float* beyond, Work& work) const {
  float* own = x + front.first;
  const std::int16_t* column = numbers_.data() + front.numbers;
  const float* units = units_.data() + front.first;
  std::vector<float>& factors = work.factors;
  factors.resize(front.own);
  for (std::size_t j = 0; j < front.own; ++j) {
    own[j] *= inverse_[front.first + j];
    factors[j] = -own[j] * units[j];
    const std::size_t left = front.own - j - 1;
    add_column(column, factors[j], own + j + 1, left);
    column += left;
  }
  work.border.assign(front.border, 0.0f);
  float* border = work.border.data();
  std::size_t j = 0;
  for (; j + 4 <= front.own; j += 4, column += 4 * front.border)
    add_four(column, factors.data() + j, border, front.border);
  for (; j < front.own; ++j, column += front.border)
    add_column(column, factors[j], border, front.border);
  for (std::size_t b = 0; b < front.border; ++b) {
    const std::ptrdiff_t target = targets_[front.targets + b];
    (target >= 0 ? x[target] : beyond[-1 - target]) += border[b];
  }
}

void CompactFactor::back(const Front& front, float* x, const float* beyond, Work& work) const {
  float* own = x + front.first;
  work.border.resize(front.border);
  float* border = work.border.data();
  for (std::size_t b = 0; b < front.border; ++b) {
    const std::ptrdiff_t target = targets_[front.targets + b];
    border[b] = target >= 0 ? x[target] : beyond[-1 - target];
  }
  std::vector<float>& sums = work.factors;  // what each column takes from its unknown
  sums.resize(front.own);
  const std::int16_t* triangle = numbers_.data() + front.numbers;
  const std::size_t below = front.own > 0 ? front.own * (front.own - 1) / 2 : 0;
  const std::int16_t* column = triangle + below;
  std::size_t j = 0;
  for (; j + 4 <= front.own; j += 4, column += 4 * front.border)
    four_products(column, border, front.border, sums.data() + j);
  for (; j < front.own; ++j, column += front.border)
    sums[j] = column_product(column, border, front.border);
  column = triangle + below;
  for (j = front.own; j-- > 0;) {
    const std::size_t left = front.own - j - 1;
    column -= left;
    const float sum = sums[j] + column_product(column, own + j + 1, left);
    own[j] = (own[j] - units_[front.first + j] * sum) * inverse_[front.first + j];
  }
}

void CompactFactor::apply(std::span<const double> b, std::span<double> x) const {
  double size = 0.0;
  for (const double value : b) size = std::max(size, std::abs(value));
  // Single precision holds numbers of 1e-38 to 1e38 only; loads may be far from 1.
  const double scale = size > 0.0 ? 1.0 / size : 1.0;
  std::vector<float> block(b.size());
  for (std::size_t p = 0; p < order_.size(); ++p)
    for (std::size_t k = 0; k < 3; ++k)
      block[3 * p + k] = static_cast<float>(scale * b[3 * static_cast<std::size_t>(order_[p]) + k]);

  std::vector<std::vector<float>> beyond(parts_.size());
  parallel_for_each_index(parts_.size(), 1, [&](std::size_t p) {
    const Part& part = parts_[p];
    beyond[p].assign(part.beyond.size(), 0.0f);
    Work work;
    for (const std::size_t f : part.fronts)
      forward(fronts_[f], block.data(), beyond[p].data(), work);
  });
  for (std::size_t p = 0; p < parts_.size(); ++p)
    for (std::size_t i = 0; i < beyond[p].size(); ++i) block[parts_[p].beyond[i]] += beyond[p][i];
  Work work;
  for (const std::size_t f : top_) forward(fronts_[f], block.data(), nullptr, work);
  for (std::size_t i = top_.size(); i-- > 0;) back(fronts_[top_[i]], block.data(), nullptr, work);
  parallel_for_each_index(parts_.size(), 1, [&](std::size_t p) {
    const Part& part = parts_[p];
    for (std::size_t i = 0; i < part.beyond.size(); ++i) beyond[p][i] = block[part.beyond[i]];
    Work own_work;
    for (std::size_t i = part.fronts.size(); i-- > 0;)
      back(fronts_[part.fronts[i]], block.data(), beyond[p].data(), own_work);
  });

  for (std::size_t p = 0; p < order_.size(); ++p)
    for (std::size_t k = 0; k < 3; ++k)
      x[3 * static_cast<std::size_t>(order_[p]) + k] =
          static_cast<double>(block[3 * p + k]) / scale;
}

std::size_t CompactFactor::memory_bytes() const {
  const auto of = [](const auto& v) { return v.size() * sizeof(v[0]); };
  std::size_t sum =
      of(order_) + of(fronts_) + of(top_) + of(targets_) + of(numbers_) + of(units_) + of(inverse_);
  for (const Part& part : parts_) sum += of(part.fronts) + of(part.beyond);
  return sum;
}

}  // namespace viscera
