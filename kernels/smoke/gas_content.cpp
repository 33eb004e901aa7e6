#include "kernels/smoke/gas_content.h"

#include <algorithm>
#include <cmath>

#include "kernels/base/parallel.h"
#include "kernels/base/wide.h"

namespace viscera {
namespace {

/// Limited face values are at most twice the cell's: half of its gas may leave it in a substep.
constexpr double kMostOfCell = 0.45;

std::size_t layers_a_chunk(const GasLayout& layout) {
  constexpr std::ptrdiff_t kCells = 4000;
  return static_cast<std::size_t>(std::max<std::ptrdiff_t>(1, kCells / layout.stride[2]));
}

/// Calls body(first index, length, j, k) for the rows of cells of a box.
template <class Body>
void for_box_rows(const GasLayout& layout, const GasBox& box, const Body& body) {
  if (box.empty()) return;
  const auto layers = static_cast<std::size_t>(box.high[2] - box.low[2] + 1);
  parallel_chunks(layers, layers_a_chunk(layout), [&](std::size_t begin, std::size_t end) {
    for (int k = box.low[2] + static_cast<int>(begin); k < box.low[2] + static_cast<int>(end); ++k)
      for (int j = box.low[1]; j <= box.high[1]; ++j)
        body(layout.index(box.low[0], j, k), box.high[0] - box.low[0] + 1, j, k);
  });
}

template <class T, class Body>
T sum_box_rows(const GasLayout& layout, const GasBox& box, T zero, const Body& body) {
  if (box.empty()) return zero;
  const auto layers = static_cast<std::size_t>(box.high[2] - box.low[2] + 1);
  return parallel_sum(
      layers, layers_a_chunk(layout), zero, [&](std::size_t begin, std::size_t end) {
        T sum = zero;
        for (int k = box.low[2] + static_cast<int>(begin); k < box.low[2] + static_cast<int>(end);
             ++k)
          for (int j = box.low[1]; j <= box.high[1]; ++j)
            sum += body(layout.index(box.low[0], j, k), box.high[0] - box.low[0] + 1);
        return sum;
      });
}

/// One row of faces within the gas: dt / h times what passes each.
VISCERA_WIDE void flux_row(const float* __restrict values, const float* __restrict velocity,
                           const float* __restrict passes, float* __restrict flux,
                           std::ptrdiff_t first, std::ptrdiff_t stride, int length, float courant,
                           float fourier) {
  const float* c = values + first;
  const float *u = velocity + first, *p = passes + first;
  flux += first;
  for (std::ptrdiff_t i = 0; i < length; ++i) {
    const float before = c[i - 2 * stride], low = c[i - stride], high = c[i],
                beyond = c[i + stride];
    const float number = courant * u[i];
    const bool upward = number > 0.0f;
    const float up = upward ? low : high, down = upward ? high : low;
    const float behind = upward ? before : beyond;
    const float size = upward ? number : -number;
    // van Leer's harmonic mean of the two slopes, none at an extreme.
    const float rise = down - up, rose = up - behind;
    const float product = rise * rose;
    const float sum = rise + rose;
    const float mean = product > 0.0f ? product / (product > 0.0f ? sum : 1.0f) : 0.0f;
    const float inner = 1.0f - size;
    const float value = up + (inner > 0.0f ? inner : 0.0f) * mean;
    const float passed = number * value - fourier * (high - low);
    flux[i] = p[i] > 0.0f ? passed : 0.0f;
  }
}

VISCERA_WIDE void update_row(float* __restrict values, const float* __restrict fx,
                             const float* __restrict fy, const float* __restrict fz,
                             std::ptrdiff_t row, std::ptrdiff_t layer, std::ptrdiff_t first,
                             int length) {
  float* c = values + first;
  fx += first, fy += first, fz += first;
  for (std::ptrdiff_t i = 0; i < length; ++i)
    c[i] = c[i] - ((fx[i + 1] - fx[i]) + (fy[i + row] - fy[i]) + (fz[i + layer] - fz[i]));
}

}  // namespace

bool GasContents::any() const {
  return std::ranges::any_of(of, [](const std::vector<float>& kind) { return !kind.empty(); });
}

GasContent GasContents::at(std::size_t cell) const {
  const auto value = [&](GasKind kind) {
    return of[kind].empty() ? 0.0 : static_cast<double>(of[kind][cell]);
  };
  return {value(kGasHeat), value(kGasVapour), value(kGasDroplets), value(kGasAir)};
}

GasContent GasContents::stored(const GasLayout& layout, double cell_volume) const {
  std::array<double, kGasKinds> sums{};
  for (std::size_t kind = 0; kind < kGasKinds; ++kind) {
    if (of[kind].empty()) continue;
    layout.rows([&](std::ptrdiff_t c, int length, int, int) {
      for (std::ptrdiff_t i = c; i < c + length; ++i)
        sums[kind] += static_cast<double>(of[kind][static_cast<std::size_t>(i)]);
    });
    sums[kind] *= cell_volume;
  }
  return {sums[kGasHeat], sums[kGasVapour], sums[kGasDroplets], sums[kGasAir]};
}

GasBox GasBox::grown(int cells, const std::array<int, 3>& n) const {
  GasBox box = *this;
  if (empty()) return box;
  for (int axis = 0; axis < 3; ++axis) {
    box.low[axis] = std::max(0, low[axis] - cells);
    box.high[axis] = std::min(n[axis] - 1, high[axis] + cells);
  }
  return box;
}

GasBox GasTransport::box_of(const GasContents& contents, const Least& least) const {
  GasBox box;
  box.low = layout_.n;
  for (std::size_t kind = 0; kind < kGasKinds; ++kind) {
    if (contents.of[kind].empty()) continue;
    const float* values = contents.of[kind].data();
    layout_.rows([&](std::ptrdiff_t c, int length, int j, int k) {
      int first = length, last = -1;
      for (int i = 0; i < length; ++i) {
        if (!(std::abs(values[c + i]) > least[kind])) continue;
        first = std::min(first, i);
        last = i;
      }
      if (last < 0) return;
      box.low = {std::min(box.low[0], first), std::min(box.low[1], j), std::min(box.low[2], k)};
      box.high = {std::max(box.high[0], last), std::max(box.high[1], j), std::max(box.high[2], k)};
    });
  }
  if (box.high[0] < 0) return {};
  return box;
}

double GasTransport::fastest(const Flow& flow, const GasFaces& velocity, const GasBox& box) const {
  struct Most {
    double rate = 0.0;
    Most& operator+=(double other) {
      rate = std::max(rate, other);
      return *this;
    }
    Most& operator+=(const Most& other) { return *this += other.rate; }
  };
  const Vec3f per = flow.spacing.cwiseInverse().cast<float>();
  return sum_box_rows(layout_, box, Most(),
                      [&](std::ptrdiff_t c, int length) {
                        float most = 0.0f;
                        for (std::ptrdiff_t i = c; i < c + length; ++i) {
                          float rate = 0.0f;
                          for (int axis = 0; axis < 3; ++axis) {
                            const float* u = velocity[axis].data() + i;
                            rate += per[axis] * (std::max(0.0f, u[layout_.stride[axis]]) +
                                                 std::max(0.0f, -u[0]));
                          }
                          most = std::max(most, rate);
                        }
                        return static_cast<double>(most);
                      })
      .rate;
}

/// Cells that would be emptied faster than `most` give through each face as much less.
std::size_t GasTransport::slow_down(const Flow& flow, const GasBox& box, double most) {
  slowed_ = *flow.velocity;
  const Vec3f per = flow.spacing.cwiseInverse().cast<float>();
  std::size_t count = 0;
  for (int k = box.low[2]; k <= box.high[2]; ++k)
    for (int j = box.low[1]; j <= box.high[1]; ++j)
      for (int i = box.low[0]; i <= box.high[0]; ++i) {
        const std::ptrdiff_t c = layout_.index(i, j, k);
        float rate = 0.0f;
        for (int axis = 0; axis < 3; ++axis) {
          const float* u = (*flow.velocity)[axis].data() + c;
          rate += per[axis] * (std::max(0.0f, u[layout_.stride[axis]]) + std::max(0.0f, -u[0]));
        }
        if (static_cast<double>(rate) <= most) continue;
        ++count;
        const auto share = static_cast<float>(most) / rate;
        for (int axis = 0; axis < 3; ++axis) {
          float* u = slowed_[axis].data() + c;
          if (u[layout_.stride[axis]] > 0.0f) u[layout_.stride[axis]] *= share;
          if (u[0] < 0.0f) u[0] *= share;
        }
      }
  return count;
}

void GasTransport::find_fluxes(const Flow& flow, const GasFaces& velocity, const GasBox& box,
                               const std::vector<float>& values, double diffusivity, double dt) {
  for (int axis = 0; axis < 3; ++axis) {
    const double h = flow.spacing[axis];
    const auto courant = static_cast<float>(dt / h);
    const auto fourier = static_cast<float>(diffusivity * dt / (h * h));
    const std::ptrdiff_t stride = layout_.stride[axis];
    float* flux = flux_[axis].data();
    const float *u = velocity[axis].data(), *passes = (*flow.passes)[axis].data();
    // The sides of the box: nothing passes, but where it is the domain's and that is open, as much
    // leaves as the last cell has, and what comes in brings nothing.
    const auto outside = [&](std::ptrdiff_t face, std::ptrdiff_t inside, bool upper, bool domain) {
      const float out = courant * (upper ? u[face] : -u[face]);
      const float passed =
          domain && passes[face] > 0.0f && out > 0.0f ? out * values[inside] : 0.0f;
      flux[face] = upper ? passed : -passed;
    };
    const bool low_side = box.low[axis] == 0, high_side = box.high[axis] == layout_.n[axis] - 1;
    for_box_rows(layout_, box, [&](std::ptrdiff_t c, int length, int j, int k) {
      if (axis == 0) {
        outside(c, c, false, low_side);
        flux_row(values.data(), u, passes, flux, c + 1, stride, length - 1, courant, fourier);
        outside(c + length, c + length - 1, true, high_side);
        return;
      }
      const int at = axis == 1 ? j : k;
      if (at == box.low[axis]) {
        for (std::ptrdiff_t i = c; i < c + length; ++i) outside(i, i, false, low_side);
      } else {
        flux_row(values.data(), u, passes, flux, c, stride, length, courant, fourier);
      }
      if (at == box.high[axis])
        for (std::ptrdiff_t i = c; i < c + length; ++i) outside(i + stride, i, true, high_side);
    });
  }
}

GasTransport::Lost GasTransport::update(const Flow& flow, const GasBox& box,
                                        double wall_diffusivity, double dt,
                                        std::vector<float>& values,
                                        std::span<float> to_walls) const {
  const auto wall = static_cast<float>(wall_diffusivity * dt);
  const auto sink = static_cast<float>(dt);
  return sum_box_rows(layout_, box, Lost(), [&](std::ptrdiff_t c, int length) {
    update_row(values.data(), flux_[0].data(), flux_[1].data(), flux_[2].data(), layout_.stride[1],
               layout_.stride[2], c, length);
    Lost lost;
    for (auto i = static_cast<std::size_t>(c); i < static_cast<std::size_t>(c + length); ++i) {
      const float drawn = sink * flow.sinks[i], warmed = wall * flow.walls[i];
      if (drawn + warmed == 0.0f) continue;
      // Implicit, so that no more is taken than there is.
      const float left = values[i] / (1.0f + drawn + warmed);
      values[i] = left;
      lost.out += static_cast<double>(left * drawn);
      lost.walls += static_cast<double>(left * warmed);
      if (wall > 0.0f) to_walls[i] += left * warmed;
    }
    return lost;
  });
}

GasTransport::Outcome GasTransport::move(const Flow& flow, const Least& least, double dt,
                                         GasContents& contents, std::span<float> to_walls) {
  Outcome outcome;
  const GasBox felt = box_of(contents, least);
  if (felt.empty() || !(dt > 0.0)) return outcome;
  for (auto& faces : flux_) faces.resize(static_cast<std::size_t>(layout_.count), 0.0f);
  // Nothing gets further than half a cell in a substep; two more for what second order looks at.
  const auto room = [&](int substeps) { return felt.grown(substeps / 2 + 2, layout_.n); };
  double spread = 0.0;
  for (const double diffusivity : flow.diffusivity)
    spread = std::max(spread, 2.0 * diffusivity * flow.spacing.cwiseAbs2().cwiseInverse().sum());
  const GasFaces* velocity = flow.velocity;
  const double rate = fastest(flow, *velocity, room(kMostSubsteps)) + spread;
  outcome.substeps = std::max(1, static_cast<int>(std::ceil(dt * rate / kMostOfCell)));
  if (outcome.substeps > kMostSubsteps) {
    outcome.substeps = kMostSubsteps;
    const double most = std::max(0.0, kMostOfCell * kMostSubsteps / dt - spread);
    outcome.slowed = slow_down(flow, room(kMostSubsteps), most);
    velocity = &slowed_;
  }
  const GasBox box = room(outcome.substeps);
  const double step = dt / outcome.substeps, volume = flow.spacing.prod();
  // What leaves through open sides is what is missing afterwards; doubles see it.
  GasBook& book = contents.book;
  const auto leave = [&](GasKind kind, double out, double walls) {
    if (kind == kGasHeat) {
      book.heat_out += out, book.heat_to_walls += walls;
    } else if (kind == kGasAir) {
      book.air_out += out;
    } else {
      book.water_out += out;
      if (kind == kGasDroplets) book.heat_out -= gas::kLatentHeat * out;
    }
  };
  for (std::size_t k = 0; k < kGasKinds; ++k) {
    std::vector<float>& values = contents.of[k];
    if (values.empty()) continue;
    const auto kind = static_cast<GasKind>(k);
    const double walls = kind == kGasHeat ? flow.diffusivity[k] : 0.0;
    for (int s = 0; s < outcome.substeps; ++s) {
      find_fluxes(flow, *velocity, box, values, flow.diffusivity[k], step);
      const double through = through_sides(box);
      const Lost lost = update(flow, box, walls, step, values, to_walls);
      leave(kind, (lost.out + through) * volume, lost.walls * volume);
    }
  }
  return outcome;
}

/// What the fluxes take through the domain's sides, by volume of a cell.
double GasTransport::through_sides(const GasBox& box) const {
  double sum = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    const float* flux = flux_[axis].data();
    const int b = (axis + 1) % 3, d = (axis + 2) % 3;
    for (const bool upper : {false, true}) {
      std::array<int, 3> at{};
      at[axis] = upper ? box.high[axis] + 1 : box.low[axis];
      if (upper ? box.high[axis] != layout_.n[axis] - 1 : box.low[axis] != 0) continue;
      for (at[d] = box.low[d]; at[d] <= box.high[d]; ++at[d])
        for (at[b] = box.low[b]; at[b] <= box.high[b]; ++at[b]) {
          const float passed = flux[layout_.index(at[0], at[1], at[2])];
          sum += static_cast<double>(upper ? passed : -passed);
        }
    }
  }
  return sum;
}

std::size_t GasTransport::memory_bytes() const {
  std::size_t bytes = 0;
  for (int axis = 0; axis < 3; ++axis)
    bytes += (flux_[axis].capacity() + slowed_[axis].capacity()) * sizeof(float);
  return bytes;
}

}  // namespace viscera
