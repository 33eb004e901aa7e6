#include "kernels/smoke/surface_cells.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "kernels/smoke/bin.h"

namespace viscera {
namespace {

using Box3f = Eigen::AlignedBox3f;

/// Triangles of a block: few enough that one is small, enough that boxes are few.
constexpr std::size_t kBlock = 16;

/// A number that is near for places that are near: bits of ten each axis, in turns.
std::uint32_t near_number(const Vec3f& place, const Box3f& box) {
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

class SurfaceCells::Placed {
 public:
  Placed(SurfaceCells& cells, const Tracked& surface, float fraction)
      : cells_(cells), surface_(surface), fraction_(fraction) {
    const std::size_t vertices = surface.now.size();
    if (cells.corners_.size() < vertices) {
      cells.corners_.resize(vertices);
      cells.normals_.resize(vertices);
      cells.placed_.resize(vertices, cells.round_);
      cells.turned_.resize(vertices, cells.round_);
    }
    ++cells.round_;
  }

  const Vec3f& corner(int vertex) {
    Vec3f& at = cells_.corners_[vertex];
    if (std::exchange(cells_.placed_[vertex], cells_.round_) != cells_.round_) {
      const Vec3f from = surface_.from(surface_.start()[vertex]);
      at = from + fraction_ * (surface_.to(surface_.now[vertex]) - from);
    }
    return at;
  }
  Vec3f way(int vertex) const {
    return surface_.to(surface_.now[vertex]) - surface_.from(surface_.start()[vertex]);
  }
  Vec3f face_normal(int triangle) {
    const SurfaceTopology::Triangle& t = surface_.topology->triangles()[triangle];
    const Vec3f a = corner(t[0]), b = corner(t[1]), c = corner(t[2]);
    const Vec3f normal = (b - a).cross(c - a);
    const float length = normal.norm();
    return length > 0.0f ? Vec3f(normal / length) : Vec3f(Vec3f::Zero());
  }
  /// Angle-weighted [Baerentzen2005].
  const Vec3f& corner_normal(int vertex) {
    Vec3f& sum = cells_.normals_[vertex];
    if (std::exchange(cells_.turned_[vertex], cells_.round_) == cells_.round_) return sum;
    sum.setZero();
    const Vec3f at = corner(vertex);
    for (const int triangle : surface_.topology->around(vertex)) {
      const SurfaceTopology::Triangle& t = surface_.topology->triangles()[triangle];
      const int own = t[0] == vertex ? 0 : t[1] == vertex ? 1 : 2;
      const Vec3f a = corner(t[(own + 1) % 3]) - at;
      const Vec3f b = corner(t[(own + 2) % 3]) - at;
      sum += std::atan2(a.cross(b).norm(), a.dot(b)) * face_normal(triangle);
    }
    return sum;
  }

 private:
  SurfaceCells& cells_;
  const Tracked& surface_;
  float fraction_;
};

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

Box3f SurfaceCells::Placement::operator()(const Box3f& own) const {
  const Vec3f middle = (*this)(own.center());
  const Vec3f half = turn.cwiseAbs() * (0.5f * own.sizes());
  return Box3f(middle - half, middle + half);
}

/// False where the positions aren't finite.
bool SurfaceCells::Tracked::take_shape(const SmokeSurface& surface) {
  known = topology == surface.topology && now.size() == surface.positions.size();
  keeps_shape = known && surface.version != 0 && version == surface.version;
  if (keeps_shape) return true;
  if (topology != surface.topology) order.clear();
  topology = surface.topology;
  version = surface.version;
  blocks_fit = false;
  std::swap(before, now);
  now.assign(surface.positions.begin(), surface.positions.end());
  own_box.setEmpty();
  bool finite = true;
  for (const Vec3f& p : now) {
    finite = finite && p.allFinite();
    own_box.extend(p);
  }
  if (!finite) now.clear();
  if (!known) keeps_shape = true;
  return finite;
}

void SurfaceCells::Tracked::measure() {
  // An affine motion is greatest at a corner of the box.
  way = 0.0f;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3f at = own_box.corner(static_cast<Box3f::CornerType>(corner));
    way = std::max(way, (to(at) - from(at)).norm());
  }
  Box3f started = own_box;
  if (!keeps_shape) {
    float most = 0.0f;
    for (std::size_t v = 0; v < now.size(); ++v) {
      started.extend(before[v]);
      most = std::max(most, (now[v] - before[v]).squaredNorm());
    }
    way += std::sqrt(most);
  }
  box = from(started).merged(to(own_box));
}

void SurfaceCells::Tracked::fit_blocks() {
  if (blocks_fit) return;
  const std::span<const SurfaceTopology::Triangle> triangles = topology->triangles();
  if (order.size() != triangles.size()) {
    std::vector<std::pair<std::uint32_t, int>> numbers(triangles.size());
    for (std::size_t t = 0; t < triangles.size(); ++t)
      numbers[t] = {near_number(now[triangles[t][0]], own_box), static_cast<int>(t)};
    std::ranges::sort(numbers);
    order.resize(triangles.size());
    std::ranges::transform(numbers, order.begin(),
                           [](const auto& number) { return number.second; });
  }
  const std::vector<Vec3f>& first = start();
  blocks.assign((order.size() + kBlock - 1) / kBlock, Box3f());
  for (std::size_t i = 0; i < order.size(); ++i)
    for (const int v : triangles[order[i]]) blocks[i / kBlock].extend(now[v]).extend(first[v]);
  // Boxes of a step hold for one that keeps its shape, though a little wide.
  blocks_fit = true;
}

void SurfaceCells::advance(std::span<const SmokeSurface> surfaces, const Vec3& origin) {
  order_.clear();
  for (auto& [id, tracked] : tracked_) tracked.present = false;
  for (const SmokeSurface& surface : surfaces) {
    if (surface.positions.size() < surface.topology->vertices()) continue;
    Tracked& tracked = tracked_[surface.id];
    if (!tracked.take_shape(surface)) continue;
    tracked.from = tracked.to;
    tracked.to = {surface.pose.orientation.toRotationMatrix().cast<float>(),
                  (surface.pose.position - origin).cast<float>()};
    if (!tracked.known) tracked.from = tracked.to;
    tracked.measure();
    tracked.present = true;
    order_.push_back(surface.id);
  }
  std::erase_if(tracked_, [](const auto& entry) { return !entry.second.present; });
}

float SurfaceCells::greatest_way(const Box3f& box) const {
  float way = 0.0f;
  for (const auto& [id, tracked] : tracked_)
    if (tracked.box.intersects(box)) way = std::max(way, tracked.way);
  return way;
}

void SurfaceCells::build(std::span<const Float4> positions, double fraction, double dt, float cell,
                         float margin, std::span<const SmokeCapsule> capsules) {
  const BinParameters grid = bin_grid(positions, cell);
  std::vector<std::uint8_t> occupied = std::move(occupied_);
  occupied.assign(static_cast<std::size_t>(grid.size.w), 0);
  for (const Float4& at : positions) occupied[cell_number(grid, cell_of(grid, at))] = 1;
  build(grid, std::move(occupied), fraction, dt, margin, capsules);
}

void SurfaceCells::build(const BinParameters& grid, std::vector<std::uint8_t> occupied,
                         double fraction, double dt, float margin,
                         std::span<const SmokeCapsule> capsules) {
  grid_ = grid;
  occupied_ = std::move(occupied);
  const auto cells = static_cast<std::size_t>(grid_.size.w);
  // The box of the cells with particles, less the margin of empty ones.
  const Vec3f edge = Vec3f::Constant(1.0f / grid_.inverse_cell);
  particles_ =
      Box3f(grid_.origin.xyz() + edge,
            grid_.origin.xyz() +
                edge.cwiseProduct(Vec3f(grid_.size.x - 1, grid_.size.y - 1, grid_.size.z - 1)));
  found_.clear();
  triangles_.clear();
  any_capsule_ = false;
  cell_begin_.assign(cells + 1, 0);
  capsules_near_.assign(cells, 0);
  entries_.clear();
  if (grid_.particles == 0) return;

  for (std::size_t s = 0; s < order_.size(); ++s) {
    bin_surface(tracked_.at(order_[s]), static_cast<float>(s), fraction, dt, margin);
  }
  bin_capsules(capsules, margin);

  for (const Entry& entry : found_) ++cell_begin_[entry.cell + 1];
  for (std::size_t c = 1; c <= cells; ++c) cell_begin_[c] += cell_begin_[c - 1];
  entries_.resize(found_.size());
  for (const Entry& entry : found_) entries_[cell_begin_[entry.cell]++] = entry.triangle;
  std::copy_backward(cell_begin_.begin(), cell_begin_.end() - 1, cell_begin_.end());
  cell_begin_.front() = 0;
}

bool SurfaceCells::any_occupied(const Box3f& box) const {
  const Int4 low = cell_of(grid_, Float4::from(box.min()));
  const Int4 high = cell_of(grid_, Float4::from(box.max()));
  for (int z = low.z; z <= high.z; ++z)
    for (int y = low.y; y <= high.y; ++y)
      for (int x = low.x; x <= high.x; ++x)
        if (occupied_[cell_number(grid_, {x, y, z, 0})]) return true;
  return false;
}

/// Calls visit(cell, its centre) for the cells with particles that the box meets.
template <class Visit>
void SurfaceCells::for_each_occupied(const Box3f& box, const Visit& visit) const {
  const Int4 low = cell_of(grid_, Float4::from(box.min()));
  const Int4 high = cell_of(grid_, Float4::from(box.max()));
  for (int z = low.z; z <= high.z; ++z)
    for (int y = low.y; y <= high.y; ++y)
      for (int x = low.x; x <= high.x; ++x) {
        const std::uint32_t cell = cell_number(grid_, {x, y, z, 0});
        if (occupied_[cell])
          visit(cell, Vec3f(grid_.origin.xyz() +
                            Vec3f(x + 0.5f, y + 0.5f, z + 0.5f) / grid_.inverse_cell));
      }
}

void SurfaceCells::bin_surface(Tracked& surface, float number, double fraction, double dt,
                               float margin) {
  const Vec3f reach = Vec3f::Constant(margin);
  const Box3f near(particles_.min() - reach, particles_.max() + reach);
  if (!near.intersects(surface.box)) return;
  const SurfaceTopology& topology = *surface.topology;
  Placed placed(*this, surface, static_cast<float>(fraction));
  const float inverse_dt = dt > 0.0 ? static_cast<float>(1.0 / dt) : 0.0f;
  const float half_diagonal = 0.5f * std::sqrt(3.0f) / grid_.inverse_cell;

  surface.fit_blocks();
  near_.clear();
  for (std::size_t block = 0; block < surface.blocks.size(); ++block) {
    Box3f box = surface.from(surface.blocks[block]).merged(surface.to(surface.blocks[block]));
    box.min() -= reach;
    box.max() += reach;
    if (!particles_.intersects(box) || !any_occupied(box)) continue;
    const std::size_t first = block * kBlock;
    near_.insert(near_.end(), surface.order.begin() + static_cast<std::ptrdiff_t>(first),
                 surface.order.begin() +
                     static_cast<std::ptrdiff_t>(std::min(first + kBlock, surface.order.size())));
  }
  std::ranges::sort(near_);  // ties among the nearest go to the first

  for (const int t : near_) {
    const SurfaceTopology::Triangle& vertices = topology.triangles()[t];
    const Vec3f a = placed.corner(vertices[0]), b = placed.corner(vertices[1]),
                c = placed.corner(vertices[2]);
    const Box3f box(a.cwiseMin(b).cwiseMin(c) - reach, a.cwiseMax(b).cwiseMax(c) + reach);
    if (!particles_.intersects(box)) continue;
    const Vec3f normal = placed.face_normal(t);
    const auto triangle = static_cast<std::uint32_t>(triangles_.size());
    bool used = false;
    for_each_occupied(box, [&](std::uint32_t cell, const Vec3f& centre) {
      if (std::abs(normal.dot(centre - a)) > half_diagonal + margin) return;
      found_.push_back({cell, triangle});
      used = true;
    });
    if (!used) continue;
    SurfaceTriangle near_triangle;
    const Vec3f mean = (a + b + c) / 3.0f;
    const float radius = std::sqrt(
        std::max({(a - mean).squaredNorm(), (b - mean).squaredNorm(), (c - mean).squaredNorm()}));
    near_triangle.normals[0] = Float4::from(normal);
    for (int e = 0; e < 3; ++e) {
      const int v = vertices[e];
      near_triangle.corners[e] = Float4::from(placed.corner(v), e == 0   ? number
                                                                : e == 1 ? radius
                                                                         : 0.0f);
      near_triangle.motion[e] = Float4::from(inverse_dt * placed.way(v));
      const int beyond = topology.beyond(static_cast<std::size_t>(t), e);
      const Vec3f other = beyond < 0 ? normal : placed.face_normal(beyond);
      near_triangle.normals[1 + e] = Float4::from(normal + other);
      near_triangle.normals[4 + e] = Float4::from(placed.corner_normal(v));
    }
    triangles_.push_back(near_triangle);
  }
}

void SurfaceCells::bin_capsules(std::span<const SmokeCapsule> capsules, float margin) {
  const float half_diagonal = 0.5f * std::sqrt(3.0f) / grid_.inverse_cell;
  for (std::size_t c = 0; c < std::min<std::size_t>(capsules.size(), 32); ++c) {
    const Vec3f from = capsules[c].from.xyz(), way = capsules[c].to.xyz() - from;
    const float far = capsules[c].from.w + margin + half_diagonal;
    const Vec3f reach = Vec3f::Constant(far);
    const Vec3f to = from + way;
    const Box3f box(from.cwiseMin(to) - reach, from.cwiseMax(to) + reach);
    if (!box.intersects(particles_)) continue;
    const float square = way.squaredNorm();
    for_each_occupied(box, [&](std::uint32_t cell, const Vec3f& centre) {
      const float at =
          square > 0.0f ? std::clamp(way.dot(centre - from) / square, 0.0f, 1.0f) : 0.0f;
      if ((centre - from - at * way).norm() > far) return;
      capsules_near_[cell] |= 1u << c;
      any_capsule_ = true;
    });
  }
}

std::size_t SurfaceCells::memory_bytes() const {
  std::size_t bytes = occupied_.capacity() + found_.capacity() * sizeof(Entry) +
                      (cell_begin_.capacity() + entries_.capacity() + capsules_near_.capacity()) *
                          sizeof(std::uint32_t) +
                      triangles_.capacity() * sizeof(SurfaceTriangle);
  for (const auto& [id, tracked] : tracked_)
    bytes += (tracked.before.capacity() + tracked.now.capacity()) * sizeof(Vec3f) +
             tracked.order.capacity() * sizeof(int) + tracked.blocks.capacity() * sizeof(Box3f);
  return bytes;
}

}  // namespace viscera
