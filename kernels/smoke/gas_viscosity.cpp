#include "kernels/smoke/gas_viscosity.h"

#include <algorithm>
#include <cmath>

#include "kernels/base/wide.h"
#include "kernels/smoke/gas_rows.h"

namespace viscera {

namespace {

// What one stage reads at a face and beside it: weights of the neighbours along each axis.
struct Stage {
  const float *now, *before, *free;
  std::array<const float*, 3> pull;
  std::array<std::ptrdiff_t, 3> stride;
  std::array<float, 3> weight;
  float now_part, before_part;
};

VISCERA_WIDE void stage_row(const Stage& given, float* __restrict next, std::ptrdiff_t c,
                            int length) {
  const Stage s = given;
  const auto second = [&](int axis, std::ptrdiff_t i) {
    const std::ptrdiff_t low = i - s.stride[axis], high = i + s.stride[axis];
    return s.weight[axis] * (s.pull[axis][low] * (s.now[low] - s.now[i]) +
                             s.pull[axis][high] * (s.now[high] - s.now[i]));
  };
  for (std::ptrdiff_t i = c; i < c + length; ++i) {
    const float sum = (second(0, i) + second(1, i)) + second(2, i);
    const float value = s.now_part * s.now[i] + (s.before_part * s.before[i] + sum);
    next[i] = s.free[i] > 0.0f ? value : s.now[i];
  }
}

}  // namespace

void GasViscosity::set_walls(const GasLayout& layout,
                             const std::array<std::vector<std::uint8_t>, 3>& free,
                             const Walls& walls) {
  layout_ = layout;
  const auto count = static_cast<std::size_t>(layout.count);
  const float wall = walls.no_slip ? 2.0f : 0.0f;
  for (int axis = 0; axis < 3; ++axis) {
    for (auto* faces : {&before_, &now_, &next_}) (*faces)[axis].assign(count, 0.0f);
    aside_[axis].assign(count, 0.0f);
    along_[axis].assign(count, 0.0f);
    free_[axis].assign(count, 0.0f);
    for (int k = -1; k <= layout.n[2]; ++k) {
      for (int j = -1; j <= layout.n[1]; ++j) {
        for (int i = -1; i <= layout.n[0]; ++i) {
          const std::array<int, 3> at{i, j, k};
          const auto f = static_cast<std::size_t>(layout.index(i, j, k));
          bool exists = true, outside_open = false;
          for (int other = 0; other < 3; ++other) {
            const bool low = at[other] < 0, high = at[other] >= layout.faces(axis, other);
            exists &= !low && !high;
            outside_open |= (low && walls.open[2 * other]) || (high && walls.open[2 * other + 1]);
          }
          along_[axis][f] = exists ? 1.0f : 0.0f;
          free_[axis][f] = free[axis][f] ? 1.0f : 0.0f;
          aside_[axis][f] = free[axis][f] ? 1.0f : (outside_open ? 0.0f : wall);
        }
      }
    }
  }
}

void GasViscosity::stage(int axis, float now_part, float before_part, const Vec3f& weights,
                         const std::vector<float>& now, const std::vector<float>& before,
                         std::vector<float>& next) const {
  Stage s{now.data(), before.data(), free_[axis].data(), {}, layout_.stride,
          {},         now_part,      before_part};
  for (int other = 0; other < 3; ++other) {
    s.pull[other] = (other == axis ? along_ : aside_)[axis].data();
    s.weight[other] = weights[other];
  }
  for_gas_face_rows(layout_, axis, [&](std::ptrdiff_t c, int length, int, int) {
    stage_row(s, next.data(), c, length);
  });
}

void GasViscosity::step(const Vec3& spacing, double viscosity, double dt, GasFaces& velocity) {
  const Vec3 inverse = spacing.cwiseAbs2().cwiseInverse();
  // Explicit steps that overshoot nowhere, even between two walls half a cell away.
  const double steps = viscosity * dt * 4.0 * inverse.sum();
  if (!(steps > 0.0)) return;
  const int stages = std::clamp(
      static_cast<int>(std::ceil(0.5 * (std::sqrt(1.0 + 8.0 * std::min(steps, 1e6)) - 1.0))), 1,
      kMostStages);
  const double reached = std::min(steps, 0.5 * stages * (stages + 1));
  const double scale = 2.0 / (static_cast<double>(stages) * (stages + 1));
  const Vec3 weights = viscosity * dt * (reached / steps) * scale * inverse;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<float>&before = before_[axis], &now = now_[axis], &next = next_[axis];
    // [Meyer2012]: the stages obey the recursion of Legendre's polynomials.
    stage(axis, 1.0f, 0.0f, weights.cast<float>(), velocity[axis], velocity[axis], now);
    before.swap(velocity[axis]);
    for (int j = 2; j <= stages; ++j) {
      const double now_part = (2.0 * j - 1.0) / j, before_part = (1.0 - j) / j;
      stage(axis, static_cast<float>(now_part), static_cast<float>(before_part),
            (now_part * weights).cast<float>(), now, before, next);
      before.swap(now);
      now.swap(next);
    }
    velocity[axis].swap(now);
  }
}

}  // namespace viscera
