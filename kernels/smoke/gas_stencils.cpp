#include "kernels/smoke/gas_stencils.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "kernels/base/lanes.h"
#include "kernels/base/parallel.h"
#include "kernels/base/wide.h"
#include "kernels/base/wider.h"

namespace viscera {
namespace {

constexpr std::size_t kBlock = 512;  // points that one loop works on
constexpr std::size_t kSortChunk = 8192;

// --- where points lie

/// Between grid lines (shift 0) or middles (shift 0.5) of which the last has the number `last`: the
/// lower one's number and how far to the next. What isn't a number lies at 0.
VISCERA_WIDE void split(const float* __restrict at, std::size_t count, float shift, int last,
                        float* __restrict part, std::int32_t* __restrict lower) {
  const auto most = static_cast<float>(last);
  const int last_lower = last > 0 ? last - 1 : 0;
  for (std::size_t i = 0; i < count; ++i) {
    const float shifted = at[i] - shift;
    const float above = shifted > 0.0f ? shifted : 0.0f;
    const float inside = above < most ? above : most;
    const int cell = static_cast<int>(inside);
    lower[i] = cell < last_lower ? cell : last_lower;
    part[i] = inside - static_cast<float>(lower[i]);
  }
}

VISCERA_WIDE void number(const std::int32_t* __restrict i, const std::int32_t* __restrict j,
                         const std::int32_t* __restrict k, std::size_t count, int first, int row,
                         int layer, std::int32_t* __restrict base) {
  for (std::size_t p = 0; p < count; ++p) base[p] = first + i[p] + row * j[p] + layer * k[p];
}

// --- reading

/// Faces of one axis and the points among them.
struct Among {
  const float* faces;
  int row, layer;
  const std::int32_t* base;
  const float *x, *y, *z;
};

inline float mix(float a, float b, float t) {
  return a + t * (b - a);
}

VISCERA_WIDE void read_block(const Among& given, std::size_t count, float* __restrict values) {
  const Among a = given;
  const float *f = a.faces, *f_row = f + a.row, *up = f + a.layer, *up_row = up + a.row;
  for (std::size_t i = 0; i < count; ++i) {
    const std::int32_t b = a.base[i];
    const float low = mix(mix(f[b], f[b + 1], a.x[i]), mix(f_row[b], f_row[b + 1], a.x[i]), a.y[i]);
    const float high =
        mix(mix(up[b], up[b + 1], a.x[i]), mix(up_row[b], up_row[b + 1], a.x[i]), a.y[i]);
    values[i] = mix(low, high, a.z[i]);
  }
}

// --- spreading

/// What the eight faces about a place get: x fastest, then y, then z.
using Corners = double __attribute__((vector_size(64)));
struct alignas(64) Gathered {  // so that none straddles two cache lines
  std::array<double, 8> of = {};
};

/// What faces on the lower (0) and upper (1) side along an axis take of a point at t from the
/// lower: 1 - t and t, rounded once.
constexpr Corners kLowX = {1, 0, 1, 0, 1, 0, 1, 0}, kSignX = {-1, 1, -1, 1, -1, 1, -1, 1};
constexpr Corners kLowY = {1, 1, 0, 0, 1, 1, 0, 0}, kSignY = {-1, -1, 1, 1, -1, -1, 1, 1};
constexpr Corners kLowZ = {1, 1, 1, 1, 0, 0, 0, 0}, kSignZ = {-1, -1, -1, -1, 1, 1, 1, 1};

/// The points of one layer, and where their eight faces of each axis are gathered.
struct Layer {
  std::span<const std::uint32_t> points;
  std::array<const float*, 3> line, middle;
  std::array<const std::int32_t*, 3> base;
  StridedVectors<const float> values;
  std::array<std::ptrdiff_t, 3> first;  // base of slabs' first entry
  std::array<Gathered*, 3> slabs;
};

VISCERA_INLINE void add(Gathered& sums, const Corners& weights, double value) {
  Corners all;
  std::memcpy(&all, sums.of.data(), sizeof all);
  all += weights * value;
  std::memcpy(sums.of.data(), &all, sizeof all);
}

VISCERA_INLINE void spread_layer_on(const Layer& given) {
  const Layer layer = given;
  for (const std::uint32_t i : layer.points) {
    const auto at = static_cast<std::ptrdiff_t>(i) * layer.values.stride;
    const float vx = layer.values.x[at], vy = layer.values.y[at], vz = layer.values.z[at];
    if (!std::isfinite(vx) || !std::isfinite(vy) || !std::isfinite(vz)) continue;
    const auto part = [&](const std::array<const float*, 3>& of, int axis) {
      return static_cast<double>(of[axis][i]);
    };
    const Corners x = kLowX + kSignX * part(layer.middle, 0);
    const Corners y = kLowY + kSignY * part(layer.middle, 1);
    const Corners z = kLowZ + kSignZ * part(layer.middle, 2);
    const Corners of_x = (kLowX + kSignX * part(layer.line, 0)) * (y * z);
    const Corners of_y = (kLowY + kSignY * part(layer.line, 1)) * (x * z);
    const Corners of_z = (kLowZ + kSignZ * part(layer.line, 2)) * (x * y);
    add(layer.slabs[0][layer.base[0][i] - layer.first[0]], of_x, static_cast<double>(vx));
    add(layer.slabs[1][layer.base[1][i] - layer.first[1]], of_y, static_cast<double>(vy));
    add(layer.slabs[2][layer.base[2][i] - layer.first[2]], of_z, static_cast<double>(vz));
  }
}

#if VISCERA_THREE_TARGETS
VISCERA_FOR_AVX512 void spread_layer(const Layer& layer) {
  spread_layer_on(layer);
}
VISCERA_FOR_AVX2 void spread_layer(const Layer& layer) {
  spread_layer_on(layer);
}
#endif
VISCERA_FOR_ANY void spread_layer(const Layer& layer) {
  spread_layer_on(layer);
}

/// Adds a slab to the faces from `sums` on, and empties it. Neighbours along x meet in one face.
void add_slab(Gathered* slab, std::ptrdiff_t length, std::ptrdiff_t row, std::ptrdiff_t layer,
              double* sums) {
  double* const faces[4] = {sums, sums + row, sums + layer, sums + layer + row};
  double before[4] = {};
  for (std::ptrdiff_t i = 0; i < length; ++i) {
    const std::array<double, 8>& here = slab[i].of;
    for (int f = 0; f < 4; ++f) {
      faces[f][i] += here[2 * f] + before[f];
      before[f] = here[2 * f + 1];
    }
    slab[i] = {};
  }
  for (int f = 0; f < 4; ++f) faces[f][length] += before[f];
}

}  // namespace

void GasStencils::place(const GasLayout& layout, const Vec3& least, const Vec3& spacing,
                        const GasPoints& points) {
  layout_ = layout;
  const std::size_t count = points.size();
  for (int axis = 0; axis < 3; ++axis) {
    for (auto* values : {&line_[axis], &middle_[axis]}) values->resize(count);
    base_[axis].resize(count);
  }
  cell_base_.resize(count);
  layer_.resize(count);
  const Vec3f shift = (points.origin - least).cast<float>();
  const Vec3f scale = spacing.cwiseInverse().cast<float>();
  const int row = static_cast<int>(layout.stride[1]), layer = static_cast<int>(layout.stride[2]);
  const int first = static_cast<int>(layout.index(0, 0, 0));
  parallel_chunks(count, kBlock, [&](std::size_t begin, std::size_t end) {
    std::array<std::array<float, kBlock>, 3> at;
    std::array<std::array<std::int32_t, kBlock>, 3> line, middle;
    const std::size_t length = end - begin;
    for (std::size_t i = 0; i < length; ++i) {
      const Vec3f place = (points.places.at(begin + i) + shift).cwiseProduct(scale);
      for (int axis = 0; axis < 3; ++axis) at[axis][i] = place[axis];
    }
    for (int axis = 0; axis < 3; ++axis) {
      split(at[axis].data(), length, 0.0f, layout.n[axis], line_[axis].data() + begin,
            line[axis].data());
      split(at[axis].data(), length, 0.5f, layout.n[axis] - 1, middle_[axis].data() + begin,
            middle[axis].data());
    }
    for (int axis = 0; axis < 3; ++axis) {
      const auto lower = [&](int along) { return (axis == along ? line : middle)[along].data(); };
      number(lower(0), lower(1), lower(2), length, first, row, layer, base_[axis].data() + begin);
    }
    number(middle[0].data(), middle[1].data(), middle[2].data(), length, first, row, layer,
           cell_base_.data() + begin);
    std::copy_n(line[2].data(), length, layer_.data() + begin);
  });
  sorted_ = false;
}

void GasStencils::sort_by_layer() {
  sorted_ = true;
  const std::size_t count = size(), chunks = (count + kSortChunk - 1) / kSortChunk;
  const auto layers = static_cast<std::size_t>(layout_.n[2]);
  next_.assign(chunks * layers, 0);
  parallel_chunks(count, kSortChunk, [&](std::size_t begin, std::size_t end) {
    std::uint32_t* counts = next_.data() + begin / kSortChunk * layers;
    for (std::size_t i = begin; i < end; ++i) ++counts[layer_[i]];
  });
  first_.resize(layers + 1);
  std::uint32_t before = 0;
  for (std::size_t l = 0; l < layers; ++l) {
    first_[l] = before;
    for (std::size_t c = 0; c < chunks; ++c) {
      const std::uint32_t here = next_[c * layers + l];
      next_[c * layers + l] = before;
      before += here;
    }
  }
  first_[layers] = before;
  order_.resize(count);
  parallel_chunks(count, kSortChunk, [&](std::size_t begin, std::size_t end) {
    std::uint32_t* next = next_.data() + begin / kSortChunk * layers;
    for (std::size_t i = begin; i < end; ++i) {
      order_[next[layer_[i]]++] = static_cast<std::uint32_t>(i);
    }
  });
}

void GasStencils::read(const GasFaces& faces, const StridedVectors<float>& values) const {
  const int row = static_cast<int>(layout_.stride[1]), layer = static_cast<int>(layout_.stride[2]);
  parallel_chunks(size(), kBlock, [&](std::size_t begin, std::size_t end) {
    std::array<std::array<float, kBlock>, 3> found;
    for (int axis = 0; axis < 3; ++axis) {
      const auto part = [&](int along) {
        return (axis == along ? line_ : middle_)[along].data() + begin;
      };
      read_block(
          {faces[axis].data(), row, layer, base_[axis].data() + begin, part(0), part(1), part(2)},
          end - begin, found[axis].data());
    }
    for (std::size_t i = begin; i < end; ++i) {
      values.set(i, {found[0][i - begin], found[1][i - begin], found[2][i - begin]});
    }
  });
}

void GasStencils::read_cells(std::span<const float> cells, std::span<float> values) const {
  const int row = static_cast<int>(layout_.stride[1]), layer = static_cast<int>(layout_.stride[2]);
  parallel_chunks(size(), kBlock, [&](std::size_t begin, std::size_t end) {
    read_block({cells.data(), row, layer, cell_base_.data() + begin, middle_[0].data() + begin,
                middle_[1].data() + begin, middle_[2].data() + begin},
               end - begin, values.data() + begin);
  });
}

void GasStencils::spread(const StridedVectors<const float>& values,
                         std::array<std::vector<double>, 3>& sums) {
  if (!sorted_) sort_by_layer();
  const std::size_t layers = size() > 0 ? first_.size() - 1 : 0;
  const std::ptrdiff_t row = layout_.stride[1], layer = layout_.stride[2];
  // A point's faces across z begin in its own layer, the others in that or the one below.
  constexpr std::array<std::ptrdiff_t, 3> kSlabs = {2, 2, 1};
  for (std::size_t colour = 0; colour < 3; ++colour) {
    parallel_for_each_index((layers + 2 - colour) / 3, 1, [&](std::size_t third) {
      const std::size_t l = 3 * third + colour;
      if (first_[l] == first_[l + 1]) return;
      // Empty between any two layers.
      thread_local std::array<std::vector<Gathered>, 3> slabs;
      Layer all;
      all.points = std::span(order_).subspan(first_[l], first_[l + 1] - first_[l]);
      all.values = values;
      std::array<std::ptrdiff_t, 3> low, high;
      for (int axis = 0; axis < 3; ++axis) {
        const auto length = static_cast<std::size_t>(kSlabs[axis] * layer);
        if (slabs[axis].size() < length) slabs[axis].resize(length);
        all.line[axis] = line_[axis].data();
        all.middle[axis] = middle_[axis].data();
        all.base[axis] = base_[axis].data();
        // Layer l of cells begins at (l + 1) layer: below it lies one of ghosts.
        all.first[axis] = (static_cast<std::ptrdiff_t>(l) + 2 - kSlabs[axis]) * layer;
        all.slabs[axis] = slabs[axis].data();
        low[axis] = layout_.count, high[axis] = 0;
        for (const std::uint32_t i : all.points) {
          low[axis] = std::min<std::ptrdiff_t>(low[axis], all.base[axis][i]);
          high[axis] = std::max<std::ptrdiff_t>(high[axis], all.base[axis][i]);
        }
      }
      spread_layer(all);
      for (int axis = 0; axis < 3; ++axis) {
        add_slab(all.slabs[axis] + (low[axis] - all.first[axis]), high[axis] - low[axis] + 1, row,
                 layer, sums[axis].data() + low[axis]);
      }
    });
  }
}

std::size_t GasStencils::memory_bytes() const {
  return layer_.capacity() * (6 * sizeof(float) + 5 * sizeof(std::int32_t)) +
         order_.capacity() * sizeof(std::uint32_t) + first_.capacity() * sizeof(std::size_t) +
         next_.capacity() * sizeof(std::uint32_t);
}

}  // namespace viscera
