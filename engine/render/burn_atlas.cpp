#include "engine/render/burn_atlas.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "kernels/heat/damage.h"

namespace viscera {

namespace {

constexpr int kTilesAcross = 16;  // of the atlas in x and y

/// What is drawn of one voxel.
using Seen = std::array<std::uint16_t, 4>;
using SeenBrick = std::array<Seen, BrickField::kVoxels>;

std::uint16_t stored(double value) {
  return static_cast<std::uint16_t>(
      std::lround(65535.0 * std::clamp(std::isfinite(value) ? value : 0.0, 0.0, 1.0)));
}

SeenBrick seen_of(const HeatBrick& brick) {
  SeenBrick seen{};
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (brick.geometry->fraction[i] <= 0.0f) continue;
    const double excess = brick.warm ? static_cast<double>(brick.warm->excess[i]) : 0.0;
    seen[i] = {0, 0, stored(excess / BurnAtlas::kHottest), 65535};
    if (!brick.harmed) continue;
    const TissueState state =
        tissue_state(static_cast<double>(brick.coagulation[i]), static_cast<double>(brick.water[i]),
                     static_cast<double>(brick.charred[i]));
    seen[i][0] = stored(state.coagulated);
    seen[i][1] = stored(0.5 * (state.seared + 2.0 * state.charred));
  }
  return seen;
}

/// The 27 bricks around one, itself at 13; null where there is none.
std::array<const SeenBrick*, 27> neighbourhood(const std::vector<SeenBrick>& seen,
                                               const BrickMap& numbers, const BrickIndex& brick) {
  std::array<const SeenBrick*, 27> found{};
  for (int i = 0; i < 27; ++i) {
    const int neighbour = numbers.find(brick + BrickIndex(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1));
    if (neighbour >= 0)
      found[static_cast<std::size_t>(i)] = &seen[static_cast<std::size_t>(neighbour)];
  }
  return found;
}

void fill_tile(const std::array<const SeenBrick*, 27>& bricks, std::vector<std::uint16_t>& tile) {
  constexpr int kEdge = BrickField::kEdge, kBorder = BurnAtlas::kBorder;
  std::size_t out = 0;
  for (int z = kEdge - kBorder; z < 2 * kEdge + kBorder; ++z) {
    for (int y = kEdge - kBorder; y < 2 * kEdge + kBorder; ++y) {
      for (int x = kEdge - kBorder; x < 2 * kEdge + kBorder; ++x, out += 4) {
        const SeenBrick* values =
            bricks[static_cast<std::size_t>(x / kEdge + 3 * (y / kEdge) + 9 * (z / kEdge))];
        const int inside = x % kEdge + kEdge * (y % kEdge + kEdge * (z % kEdge));
        const Seen voxel = values ? (*values)[static_cast<std::size_t>(inside)] : Seen{};
        std::copy(voxel.begin(), voxel.end(), tile.begin() + static_cast<std::ptrdiff_t>(out));
      }
    }
  }
}

}  // namespace

bool BurnAtlas::reserve(int tiles) {
  const int layers = (tiles + kTilesAcross * kTilesAcross - 1) / (kTilesAcross * kTilesAcross);
  if (layers <= atlas_tiles_.z()) return false;
  const int grown = std::max(layers, 2 * atlas_tiles_.z());
  atlas_tiles_ = Eigen::Vector3i(kTilesAcross, kTilesAcross, grown);
  const Eigen::Vector3i size = atlas_tiles_ * kTileEdge;
  atlas_ = Texture(GL_RGBA16, size.x(), size.y(), size.z());
  return true;
}

void BurnAtlas::update_map() {
  Eigen::Vector3i low = indices_.front(), high = low;
  for (const Eigen::Vector3i& index : indices_) {
    low = low.cwiseMin(index);
    high = high.cwiseMax(index);
  }
  const Eigen::Vector3i size = high - low + Eigen::Vector3i::Ones();
  std::vector<std::uint32_t> map(static_cast<std::size_t>(size.x()) * size.y() * size.z(), 0);
  for (std::size_t i = 0; i < indices_.size(); ++i) {
    const Eigen::Vector3i cell = indices_[i] - low;
    map[cell.x() + static_cast<std::size_t>(size.x()) *
                       (cell.y() + static_cast<std::size_t>(size.y()) * cell.z())] =
        static_cast<std::uint32_t>(i + 1);
  }
  if (!map_ || Eigen::Vector3i(map_.width(), map_.height(), map_.depth()) != size) {
    map_ = Texture(GL_R32UI, size.x(), size.y(), size.z(), Texture::Filter::kNearest);
  }
  map_.upload_3d(0, 0, 0, size.x(), size.y(), size.z(), GL_RED_INTEGER, GL_UNSIGNED_INT,
                 map.data());
  first_brick_ = low;
}

void BurnAtlas::update(const HeatBricks& bricks) {
  uploaded_ = 0;
  voxel_ = bricks.voxel();
  const std::size_t count = bricks.count();
  if (count < tiles_.size()) tiles_.clear();  // bricks went, or another field
  std::vector<BrickIndex> indices(count);
  std::vector<SeenBrick> seen(count);
  BrickMap numbers;
  for (std::size_t i = 0; i < count; ++i) {
    indices[i] = bricks.brick(i).index;
    seen[i] = seen_of(bricks.brick(i));
    numbers.set(indices[i], static_cast<int>(i));
  }
  const bool other_bricks = indices != indices_;
  indices_ = std::move(indices);
  if (count == 0) return;
  const bool moved = reserve(static_cast<int>(count));
  tiles_.resize(count);
  Tile tile(kTileEdge * kTileEdge * kTileEdge * kChannels);
  for (std::size_t i = 0; i < count; ++i) {
    fill_tile(neighbourhood(seen, numbers, indices_[i]), tile);
    if (!moved && tile == tiles_[i]) continue;
    tiles_[i] = tile;
    const int x = static_cast<int>(i) % kTilesAcross;
    const int y = static_cast<int>(i) / kTilesAcross % kTilesAcross;
    const int z = static_cast<int>(i) / (kTilesAcross * kTilesAcross);
    atlas_.upload_3d(x * kTileEdge, y * kTileEdge, z * kTileEdge, kTileEdge, kTileEdge, kTileEdge,
                     GL_RGBA, GL_UNSIGNED_SHORT, tile.data());
    ++uploaded_;
  }
  if (other_bricks) update_map();
}

void BurnAtlas::bind(Program& program, unsigned map_unit, unsigned atlas_unit) const {
  map_.bind(map_unit);
  atlas_.bind(atlas_unit);
  program.set("brick_map", static_cast<int>(map_unit));
  program.set("burn_atlas", static_cast<int>(atlas_unit));
  program.set("first_brick", first_brick_);
  program.set("atlas_tiles", atlas_tiles_);
  program.set("voxel", static_cast<float>(voxel_));
}

}  // namespace viscera
