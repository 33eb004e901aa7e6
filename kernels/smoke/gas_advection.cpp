#include "kernels/smoke/gas_advection.h"

#include <algorithm>

#include "kernels/base/wide.h"
#include "kernels/smoke/gas_rows.h"

namespace viscera {

namespace {

// One component's faces, ready for rows of places (gas_sampling.h is the same for a single place).
struct Component {
  const float* values;
  int row, layer;
  float shift[3];      // of its faces from the cells' corners [cells]
  float last[3];       // the outermost face
  int last_corner[3];  // the least corner of the outermost eight faces
  int first;           // index of face (0, 0, 0)
};

Component component(const GasLayout& layout, const GasFaces& velocity, int axis) {
  Component c{};
  c.values = velocity[axis].data();
  c.row = static_cast<int>(layout.stride[1]);
  c.layer = static_cast<int>(layout.stride[2]);
  for (int along = 0; along < 3; ++along) {
    c.shift[along] = along == axis ? 0.0f : 0.5f;
    const int last = layout.faces(axis, along) - 1;
    c.last[along] = static_cast<float>(last);
    c.last_corner[along] = std::max(last - 1, 0);
  }
  c.first = static_cast<int>(layout.index(0, 0, 0));
  return c;
}

struct Corner {
  int base;
  float x, y, z;
};

inline float inside(const Component& c, int axis, float at) {
  const float shifted = at - c.shift[axis];
  const float above = shifted > 0.0f ? shifted : 0.0f;
  return above < c.last[axis] ? above : c.last[axis];
}

inline Corner corner(const Component& c, float x, float y, float z) {
  const float u = inside(c, 0, x), v = inside(c, 1, y), w = inside(c, 2, z);
  const auto cell = [&](int axis, float at) {
    const int lower = static_cast<int>(at);
    return lower < c.last_corner[axis] ? lower : c.last_corner[axis];
  };
  const int i = cell(0, u), j = cell(1, v), k = cell(2, w);
  return {c.first + i + c.row * j + c.layer * k, u - static_cast<float>(i),
          v - static_cast<float>(j), w - static_cast<float>(k)};
}

inline float mix(float a, float b, float t) {
  return a + t * (b - a);
}
inline float lesser(float a, float b) {
  return a < b ? a : b;
}
inline float greater(float a, float b) {
  return a > b ? a : b;
}

inline float interpolate(const Component& c, const Corner& s) {
  const float *v = c.values, *up = c.values + c.layer;
  const float* v_row = v + c.row;
  const float* up_row = up + c.row;
  const float low =
      mix(mix(v[s.base], v[s.base + 1], s.x), mix(v_row[s.base], v_row[s.base + 1], s.x), s.y);
  const float high =
      mix(mix(up[s.base], up[s.base + 1], s.x), mix(up_row[s.base], up_row[s.base + 1], s.x), s.y);
  return mix(low, high, s.z);
}

// A row of cells or faces: where it lies, and what is read and written there.
struct Row {
  std::ptrdiff_t first;
  int length;
  float x, y, z;  // its first place [cells]
};

// Half of the way that gas came, in cells, to the middles of a row of cells: by the midpoint rule.
// A face adds those of its two cells.
VISCERA_WIDE void trace_row(const Component& cx, const Component& cy, const Component& cz,
                            const float* step, const Row& given, float* __restrict way_x,
                            float* __restrict way_y, float* __restrict way_z) {
  const Component a = cx, b = cy, d = cz;
  const Row r = given;
  const float step_x = step[0], step_y = step[1], step_z = step[2];
  const float *ux = a.values + r.first, *uy = b.values + r.first, *uz = d.values + r.first;
  way_x += r.first;
  way_y += r.first;
  way_z += r.first;
  for (int i = 0; i < r.length; ++i) {
    const float x = (r.x + static_cast<float>(i)) - 0.25f * step_x * (ux[i] + ux[i + 1]);
    const float y = r.y - 0.25f * step_y * (uy[i] + uy[i + b.row]);
    const float z = r.z - 0.25f * step_z * (uz[i] + uz[i + d.layer]);
    way_x[i] = 0.5f * step_x * interpolate(a, corner(a, x, y, z));
    way_y[i] = 0.5f * step_y * interpolate(b, corner(b, x, y, z));
    way_z[i] = 0.5f * step_z * interpolate(d, corner(d, x, y, z));
  }
}

// Of trace_row.
struct Ways {
  const float *x, *y, *z;
  std::ptrdiff_t below;  // from a face to the cell below it
};

struct Targets {
  float *least, *most, *moved;
};

// What was where the gas of a row of faces came from.
VISCERA_WIDE void move_row(const Component& own, const Ways& ways, const Row& given,
                           const float* passes, const Targets& targets) {
  const Component self = own;
  const Row r = given;
  const float *wx = ways.x + r.first, *wy = ways.y + r.first, *wz = ways.z + r.first;
  const std::ptrdiff_t below = ways.below;
  const float* kept = self.values + r.first;
  passes += r.first;
  float* __restrict least = targets.least + r.first;
  float* __restrict most = targets.most + r.first;
  float* __restrict moved = targets.moved + r.first;
  for (int i = 0; i < r.length; ++i) {
    const Corner s = corner(self, (r.x + static_cast<float>(i)) - (wx[i] + wx[i + below]),
                            r.y - (wy[i] + wy[i + below]), r.z - (wz[i] + wz[i + below]));
    const float *v = self.values, *up = v + self.layer;
    const float *v_row = v + self.row, *up_row = up + self.row;
    const float v0 = v[s.base], v1 = v[s.base + 1], v2 = v_row[s.base], v3 = v_row[s.base + 1];
    const float v4 = up[s.base], v5 = up[s.base + 1], v6 = up_row[s.base], v7 = up_row[s.base + 1];
    const float value = mix(mix(mix(v0, v1, s.x), mix(v2, v3, s.x), s.y),
                            mix(mix(v4, v5, s.x), mix(v6, v7, s.x), s.y), s.z);
    const float low =
        lesser(lesser(lesser(v0, v1), lesser(v2, v3)), lesser(lesser(v4, v5), lesser(v6, v7)));
    const float high = greater(greater(greater(v0, v1), greater(v2, v3)),
                               greater(greater(v4, v5), greater(v6, v7)));
    least[i] = low;
    most[i] = high;
    moved[i] = value;
  }
  // By itself, so that the loop above has no branch.
  for (int i = 0; i < r.length; ++i) {
    const bool free = passes[i] > 0.0f;
    least[i] = free ? least[i] : kept[i];
    most[i] = free ? most[i] : kept[i];
    moved[i] = free ? moved[i] : kept[i];
  }
}

// What the step forward loses on the way there and back is added by half. The way back is the way
// there mirrored, which is as good to second order.
VISCERA_WIDE void correct_row(const Component& forward, const float* values, const Ways& ways,
                              const Row& given, const Targets& targets, float* __restrict result) {
  const Component m = forward;
  const Row r = given;
  const float *wx = ways.x + r.first, *wy = ways.y + r.first, *wz = ways.z + r.first;
  const std::ptrdiff_t below = ways.below;
  const float *least = targets.least + r.first, *most = targets.most + r.first;
  const float *moved = m.values + r.first, *kept = values + r.first;
  result += r.first;
  for (int i = 0; i < r.length; ++i) {
    const float back =
        interpolate(m, corner(m, (r.x + static_cast<float>(i)) + (wx[i] + wx[i + below]),
                              r.y + (wy[i] + wy[i + below]), r.z + (wz[i] + wz[i + below])));
    const float corrected = moved[i] + 0.5f * (kept[i] - back);
    result[i] = greater(lesser(corrected, most[i]), least[i]);
  }
}

// The part of a row between its first and its last face that gas passes; the rest costs nothing.
Row moving_part(Row row, const float* passes) {
  passes += row.first;
  int begin = 0, end = row.length;
  while (begin < end && !(passes[begin] > 0.0f)) ++begin;
  while (end > begin && !(passes[end - 1] > 0.0f)) --end;
  row.first += begin;
  row.x += static_cast<float>(begin);
  row.length = end - begin;
  return row;
}

// Ghosts beside a side take what the cell inside of them has.
void fill_ghosts(const GasLayout& layout, std::vector<float>& values) {
  const auto at = [&](int i, int j, int k) -> float& {
    return values[static_cast<std::size_t>(layout.index(i, j, k))];
  };
  const auto& n = layout.n;
  for (int j = 0; j < n[1]; ++j) {
    for (int i = 0; i < n[0]; ++i) at(i, j, -1) = at(i, j, 0), at(i, j, n[2]) = at(i, j, n[2] - 1);
  }
  for (int k = 0; k < n[2]; ++k) {
    for (int i = 0; i < n[0]; ++i) at(i, -1, k) = at(i, 0, k), at(i, n[1], k) = at(i, n[1] - 1, k);
    for (int j = 0; j < n[1]; ++j) at(-1, j, k) = at(0, j, k), at(n[0], j, k) = at(n[0] - 1, j, k);
  }
}

}  // namespace

void GasAdvection::step(const GasLayout& layout, const GasFaces& passes, const Vec3& spacing,
                        double dt, GasFaces& velocity) {
  const auto count = static_cast<std::size_t>(layout.count);
  for (auto* values : {&way_[0], &way_[1], &way_[2], &least_, &most_}) values->resize(count, 0.0f);
  for (int axis = 0; axis < 3; ++axis) {
    moved_[axis].resize(count, 0.0f);
    result_[axis].resize(count, 0.0f);
  }
  const Component x = component(layout, velocity, 0), y = component(layout, velocity, 1),
                  z = component(layout, velocity, 2);
  const Vec3f step = (dt * spacing.cwiseInverse()).cast<float>();
  for_gas_rows(layout, [&](std::ptrdiff_t c, int length, int j, int k) {
    Row row{c, length, 0.5f, static_cast<float>(j) + 0.5f, static_cast<float>(k) + 0.5f};
    // Rows of cells that no gas enters have no way.
    const auto entered = [&](int axis, std::ptrdiff_t first) {
      return moving_part({first, length, 0.0f, 0.0f, 0.0f}, passes[axis].data()).length > 0;
    };
    bool any = entered(0, c) || entered(0, c + 1);
    for (int axis = 1; axis < 3; ++axis) {
      any = any || entered(axis, c) || entered(axis, c + layout.stride[axis]);
    }
    if (!any) return;
    trace_row(x, y, z, step.data(), row, way_[0].data(), way_[1].data(), way_[2].data());
  });
  // Ghosts go as the cell inside of them, so that gas on an open side does.
  for (auto& way : way_) fill_ghosts(layout, way);
  for (int axis = 0; axis < 3; ++axis) {
    const Component own = component(layout, velocity, axis);
    const Component forward = component(layout, moved_, axis);
    const Ways ways{way_[0].data(), way_[1].data(), way_[2].data(), -layout.stride[axis]};
    const Targets targets{least_.data(), most_.data(), moved_[axis].data()};
    const auto row = [&](std::ptrdiff_t c, int length, int j, int k) {
      return Row{c, length, own.shift[0], static_cast<float>(j) + own.shift[1],
                 static_cast<float>(k) + own.shift[2]};
    };
    for_gas_face_rows(layout, axis, [&](std::ptrdiff_t c, int length, int j, int k) {
      std::copy_n(velocity[axis].data() + c, length, moved_[axis].data() + c);
      const Row part = moving_part(row(c, length, j, k), passes[axis].data());
      if (part.length > 0) move_row(own, ways, part, passes[axis].data(), targets);
    });
    for_gas_face_rows(layout, axis, [&](std::ptrdiff_t c, int length, int j, int k) {
      std::copy_n(velocity[axis].data() + c, length, result_[axis].data() + c);
      const Row part = moving_part(row(c, length, j, k), passes[axis].data());
      if (part.length > 0) {
        correct_row(forward, velocity[axis].data(), ways, part, targets, result_[axis].data());
      }
    });
  }
  std::swap(velocity, result_);
}

}  // namespace viscera
