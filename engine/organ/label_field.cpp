#include "engine/organ/label_field.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "kernels/base/parallel.h"

namespace viscera {
namespace {

constexpr double kBand = 3.0;  // in greatest voxel edges: how far distances are exact

using Index = Eigen::Vector3i;

std::size_t at(const Index& size, int i, int j, int k) {
  return (static_cast<std::size_t>(k) * size.y() + j) * size.x() + i;
}

std::size_t count_of(const Index& size) {
  return static_cast<std::size_t>(size.x()) * size.y() * size.z();
}

int margin_along(const Vec3& spacing, int axis) {
  return static_cast<int>(std::ceil(kBand * spacing.maxCoeff() / spacing[axis])) + 2;
}

// Visits the faces' neighbours of voxel v.
template <class Visit>
void for_neighbours(const Index& size, std::size_t v, const Visit& visit) {
  const auto x = static_cast<std::size_t>(size.x()), xy = x * size.y();
  const std::size_t i = v % x, j = v / x % size.y(), k = v / xy;
  if (i > 0) visit(v - 1);
  if (i + 1 < x) visit(v + 1);
  if (j > 0) visit(v - x);
  if (j + 1 < static_cast<std::size_t>(size.y())) visit(v + x);
  if (k > 0) visit(v - xy);
  if (k + 1 < static_cast<std::size_t>(size.z())) visit(v + xy);
}

// Applies line(values, stride, length) to every line along each axis in turn.
template <class Line>
void along_axes(std::vector<float>& values, const Index& size, const Line& line) {
  const std::array<std::size_t, 3> strides = {1, static_cast<std::size_t>(size.x()),
                                              static_cast<std::size_t>(size.x()) * size.y()};
  for (int axis = 0; axis < 3; ++axis) {
    const int u = axis == 0 ? 1 : 0, w = axis == 2 ? 1 : 2;
    const std::size_t lines = static_cast<std::size_t>(size[u]) * size[w];
    parallel_for_each_index(lines, 256, [&](std::size_t l) {
      const std::size_t start = l % size[u] * strides[u] + l / size[u] * strides[w];
      line(values.data() + start, strides[axis], size[axis], axis);
    });
  }
}

// Distance of each voxel's centre to the nearest voxel of `inside`, which is a box and not a point:
// the squared distance is a sum over the axes, minimised one axis after the other.
std::vector<float> distance_to(const std::vector<char>& mask, char inside, const Index& size,
                               const Vec3& spacing, double far) {
  const auto far2 = static_cast<float>(far * far);
  std::vector<float> squared(mask.size());
  for (std::size_t v = 0; v < mask.size(); ++v) squared[v] = mask[v] == inside ? 0.0f : far2;
  along_axes(squared, size, [&](float* values, std::size_t stride, int length, int axis) {
    const int reach = static_cast<int>(std::ceil(far / spacing[axis])) + 1;
    std::vector<float> steps(reach + 1), line(length);
    for (int s = 0; s <= reach; ++s) {
      const double step = std::max(0.0, (s - 0.5) * spacing[axis]);
      steps[s] = static_cast<float>(step * step);
    }
    for (int i = 0; i < length; ++i) line[i] = values[i * stride];
    for (int i = 0; i < length; ++i) {
      float least = line[i];
      for (int s = 1; s <= reach && steps[s] < least; ++s) {
        if (i >= s) least = std::min(least, line[i - s] + steps[s]);
        if (i + s < length) least = std::min(least, line[i + s] + steps[s]);
      }
      values[i * stride] = least;
    }
  });
  for (float& value : squared) value = std::sqrt(std::min(value, far2));
  return squared;
}

void smooth(std::vector<float>& values, const Index& size, int passes) {
  for (int pass = 0; pass < passes; ++pass) {
    along_axes(values, size, [](float* line, std::size_t stride, int length, int) {
      float previous = line[0];
      for (int i = 0; i < length; ++i) {
        const float here = line[i * stride];
        const float next = i + 1 < length ? line[(i + 1) * stride] : here;
        line[i * stride] = 0.25f * previous + 0.5f * here + 0.25f * next;
        previous = here;
      }
    });
  }
}

// Zeros spread by this many voxels along each axis, diagonally as well.
void widen_zeros(std::vector<float>& values, const Index& size, int by) {
  along_axes(values, size, [by](float* line, std::size_t stride, int length, int) {
    std::vector<float> before(length);
    for (int i = 0; i < length; ++i) before[i] = line[i * stride];
    for (int i = 0; i < length; ++i) {
      for (int j = std::max(0, i - by); j <= std::min(length - 1, i + by); ++j) {
        line[i * stride] = std::min(line[i * stride], before[j]);
      }
    }
  });
}

// Fills what background can't reach from outside through faces; the number of voxels filled.
std::size_t fill_cavities(std::vector<char>& mask, const Index& size, std::size_t& first) {
  constexpr char kOutside = 2;
  std::vector<std::size_t> stack{0};  // a corner of the margin
  mask[0] = kOutside;
  while (!stack.empty()) {
    const std::size_t v = stack.back();
    stack.pop_back();
    for_neighbours(size, v, [&](std::size_t n) {
      if (mask[n] != 0) return;
      mask[n] = kOutside;
      stack.push_back(n);
    });
  }
  std::size_t filled = 0;
  for (std::size_t v = 0; v < mask.size(); ++v) {
    if (mask[v] == 0 && filled++ == 0) first = v;
    mask[v] = mask[v] == kOutside ? 0 : 1;
  }
  return filled;
}

}  // namespace

std::vector<LabelPiece> label_pieces(const LabelMap& map, std::int32_t label,
                                     const LabelExtent& extent) {
  const Index size = extent.last - extent.first + Index::Ones();
  std::vector<int> number(count_of(size), -1);
  const auto in_map = [&](std::size_t v) {
    const std::size_t x = size.x(), xy = x * size.y();
    return map.at(static_cast<int>(v % x) + extent.first.x(),
                  static_cast<int>(v / x % size.y()) + extent.first.y(),
                  static_cast<int>(v / xy) + extent.first.z());
  };
  std::vector<std::vector<std::size_t>> members;
  for (std::size_t seed = 0; seed < number.size(); ++seed) {
    if (number[seed] >= 0 || map.labels[in_map(seed)] != label) continue;
    const int piece = static_cast<int>(members.size());
    std::vector<std::size_t> voxels{seed};
    number[seed] = piece;
    for (std::size_t next = 0; next < voxels.size(); ++next) {
      for_neighbours(size, voxels[next], [&](std::size_t n) {
        if (number[n] >= 0 || map.labels[in_map(n)] != label) return;
        number[n] = piece;
        voxels.push_back(n);
      });
    }
    members.push_back(std::move(voxels));
  }
  std::stable_sort(members.begin(), members.end(),
                   [](const auto& a, const auto& b) { return a.size() > b.size(); });

  std::vector<LabelPiece> pieces;
  const Vec3 spacing = map.spacing();
  for (const std::vector<std::size_t>& voxels : members) {
    LabelPiece piece;
    piece.label = label;
    piece.voxels = voxels.size();
    Index low = size, high = -Index::Ones();
    const auto index_of = [&](std::size_t v) {
      const std::size_t x = size.x(), xy = x * size.y();
      return Index(static_cast<int>(v % x), static_cast<int>(v / x % size.y()),
                   static_cast<int>(v / xy));
    };
    for (const std::size_t v : voxels) {
      low = low.cwiseMin(index_of(v));
      high = high.cwiseMax(index_of(v));
    }
    for (int axis = 0; axis < 3; ++axis) {
      const int margin = margin_along(spacing, axis);
      piece.first[axis] = extent.first[axis] + low[axis] - margin;
      piece.size[axis] = high[axis] - low[axis] + 1 + 2 * margin;
      piece.at_border |= extent.first[axis] + low[axis] == 0 ||
                         extent.first[axis] + high[axis] == map.size[axis] - 1;
    }
    piece.mask.assign(count_of(piece.size), 0);
    for (const std::size_t v : voxels) {
      const Index i = index_of(v) + extent.first - piece.first;
      piece.mask[at(piece.size, i.x(), i.y(), i.z())] = 1;
    }
    std::size_t first = 0;
    piece.cavity_voxels = fill_cavities(piece.mask, piece.size, first);
    if (piece.cavity_voxels > 0) {
      const std::size_t x = piece.size.x(), xy = x * piece.size.y();
      piece.cavity = map.centre(
          (Index(static_cast<int>(first % x), static_cast<int>(first / x % piece.size.y()),
                 static_cast<int>(first / xy)) +
           piece.first)
              .cast<double>());
    }
    pieces.push_back(std::move(piece));
  }
  return pieces;
}

LabelField::LabelField(const LabelMap& map, const LabelPiece& piece, int smoothing,
                       const std::vector<std::int32_t>& imported)
    : to_index_(map.axes.inverse()),
      origin_(map.centre(piece.first.cast<double>())),
      axes_(map.axes),
      size_(piece.size),
      linear_(smoothing < 0) {
  const Vec3 spacing = map.spacing();
  far_ = kBand * spacing.maxCoeff();
  distance_ = distance_to(piece.mask, 1, size_, spacing, far_);
  const std::vector<float> depth = distance_to(piece.mask, 0, size_, spacing, far_);
  for (std::size_t v = 0; v < distance_.size(); ++v) distance_[v] -= depth[v];
  smooth(distance_, size_, smoothing);

  // One where the level acts, nought near voxels of other labels.
  std::vector<char> other(piece.mask.size(), 0);
  for (int k = 0; k < size_.z(); ++k) {
    for (int j = 0; j < size_.y(); ++j) {
      for (int i = 0; i < size_.x(); ++i) {
        const Index m = Index(i, j, k) + piece.first;
        if ((m.array() < 0).any() || (m.array() >= map.size.array()).any()) continue;
        const std::size_t v = at(size_, i, j, k);
        if (piece.mask[v]) continue;
        const std::int32_t label = map.labels[map.at(m.x(), m.y(), m.z())];
        other[v] = std::binary_search(imported.begin(), imported.end(), label);
      }
    }
  }
  greatest_level_ = spacing.maxCoeff();
  if (std::ranges::find(other, 1) == other.end()) {
    freedom_.assign(other.size(), 1.0f);
    adjustable_ = true;
  } else {
    // As the header derives: voxels that share an interpolation patch with one where the other
    // label's distance may be less than the greatest level.
    greatest_level_ = 0.49 * spacing.minCoeff();
    const int patch = linear_ ? 1 : 3;
    freedom_.assign(other.size(), 1.0f);
    for (std::size_t v = 0; v < other.size(); ++v) {
      if (other[v]) freedom_[v] = 0.0f;
    }
    widen_zeros(freedom_, size_, patch + std::max(0, smoothing));
    for (std::size_t v = 0; v < freedom_.size(); ++v) {
      adjustable_ |= freedom_[v] > 0.0f && std::abs(distance_[v]) < spacing.maxCoeff();
    }
  }
  values_ = distance_;
}

void LabelField::set_level(double level) {
  level = std::clamp(level, -greatest_level_, greatest_level_);
  for (std::size_t v = 0; v < values_.size(); ++v) {
    values_[v] = distance_[v] - static_cast<float>(level) * freedom_[v];
  }
}

double LabelField::operator()(const Vec3& x) const {
  const Vec3 index = to_index_ * (x - origin_);
  const int taps = linear_ ? 2 : 4;
  Index base;
  std::array<std::array<double, 4>, 3> weight;
  for (int axis = 0; axis < 3; ++axis) {
    const double whole = std::floor(index[axis]), t = index[axis] - whole;
    base[axis] = static_cast<int>(std::clamp(whole, -1e6, 1e6)) - (linear_ ? 0 : 1);
    if (base[axis] < 0 || base[axis] + taps > size_[axis]) return far_;
    if (linear_) {
      weight[axis] = {1.0 - t, t, 0.0, 0.0};
    } else {
      const double s = 1.0 - t;
      weight[axis] = {s * s * s / 6.0, (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0,
                      (4.0 - 6.0 * s * s + 3.0 * s * s * s) / 6.0, t * t * t / 6.0};
    }
  }
  double sum = 0.0;
  for (int c = 0; c < taps; ++c) {
    for (int b = 0; b < taps; ++b) {
      const float* line = values_.data() + at(size_, base.x(), base.y() + b, base.z() + c);
      double along = 0.0;
      for (int a = 0; a < taps; ++a) along += weight[0][a] * line[a];
      sum += weight[1][b] * weight[2][c] * along;
    }
  }
  return sum;
}

Box LabelField::box() const {
  Box box;
  for (int corner = 0; corner < 8; ++corner) {
    Vec3 index;
    for (int axis = 0; axis < 3; ++axis) index[axis] = corner >> axis & 1 ? size_[axis] - 3 : 2;
    box.extend(origin_ + axes_ * index);
  }
  return box;
}

}  // namespace viscera
