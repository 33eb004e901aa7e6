#include "kernels/heat/brick_geometry.h"

#include <algorithm>
#include <bitset>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace viscera {
namespace {

constexpr int kEdge = BrickGeometry::kEdge;
constexpr int kRow = BrickGeometry::kRow;
constexpr float kLeastFraction = 0.1f;

int corner_of(int x, int y, int z) {
  return x + kRow * (y + kRow * z);
}

// Distances at the corners of voxels. Asking is dear, so blocks that the surface can't reach are
// given their middle's sign.
class Corners {
 public:
  Corners(const BrickIndex& brick, double voxel, const SignedDistance& distance)
      : first_(brick * kEdge), voxel_(voxel), distance_(distance) {
    values_.fill(std::numeric_limits<double>::quiet_NaN());
    fill_block(0, 0, 0, kEdge);
    for (const double value : values_) {
      any_inside_ = any_inside_ || value < 0.0;
      any_outside_ = any_outside_ || value >= 0.0;
    }
  }

  double at(int x, int y, int z) const { return values_[corner_of(x, y, z)]; }
  bool any_inside() const { return any_inside_; }
  bool any_outside() const { return any_outside_; }

 private:
  // The distance at a corner, asked once.
  double ask(int x, int y, int z) {
    const auto at = static_cast<std::size_t>(corner_of(x, y, z));
    if (!asked_[at])
      values_[at] = distance_((first_ + BrickIndex(x, y, z)).cast<double>() * voxel_);
    asked_[at] = true;
    return values_[at];
  }

  void fill_block(int x, int y, int z, int edge) {
    if (edge > 1) {
      const int half = edge / 2;
      const double middle = ask(x + half, y + half, z + half);
      if (std::abs(middle) > 1.01 * std::numbers::sqrt3 * half * voxel_) {
        for_corners(x, y, z, edge, [&](int at) {
          if (std::isnan(values_[at])) values_[at] = middle;
        });
        return;
      }
      for (int child = 0; child < 8; ++child)
        fill_block(x + half * (child & 1), y + half * (child >> 1 & 1), z + half * (child >> 2),
                   half);
      return;
    }
    // A value filled in from a middle has the right sign but not the distance.
    for (int corner = 0; corner < 8; ++corner)
      ask(x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2));
  }

  template <class Body>
  static void for_corners(int x, int y, int z, int edge, const Body& body) {
    for (int k = z; k <= z + edge; ++k)
      for (int j = y; j <= y + edge; ++j)
        for (int i = x; i <= x + edge; ++i) body(corner_of(i, j, k));
  }

  BrickIndex first_;
  double voxel_;
  const SignedDistance& distance_;
  std::array<double, kRow * kRow * kRow> values_;
  std::bitset<kRow * kRow * kRow> asked_;
  bool any_inside_ = false, any_outside_ = false;
};

// Area of a unit square where a function with these values at its corners, in order around it, is
// negative: the polygon through the crossings of its edges.
double open_share(const std::array<double, 4>& value) {
  static constexpr double kX[] = {0, 1, 1, 0}, kY[] = {0, 0, 1, 1};
  double px[8], py[8];
  int count = 0;
  for (int c = 0; c < 4; ++c) {
    const int next = (c + 1) % 4;
    if (value[c] < 0.0) {
      px[count] = kX[c];
      py[count++] = kY[c];
    }
    if ((value[c] < 0.0) != (value[next] < 0.0)) {
      const double t = value[c] / (value[c] - value[next]);
      px[count] = kX[c] + t * (kX[next] - kX[c]);
      py[count++] = kY[c] + t * (kY[next] - kY[c]);
    }
  }
  double twice = 0.0;
  for (int i = 0; i < count; ++i) {
    const int next = (i + 1) % count;
    twice += px[i] * py[next] - px[next] * py[i];
  }
  return std::clamp(0.5 * twice, 0.0, 1.0);
}

// Volume of a unit cube where the trilinear function of its corners is negative: the areas of
// slices through it, by Gauss's rule, across the axis along which it changes least, so that they
// vary smoothly.
double filled_share(const std::array<double, 8>& value) {
  constexpr double kPoint[] = {0.1127016654, 0.5, 0.8872983346};
  constexpr double kWeight[] = {5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0};
  int across = 0;
  double least = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    double change = 0.0;
    for (int c = 0; c < 8; ++c) change += (c >> axis & 1 ? 1.0 : -1.0) * value[c];
    if (std::abs(change) < least) {
      least = std::abs(change);
      across = axis;
    }
  }
  const int up = 1 << across, p = 1 << (across + 1) % 3, q = 1 << (across + 2) % 3;
  double volume = 0.0;
  for (int s = 0; s < 3; ++s) {
    const auto between = [&](int low) {
      return value[low] + kPoint[s] * (value[low + up] - value[low]);
    };
    volume += kWeight[s] * open_share({between(0), between(p), between(p + q), between(q)});
  }
  return volume;
}

}  // namespace

const std::shared_ptr<const BrickGeometry>& BrickGeometry::whole() {
  static const std::shared_ptr<const BrickGeometry> whole = [] {
    auto made = std::make_shared<BrickGeometry>();
    made->fraction.fill(1.0f);
    made->open_x.fill(1.0f);
    made->open_y.fill(1.0f);
    made->open_z.fill(1.0f);
    return made;
  }();
  return whole;
}

const std::shared_ptr<const BrickGeometry>& BrickGeometry::whole_cut_off() {
  static const std::shared_ptr<const BrickGeometry> cut_off = [] {
    auto made = std::make_shared<BrickGeometry>(*whole());
    made->perfused.assign(BrickField::kVoxels, 0.0f);
    return made;
  }();
  return cut_off;
}

std::size_t BrickGeometry::memory_bytes() const {
  if (this == whole().get() || this == whole_cut_off().get()) return 0;
  return sizeof(BrickGeometry) + surface.capacity() * sizeof(Surface) +
         perfused.capacity() * sizeof(float);
}

std::shared_ptr<const BrickGeometry> with_blood(
    const std::shared_ptr<const BrickGeometry>& geometry, std::vector<float> perfused) {
  assert(perfused.empty() || perfused.size() == BrickField::kVoxels);
  auto made = std::make_shared<BrickGeometry>(*geometry);
  made->perfused = std::move(perfused);
  return made;
}

std::shared_ptr<const BrickGeometry> without_blood(
    const std::shared_ptr<const BrickGeometry>& geometry) {
  if (geometry->empty) return geometry;
  if (geometry == BrickGeometry::whole()) return BrickGeometry::whole_cut_off();
  return with_blood(geometry, std::vector<float>(BrickField::kVoxels, 0.0f));
}

std::shared_ptr<const BrickGeometry> make_geometry(const BrickIndex& brick, double voxel,
                                                   const SignedDistance& distance) {
  if (!distance) return BrickGeometry::whole();
  const Corners corners(brick, voxel, distance);
  if (!corners.any_outside()) return BrickGeometry::whole();
  auto made = std::make_shared<BrickGeometry>();
  if (!corners.any_inside()) {
    made->fraction.fill(0.0f);
    made->open_x.fill(0.0f);
    made->open_y.fill(0.0f);
    made->open_z.fill(0.0f);
    made->empty = true;
    return made;
  }
  for (int z = 0; z < kRow; ++z) {
    for (int y = 0; y < kRow; ++y) {
      for (int x = 0; x < kRow; ++x) {
        const auto share = [&](int ax, int ay, int az, int bx, int by, int bz) {
          return static_cast<float>(
              open_share({corners.at(x, y, z), corners.at(x + ax, y + ay, z + az),
                          corners.at(x + ax + bx, y + ay + by, z + az + bz),
                          corners.at(x + bx, y + by, z + bz)}));
        };
        if (y < kEdge && z < kEdge)
          made->open_x[x + kRow * (y + kEdge * z)] = share(0, 1, 0, 0, 0, 1);
        if (x < kEdge && z < kEdge)
          made->open_y[x + kEdge * (y + kRow * z)] = share(1, 0, 0, 0, 0, 1);
        if (x < kEdge && y < kEdge)
          made->open_z[x + kEdge * (y + kEdge * z)] = share(1, 0, 0, 0, 1, 0);
      }
    }
  }
  for (int z = 0; z < kEdge; ++z) {
    for (int y = 0; y < kEdge; ++y) {
      for (int x = 0; x < kEdge; ++x) {
        std::array<double, 8> value;
        int inside = 0;
        for (int c = 0; c < 8; ++c) {
          value[c] = corners.at(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2));
          inside += value[c] < 0.0;
        }
        const int at = x + kEdge * (y + kEdge * z);
        if (inside == 0 || inside == 8) {
          made->fraction[at] = inside ? 1.0f : 0.0f;
          continue;
        }
        made->fraction[at] = std::max(kLeastFraction, static_cast<float>(filled_share(value)));
        const int fx = x + kRow * (y + kEdge * z), fy = x + kEdge * (y + kRow * z), fz = at;
        const Vec3f unbalanced(made->open_x[fx + 1] - made->open_x[fx],
                               made->open_y[fy + kEdge] - made->open_y[fy],
                               made->open_z[fz + kEdge * kEdge] - made->open_z[fz]);
        if (unbalanced.norm() > 0.0f) made->surface.push_back({at, unbalanced.norm()});
      }
    }
  }
  return made;
}

}  // namespace viscera
