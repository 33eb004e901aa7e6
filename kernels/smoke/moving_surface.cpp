#include "kernels/smoke/moving_surface.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "kernels/base/parallel.h"

namespace viscera {
namespace {

constexpr std::size_t kGroupChunk = 8;

/// A number that is near for places that are near: bits of ten each axis, in turns.
std::uint32_t near_number(const Vec3f& place, const Eigen::AlignedBox3f& box) {
  const Vec3f sizes = box.sizes().cwiseMax(1e-9f);
  std::uint32_t number = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const float share = (place[axis] - box.min()[axis]) / sizes[axis];
    const auto step = static_cast<std::uint32_t>(std::clamp(share, 0.0f, 1.0f) * 1023.0f);
    for (int bit = 0; bit < 10; ++bit) number |= (step >> bit & 1u) << (3 * bit + axis);
  }
  return number;
}

}  // namespace

SurfaceTopology::SurfaceTopology(std::vector<Triangle> triangles)
    : triangles_(std::move(triangles)) {
  int last = -1;
  for (const Triangle& t : triangles_) last = std::max(last, t.maxCoeff());
  fan_begin_.assign(static_cast<std::size_t>(last) + 2, 0);
  for (const Triangle& t : triangles_)
    for (const int v : t) ++fan_begin_[v + 1];
  for (std::size_t v = 1; v < fan_begin_.size(); ++v) fan_begin_[v] += fan_begin_[v - 1];
  fans_.resize(3 * triangles_.size());
  std::vector<std::size_t> next(fan_begin_.begin(), fan_begin_.end() - 1);
  for (std::size_t t = 0; t < triangles_.size(); ++t)
    for (const int v : triangles_[t]) fans_[next[v]++] = static_cast<int>(t);

  beyond_.resize(triangles_.size());
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    for (int e = 0; e < 3; ++e) {
      const int from = triangles_[t][e], to = triangles_[t][(e + 1) % 3];
      beyond_[t][e] = -1;
      for (const int other : around(from)) {
        const Triangle& o = triangles_[other];
        for (int f = 0; f < 3; ++f)
          if (o[f] == to && o[(f + 1) % 3] == from) beyond_[t][e] = other;
      }
    }
  }
}

MovingSurface::Box3f MovingSurface::Placement::operator()(const Box3f& own) const {
  const Vec3f middle = (*this)(own.center());
  const Vec3f half = turn.cwiseAbs() * (0.5f * own.sizes());
  return Box3f(middle - half, middle + half);
}

bool MovingSurface::advance(const SmokeSurface& surface, const Vec3& origin) {
  if (!take_shape(surface)) return false;
  from_ = to_;
  to_ = {surface.pose.orientation.toRotationMatrix().cast<float>(),
         (surface.pose.position - origin).cast<float>()};
  if (!known_) from_ = to_;
  turns_ = from_.turn != to_.turn;
  measure();
  return true;
}

/// False where the positions aren't finite.
bool MovingSurface::take_shape(const SmokeSurface& surface) {
  known_ = topology_ == surface.topology && now_.size() == surface.positions.size();
  keeps_shape_ = known_ && surface.version != 0 && version_ == surface.version;
  if (keeps_shape_) return true;
  if (topology_ != surface.topology) order_.clear();
  topology_ = surface.topology;
  version_ = surface.version;
  blocks_fit_ = normals_hold_ = false;
  std::swap(before_, now_);
  now_.assign(surface.positions.begin(), surface.positions.end());
  own_box_.setEmpty();
  bool finite = true;
  for (const Vec3f& p : now_) {
    finite = finite && p.allFinite();
    own_box_.extend(p);
  }
  if (!finite) now_.clear();
  if (!known_) keeps_shape_ = true;
  return finite;
}

void MovingSurface::measure() {
  // An affine motion is greatest at a corner of the box.
  way_ = 0.0f;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3f at = own_box_.corner(static_cast<Box3f::CornerType>(corner));
    way_ = std::max(way_, (to_(at) - from_(at)).norm());
  }
  Box3f started = own_box_;
  if (!keeps_shape_) {
    float most = 0.0f;
    for (std::size_t v = 0; v < now_.size(); ++v) {
      started.extend(before_[v]);
      most = std::max(most, (now_[v] - before_[v]).squaredNorm());
    }
    way_ += std::sqrt(most);
  }
  box_ = from_(started).merged(to_(own_box_));
}

void MovingSurface::fit_blocks() {
  if (blocks_fit_) return;
  const std::span<const SurfaceTopology::Triangle> triangles = topology_->triangles();
  if (order_.size() != triangles.size()) {
    std::vector<std::pair<std::uint32_t, int>> numbers(triangles.size());
    for (std::size_t t = 0; t < triangles.size(); ++t)
      numbers[t] = {near_number(now_[triangles[t][0]], own_box_), static_cast<int>(t)};
    std::ranges::sort(numbers);
    order_.resize(triangles.size());
    std::ranges::transform(numbers, order_.begin(),
                           [](const auto& number) { return number.second; });
  }
  const std::vector<Vec3f>& first = start();
  blocks_.resize((order_.size() + kBlock - 1) / kBlock);
  groups_.resize((blocks_.size() + kBlock - 1) / kBlock);
  parallel_for_each_index(groups_.size(), kGroupChunk, [&](std::size_t g) {
    groups_[g].setEmpty();
    for (std::size_t b = g * kBlock; b < std::min((g + 1) * kBlock, blocks_.size()); ++b) {
      Box3f block;
      for (std::size_t i = b * kBlock; i < std::min((b + 1) * kBlock, order_.size()); ++i)
        for (const int v : triangles[order_[i]]) block.extend(now_[v]).extend(first[v]);
      blocks_[b] = block;
      groups_[g].extend(block);
    }
  });
  // Boxes of a step hold for one that keeps its shape, though a little wide.
  blocks_fit_ = true;
}

std::size_t MovingSurface::memory_bytes() const {
  return (before_.capacity() + now_.capacity() + normals_.capacity()) * sizeof(Vec3f) +
         order_.capacity() * sizeof(int) + found_.capacity() * sizeof(std::uint32_t) +
         (blocks_.capacity() + groups_.capacity()) * sizeof(Box3f);
}

MovingSurface::Moment::Moment(MovingSurface& surface, float fraction)
    : surface_(&surface), fraction_(fraction), turns_(surface.turns_), turn_(surface.to_.turn) {
  shift_ = surface.from_.shift + fraction * (surface.to_.shift - surface.from_.shift);
  const std::size_t vertices = surface.now_.size();
  if (surface.normals_.size() != vertices) {
    surface.normals_.resize(vertices);
    surface.found_.assign(vertices, 0);
    surface.round_ = 0;
    surface.normals_hold_ = false;
  }
  const bool of_now = surface.keeps_shape_ && !turns_;
  if (!(of_now && surface.normals_hold_)) ++surface.round_;
  surface.normals_hold_ = of_now;
}

Vec3f MovingSurface::Moment::own(int vertex) const {
  const Vec3f& now = surface_->now_[vertex];
  if (turns_) {
    const Vec3f from = surface_->from_(surface_->start()[vertex]);
    return from + fraction_ * (surface_->to_(now) - from);
  }
  if (surface_->keeps_shape_) return now;
  const Vec3f& before = surface_->before_[vertex];
  return before + fraction_ * (now - before);
}

Vec3f MovingSurface::Moment::way(int vertex) const {
  if (surface_->keeps_shape_ && !turns_) return surface_->to_.shift - surface_->from_.shift;
  return surface_->to_(surface_->now_[vertex]) - surface_->from_(surface_->start()[vertex]);
}

Vec3f MovingSurface::Moment::own_face_normal(int triangle) const {
  const SurfaceTopology::Triangle& t = surface_->topology_->triangles()[triangle];
  const Vec3f a = own(t[0]), b = own(t[1]), c = own(t[2]);
  const Vec3f normal = (b - a).cross(c - a);
  const float length = normal.norm();
  return length > 0.0f ? Vec3f(normal / length) : Vec3f(Vec3f::Zero());
}

bool MovingSurface::Moment::lacks_normal(int vertex) {
  return std::exchange(surface_->found_[vertex], surface_->round_) != surface_->round_;
}

void MovingSurface::Moment::find_normal(int vertex) {
  Vec3f sum = Vec3f::Zero();
  const Vec3f at = own(vertex);
  for (const int triangle : surface_->topology_->around(vertex)) {
    const SurfaceTopology::Triangle& t = surface_->topology_->triangles()[triangle];
    const int corner = t[0] == vertex ? 0 : t[1] == vertex ? 1 : 2;
    const Vec3f a = own(t[(corner + 1) % 3]) - at;
    const Vec3f b = own(t[(corner + 2) % 3]) - at;
    const Vec3f normal = a.cross(b);
    const float length = normal.norm();
    if (length > 0.0f) sum += std::atan2(length, a.dot(b)) / length * normal;
  }
  surface_->normals_[vertex] = sum;
}

}  // namespace viscera
