#include "kernels/smoke/moving_surface.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "kernels/base/hash.h"
#include "kernels/base/parallel.h"

namespace viscera {
namespace {

constexpr std::size_t kGroupChunk = 8;

std::size_t in_blocks(std::size_t count) {
  return (count + MovingSurface::kBlock - 1) / MovingSurface::kBlock;
}

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

  Hasher hasher;
  for (const Triangle& t : triangles_)
    for (const int v : t) hasher.value(v);
  signature_ = std::stoull(hasher.hex().substr(0, 16), nullptr, 16);
}

MovingSurface::Box3f MovingSurface::Placement::operator()(const Box3f& own) const {
  const Vec3f middle = (*this)(own.center());
  const Vec3f half = turn.cwiseAbs() * (0.5f * own.sizes());
  return Box3f(middle - half, middle + half);
}

bool MovingSurface::fits(const State& state) {
  const auto finite = [](const Vec3f& p) { return p.allFinite(); };
  const auto numbered = [&](int t) {
    return t >= 0 && static_cast<std::size_t>(t) < state.order.size();
  };
  return std::ranges::all_of(state.shape, finite) && state.place.turn.allFinite() &&
         state.place.shift.allFinite() && std::ranges::all_of(state.order, numbered) &&
         (!state.blocks_fit || (state.blocks.size() == in_blocks(state.order.size()) &&
                                state.groups.size() == in_blocks(state.blocks.size())));
}

void MovingSurface::restore(State state) {
  *this = MovingSurface();
  state_ = std::move(state);
}

bool MovingSurface::advance(const SmokeSurface& surface, const Vec3& origin) {
  if (!take_shape(surface)) return false;
  from_ = state_.place;
  state_.place = {surface.pose.orientation.toRotationMatrix().cast<float>(),
                  (surface.pose.position - origin).cast<float>()};
  if (!known_) from_ = state_.place;
  turns_ = from_.turn != state_.place.turn;
  measure();
  return true;
}

/// False where the positions aren't finite.
bool MovingSurface::take_shape(const SmokeSurface& surface) {
  topology_ = surface.topology;
  const std::size_t ordered = state_.order.size();
  const bool same = state_.topology == topology_->signature() &&
                    (ordered == 0 || ordered == topology_->triangles().size());
  known_ = same && state_.shape.size() == surface.positions.size();
  keeps_shape_ = known_ && surface.version != 0 && state_.version == surface.version;
  if (keeps_shape_) return true;
  if (!same) state_.order.clear();
  state_.topology = topology_->signature();
  state_.version = surface.version;
  state_.blocks_fit = normals_hold_ = false;
  std::swap(before_, state_.shape);
  state_.shape.assign(surface.positions.begin(), surface.positions.end());
  state_.bounds.setEmpty();
  bool finite = true;
  for (const Vec3f& p : state_.shape) {
    finite = finite && p.allFinite();
    state_.bounds.extend(p);
  }
  if (!finite) state_.shape.clear();
  if (!known_) keeps_shape_ = true;
  return finite;
}

void MovingSurface::measure() {
  // An affine motion is greatest at a corner of the box.
  way_ = 0.0f;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3f at = state_.bounds.corner(static_cast<Box3f::CornerType>(corner));
    way_ = std::max(way_, (state_.place(at) - from_(at)).norm());
  }
  Box3f started = state_.bounds;
  if (!keeps_shape_) {
    float most = 0.0f;
    for (std::size_t v = 0; v < state_.shape.size(); ++v) {
      started.extend(before_[v]);
      most = std::max(most, (state_.shape[v] - before_[v]).squaredNorm());
    }
    way_ += std::sqrt(most);
  }
  box_ = from_(started).merged(state_.place(state_.bounds));
}

void MovingSurface::fit_blocks() {
  if (state_.blocks_fit) return;
  const std::span<const SurfaceTopology::Triangle> triangles = topology_->triangles();
  if (state_.order.size() != triangles.size()) {
    std::vector<std::pair<std::uint32_t, int>> numbers(triangles.size());
    for (std::size_t t = 0; t < triangles.size(); ++t)
      numbers[t] = {near_number(state_.shape[triangles[t][0]], state_.bounds), static_cast<int>(t)};
    std::ranges::sort(numbers);
    state_.order.resize(triangles.size());
    std::ranges::transform(numbers, state_.order.begin(),
                           [](const auto& number) { return number.second; });
  }
  const std::vector<Vec3f>& first = start();
  state_.blocks.resize(in_blocks(state_.order.size()));
  state_.groups.resize(in_blocks(state_.blocks.size()));
  parallel_for_each_index(state_.groups.size(), kGroupChunk, [&](std::size_t g) {
    state_.groups[g].setEmpty();
    for (std::size_t b = g * kBlock; b < std::min((g + 1) * kBlock, state_.blocks.size()); ++b) {
      Box3f block;
      for (std::size_t i = b * kBlock; i < std::min((b + 1) * kBlock, state_.order.size()); ++i)
        for (const int v : triangles[state_.order[i]])
          block.extend(state_.shape[v]).extend(first[v]);
      state_.blocks[b] = block;
      state_.groups[g].extend(block);
    }
  });
  // Boxes of a step hold for one that keeps its shape, though a little wide.
  state_.blocks_fit = true;
}

std::size_t MovingSurface::memory_bytes() const {
  return (before_.capacity() + state_.shape.capacity() + normals_.capacity()) * sizeof(Vec3f) +
         state_.order.capacity() * sizeof(int) + found_.capacity() * sizeof(std::uint32_t) +
         (state_.blocks.capacity() + state_.groups.capacity()) * sizeof(Box3f);
}

MovingSurface::Moment::Moment(MovingSurface& surface, float fraction)
    : surface_(&surface),
      fraction_(fraction),
      turns_(surface.turns_),
      turn_(surface.state_.place.turn) {
  shift_ = surface.from_.shift + fraction * (surface.state_.place.shift - surface.from_.shift);
  const std::size_t vertices = surface.state_.shape.size();
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
  const Vec3f& now = surface_->state_.shape[vertex];
  if (turns_) {
    const Vec3f from = surface_->from_(surface_->start()[vertex]);
    return from + fraction_ * (surface_->state_.place(now) - from);
  }
  if (surface_->keeps_shape_) return now;
  const Vec3f& before = surface_->before_[vertex];
  return before + fraction_ * (now - before);
}

Vec3f MovingSurface::Moment::way(int vertex) const {
  if (surface_->keeps_shape_ && !turns_)
    return surface_->state_.place.shift - surface_->from_.shift;
  return surface_->state_.place(surface_->state_.shape[vertex]) -
         surface_->from_(surface_->start()[vertex]);
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
