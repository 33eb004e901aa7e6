#include "kernels/smoke/surface_cells.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

#include "kernels/base/parallel.h"
#include "kernels/smoke/bin.h"

namespace viscera {
namespace {

using Box3f = Eigen::AlignedBox3f;

constexpr std::size_t kGroupChunk = 2;
constexpr std::size_t kVertexChunk = 256;

}  // namespace

bool SurfaceCells::fits(const State& state) {
  return std::ranges::all_of(state.surfaces, [](const Tracked& tracked) {
    return MovingSurface::fits(tracked.surface.state());
  });
}

void SurfaceCells::restore(State state) {
  *this = SurfaceCells();
  state_ = std::move(state);
}

void SurfaceCells::advance(std::span<const SmokeSurface> surfaces, const Vec3& origin) {
  std::vector<Tracked> before = std::exchange(state_.surfaces, {});
  state_.surfaces.reserve(surfaces.size());
  for (const SmokeSurface& surface : surfaces) {
    if (surface.positions.size() < surface.topology->vertices()) continue;
    const auto known = std::ranges::find(before, surface.id, &Tracked::id);
    Tracked tracked{.id = surface.id, .surface = {}};
    if (known != before.end()) tracked.surface = std::move(known->surface);
    if (tracked.surface.advance(surface, origin)) state_.surfaces.push_back(std::move(tracked));
  }
}

float SurfaceCells::greatest_way(const Box3f& box) const {
  float way = 0.0f;
  for (const Tracked& tracked : state_.surfaces)
    if (tracked.surface.box().intersects(box)) way = std::max(way, tracked.surface.way());
  return way;
}

std::uint32_t pace_of(float square, float fastest_square) {
  std::uint32_t pace = 0;
  for (float limit = fastest_square / (kPaceRatio * kPaceRatio);
       pace + 1 < kPaces && square <= limit; limit /= kPaceRatio * kPaceRatio)
    ++pace;
  return pace;
}

void SurfaceCells::build(std::span<const Float4> positions, std::span<const Float4> velocities,
                         double fraction, double dt, float cell, const SurfaceReach& reach,
                         std::span<const SmokeCapsule> capsules) {
  take_grid(bin_grid(positions, cell));
  float fastest = 0.0f;
  for (const Float4& v : velocities) fastest = std::max(fastest, v.xyz().squaredNorm());
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const Int4 c = cell_of(grid_, positions[i]);
    occupy(pace_of(velocities[i].xyz().squaredNorm(), fastest), static_cast<std::uint32_t>(c.x),
           static_cast<std::uint32_t>(c.y), static_cast<std::uint32_t>(c.z));
  }
  set_reach(std::sqrt(fastest), reach);
  bin_all(fraction, dt, capsules);
}

void SurfaceCells::build(const BinParameters& grid, std::span<const std::uint32_t> cells_of_pace,
                         float fastest, double fraction, double dt, const SurfaceReach& reach,
                         std::span<const SmokeCapsule> capsules) {
  take_grid(grid);
  const auto length = static_cast<std::uint32_t>(grid.size.x);
  const auto width = static_cast<std::uint32_t>(grid.size.y);
  const std::size_t words = cells_of_pace.size() / kPaces;
  for (std::uint32_t pace = 0; pace < kPaces; ++pace)
    for (std::size_t word = 0; word < words; ++word)
      for (std::uint32_t bits = cells_of_pace[pace * words + word]; bits != 0; bits &= bits - 1) {
        const auto cell = static_cast<std::uint32_t>(32 * word) +
                          static_cast<std::uint32_t>(std::countr_zero(bits));
        occupy(pace, cell % length, cell / length % width, cell / (length * width));
      }
  set_reach(fastest, reach);
  bin_all(fraction, dt, capsules);
}

void SurfaceCells::take_grid(const BinParameters& grid) {
  grid_ = grid;
  words_ = (static_cast<std::size_t>(grid.size.x) + 63) / 64;
  for (Layer& layer : layers_) {
    layer.cells.assign(words_ * static_cast<std::size_t>(grid.size.y * grid.size.z), 0);
    layer.box.setEmpty();
  }
}

void SurfaceCells::occupy(std::uint32_t pace, std::uint32_t x, std::uint32_t y, std::uint32_t z) {
  Layer& layer = layers_[pace];
  const std::size_t row = y + static_cast<std::size_t>(grid_.size.y) * z;
  const std::uint64_t bit = std::uint64_t{1} << x % 64;
  std::uint64_t& word = layer.cells[row * words_ + x / 64];
  if ((word & bit) != 0) return;
  word |= bit;
  const float edge = 1.0f / grid_.inverse_cell;
  const Vec3f least(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
  layer.box.extend(grid_.origin.xyz() + edge * least)
      .extend(grid_.origin.xyz() + edge * (least + Vec3f::Ones()));
}

/// A cell belongs to its quickest particle alone.
void SurfaceCells::set_reach(float fastest, const SurfaceReach& reach) {
  float speed = fastest;
  for (std::size_t pace = 0; pace < kPaces; ++pace, speed /= kPaceRatio) {
    layers_[pace].margin = reach.still + reach.time * speed;
    for (std::size_t slower = pace + 1; slower < kPaces; ++slower)
      for (std::size_t word = 0; word < layers_[pace].cells.size(); ++word)
        layers_[slower].cells[word] &= ~layers_[pace].cells[word];
  }
  for (Layer& layer : layers_) list_cells(layer);
}

void SurfaceCells::list_cells(Layer& layer) const {
  layer.listed.clear();
  for (std::size_t word = 0; word < layer.cells.size(); ++word)
    for (std::uint64_t bits = layer.cells[word]; bits != 0; bits &= bits - 1) {
      const auto row = static_cast<int>(word / words_);
      layer.listed.push_back({static_cast<int>(64 * (word % words_)) + std::countr_zero(bits),
                              row % grid_.size.y, row / grid_.size.y, 0});
    }
}

/// What lies within reach of a box.
Box3f SurfaceCells::Layer::about(const Box3f& one) const {
  const Vec3f reach = Vec3f::Constant(margin);
  return Box3f(one.min() - reach, one.max() + reach);
}

void SurfaceCells::bin_all(double fraction, double dt, std::span<const SmokeCapsule> capsules) {
  const auto cells = static_cast<std::size_t>(grid_.size.w);
  any_capsule_ = false;
  surfaces_.clear();
  moments_.clear();
  numbers_.clear();
  groups_.clear();
  found_.resize(std::max<std::size_t>(found_.size(), 1));
  capsules_near_.assign(cells, 0);

  if (grid_.particles > 0) {
    Box3f near;
    for (const Layer& layer : layers_)
      if (!layer.box.isEmpty()) near.extend(layer.about(layer.box));
    for (std::size_t s = 0; s < state_.surfaces.size(); ++s) {
      MovingSurface& surface = state_.surfaces[s].surface;
      if (!near.intersects(surface.box())) continue;
      surface.fit_blocks();
      const auto number = static_cast<std::uint32_t>(surfaces_.size());
      surfaces_.push_back(&surface);
      moments_.emplace_back(surface, static_cast<float>(fraction));
      numbers_.push_back(static_cast<std::uint32_t>(s));
      for (std::uint32_t g = 0; g < surface.groups(); ++g)
        if (near.intersects(surface.group(g))) groups_.push_back({number, g});
    }
    bin_capsules(capsules);
  }
  const std::size_t pieces = (groups_.size() + kGroupChunk - 1) / kGroupChunk;
  if (found_.size() < pieces) found_.resize(pieces);
  for (Found& found : found_) found.triangles.clear(), found.cells.clear();
  parallel_chunks(groups_.size(), kGroupChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t g = begin; g < end; ++g)
      find_triangles(groups_[g], moments_[groups_[g].surface], found_[begin / kGroupChunk]);
  });
  sort_entries();
  find_normals();
  fill_triangles(dt);
}

/// Calls visit(bits, x of the first bit, y, z) for each word of the layer's cells that the box
/// meets, or each cell where these are fewer than the box has rows, ascending, until it says true;
/// says whether it did.
template <class Visit>
bool SurfaceCells::any_occupied_word(const Layer& layer, const Box3f& box,
                                     const Visit& visit) const {
  const Int4 low = cell_of(grid_, Float4::from(box.min()));
  const Int4 high = cell_of(grid_, Float4::from(box.max()));
  const auto rows = static_cast<std::size_t>((high.y - low.y + 1) * (high.z - low.z + 1));
  if (layer.listed.size() < rows) {
    for (const Int4& cell : layer.listed)
      if (cell.x >= low.x && cell.x <= high.x && cell.y >= low.y && cell.y <= high.y &&
          cell.z >= low.z && cell.z <= high.z && visit(1, cell.x, cell.y, cell.z))
        return true;
    return false;
  }
  const auto first = static_cast<std::size_t>(low.x), last = static_cast<std::size_t>(high.x);
  for (int z = low.z; z <= high.z; ++z)
    for (int y = low.y; y <= high.y; ++y) {
      const std::uint64_t* row =
          layer.cells.data() + words_ * static_cast<std::size_t>(y + grid_.size.y * z);
      for (std::size_t word = first / 64; word <= last / 64; ++word) {
        std::uint64_t bits = row[word];
        if (word == first / 64) bits &= ~std::uint64_t{0} << first % 64;
        if (word == last / 64) bits &= ~std::uint64_t{0} >> (63 - last % 64);
        if (bits != 0 && visit(bits, static_cast<int>(64 * word), y, z)) return true;
      }
    }
  return false;
}

/// Calls visit(cell, its centre) for those of the layer's cells that the box meets, ascending.
template <class Visit>
void SurfaceCells::for_each_occupied(const Layer& layer, const Box3f& box,
                                     const Visit& visit) const {
  const float edge = 1.0f / grid_.inverse_cell;
  any_occupied_word(layer, box, [&](std::uint64_t bits, int x_begin, int y, int z) {
    for (; bits != 0; bits &= bits - 1) {
      const int x = x_begin + std::countr_zero(bits);
      visit(cell_number(grid_, {x, y, z, 0}),
            Vec3f(grid_.origin.xyz() + Vec3f(x + 0.5f, y + 0.5f, z + 0.5f) * edge));
    }
    return false;
  });
}

/// Those with a cell that reaches the box.
SurfaceCells::NearLayers SurfaceCells::layers_near(const Box3f& box,
                                                   const NearLayers& among) const {
  NearLayers near = {};
  std::size_t count = 0;
  for (const Layer* const* layer = among.data(); *layer != nullptr; ++layer) {
    const Box3f about = (*layer)->about(box);
    if ((*layer)->box.intersects(about) &&
        any_occupied_word(**layer, about, [](std::uint64_t, int, int, int) { return true; }))
      near[count++] = *layer;
  }
  return near;
}

void SurfaceCells::find_triangles(const Group& group, const MovingSurface::Moment& moment,
                                  Found& found) const {
  const MovingSurface& surface = *surfaces_[group.surface];
  const float half_diagonal = 0.5f * std::sqrt(3.0f) / grid_.inverse_cell;
  NearLayers all = {};
  for (std::size_t pace = 0; pace < kPaces; ++pace) all[pace] = &layers_[pace];
  const NearLayers of_group = layers_near(surface.group(group.group), all);
  if (of_group[0] == nullptr) return;
  const std::span<const SurfaceTopology::Triangle> triangles = surface.topology().triangles();
  constexpr std::size_t kBlock = MovingSurface::kBlock;
  const std::size_t first = group.group * kBlock;
  for (std::size_t block = first; block < std::min(first + kBlock, surface.blocks()); ++block) {
    const NearLayers of_block = layers_near(surface.block(block), of_group);
    if (of_block[0] == nullptr) continue;
    for (const int t : surface.order().subspan(
             block * kBlock, std::min(kBlock, surface.order().size() - block * kBlock))) {
      const Vec3f a = moment.corner(triangles[t][0]), b = moment.corner(triangles[t][1]),
                  c = moment.corner(triangles[t][2]);
      const Box3f box(a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c));
      const Vec3f across = (b - a).cross(c - a);
      const float size = across.norm();
      const std::size_t before = found.cells.size();
      for (const Layer* const* layer = of_block.data(); *layer != nullptr; ++layer) {
        const Box3f about = (*layer)->about(box);
        if (!(*layer)->box.intersects(about)) continue;
        const float far = (half_diagonal + (*layer)->margin) * size;
        for_each_occupied(**layer, about, [&](std::uint32_t cell, const Vec3f& centre) {
          if (std::abs(across.dot(centre - a)) <= far) found.cells.push_back(cell);
        });
      }
      if (found.cells.size() > before)
        found.triangles.push_back(
            {group.surface, t, static_cast<std::uint32_t>(found.cells.size())});
    }
  }
}

/// Triangles are numbered in the order of the pieces of work, which threads don't change.
void SurfaceCells::sort_entries() {
  const auto cells = static_cast<std::size_t>(grid_.size.w);
  cell_begin_.assign(cells + 1, 0);
  std::size_t triangles = 0, entries = 0;
  for (Found& found : found_) {
    found.first_triangle = triangles;
    triangles += found.triangles.size();
    entries += found.cells.size();
    for (const std::uint32_t cell : found.cells) ++cell_begin_[cell];
  }
  triangles_.resize(triangles);
  balls_.resize(triangles);
  owners_.resize(triangles);
  entries_.resize(entries);
  std::uint32_t first = 0;
  for (std::uint32_t& begin : cell_begin_) first += std::exchange(begin, first);
  for (const Found& found : found_) {
    auto number = static_cast<std::uint32_t>(found.first_triangle);
    std::size_t at = 0;
    for (const Near& near : found.triangles) {
      for (; at < near.cells_end; ++at) entries_[cell_begin_[found.cells[at]]++] = number;
      ++number;
    }
  }
  std::copy_backward(cell_begin_.begin(), cell_begin_.end() - 1, cell_begin_.end());
  cell_begin_.front() = 0;
}

void SurfaceCells::find_normals() {
  wanted_.clear();
  for (const Found& found : found_)
    for (const Near& near : found.triangles)
      for (const int v : surfaces_[near.surface]->topology().triangles()[near.triangle])
        if (moments_[near.surface].lacks_normal(v)) wanted_.push_back({near.surface, v});
  parallel_for_each_index(wanted_.size(), kVertexChunk, [&](std::size_t i) {
    moments_[wanted_[i].surface].find_normal(wanted_[i].vertex);
  });
}

void SurfaceCells::fill_triangles(double dt) {
  const float inverse_dt = dt > 0.0 ? static_cast<float>(1.0 / dt) : 0.0f;
  const auto fill = [&](const Near& near, SurfaceTriangle& triangle, Float4& ball) {
    const MovingSurface::Moment& moment = moments_[near.surface];
    const SurfaceTopology& topology = surfaces_[near.surface]->topology();
    const SurfaceTopology::Triangle& vertices = topology.triangles()[near.triangle];
    const std::array<Vec3f, 3> at = {moment.corner(vertices[0]), moment.corner(vertices[1]),
                                     moment.corner(vertices[2])};
    const Vec3f mean = (at[0] + at[1] + at[2]) / 3.0f;
    const float radius =
        std::sqrt(std::max({(at[0] - mean).squaredNorm(), (at[1] - mean).squaredNorm(),
                            (at[2] - mean).squaredNorm()}));
    ball = Float4::from(mean, radius);
    const Vec3f normal = moment.face_normal(near.triangle);
    const std::array<float, 3> more = {static_cast<float>(numbers_[near.surface]), radius, 0.0f};
    triangle.normals[0] = Float4::from(normal);
    for (int e = 0; e < 3; ++e) {
      triangle.corners[e] = Float4::from(at[e], more[e]);
      triangle.motion[e] = Float4::from(inverse_dt * moment.way(vertices[e]));
      const int beyond = topology.beyond(static_cast<std::size_t>(near.triangle), e);
      const Vec3f other = beyond < 0 ? normal : moment.face_normal(beyond);
      triangle.normals[1 + e] = Float4::from(normal + other);
      triangle.normals[4 + e] = Float4::from(moment.corner_normal(vertices[e]));
    }
  };
  parallel_for_each_index(found_.size(), 1, [&](std::size_t f) {
    std::size_t number = found_[f].first_triangle;
    for (const Near& near : found_[f].triangles) {
      fill(near, triangles_[number], balls_[number]);
      owners_[number] = numbers_[near.surface];
      ++number;
    }
  });
}

void SurfaceCells::bin_capsules(std::span<const SmokeCapsule> capsules) {
  const float half_diagonal = 0.5f * std::sqrt(3.0f) / grid_.inverse_cell;
  for (std::size_t c = 0; c < capsules.size(); ++c) {
    const Vec3f from = capsules[c].from.xyz(), way = capsules[c].to.xyz() - from;
    const Vec3f to = from + way;
    const float square = way.squaredNorm();
    for (const Layer& layer : layers_) {
      const float far = capsules[c].from.w + layer.margin + half_diagonal;
      const Vec3f reach = Vec3f::Constant(far);
      const Box3f box(from.cwiseMin(to) - reach, from.cwiseMax(to) + reach);
      if (!box.intersects(layer.box)) continue;
      for_each_occupied(layer, box, [&](std::uint32_t cell, const Vec3f& centre) {
        const float at =
            square > 0.0f ? std::clamp(way.dot(centre - from) / square, 0.0f, 1.0f) : 0.0f;
        if ((centre - from - at * way).norm() > far) return;
        capsules_near_[cell] |= 1u << c % 32;
        any_capsule_ = true;
      });
    }
  }
}

std::size_t SurfaceCells::memory_bytes() const {
  std::size_t bytes = (cell_begin_.capacity() + entries_.capacity() + capsules_near_.capacity()) *
                          sizeof(std::uint32_t) +
                      triangles_.capacity() * sizeof(SurfaceTriangle) +
                      balls_.capacity() * sizeof(Float4) +
                      owners_.capacity() * sizeof(std::uint32_t);
  for (const Layer& layer : layers_)
    bytes +=
        layer.cells.capacity() * sizeof(std::uint64_t) + layer.listed.capacity() * sizeof(Int4);
  for (const Found& found : found_)
    bytes +=
        found.triangles.capacity() * sizeof(Near) + found.cells.capacity() * sizeof(std::uint32_t);
  for (const Tracked& tracked : state_.surfaces) bytes += tracked.surface.memory_bytes();
  return bytes;
}

}  // namespace viscera
