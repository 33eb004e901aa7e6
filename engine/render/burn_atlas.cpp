#include "engine/render/burn_atlas.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace viscera {

namespace {

constexpr int kTilesAcross = 16;  // of the atlas in x and y

/// The 27 bricks around one, itself at 13; null where there is none.
std::array<const BrickField::Values*, 27> neighbourhood(const BrickField& field,
                                                        std::size_t brick) {
  std::array<const BrickField::Values*, 27> found{};
  for (int i = 0; i < 27; ++i) {
    const Eigen::Vector3i offset(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
    const int neighbour = field.find(field.brick_indices()[brick] + offset);
    if (neighbour >= 0) found[i] = &field.brick(neighbour);
  }
  return found;
}

void fill_tile(const BrickField& field, std::size_t brick, std::vector<std::uint16_t>& tile) {
  constexpr int kEdge = BrickField::kEdge, kBorder = BurnAtlas::kBorder;
  const auto bricks = neighbourhood(field, brick);
  std::size_t out = 0;
  for (int z = -kBorder; z < kEdge + kBorder; ++z) {
    for (int y = -kBorder; y < kEdge + kBorder; ++y) {
      for (int x = -kBorder; x < kEdge + kBorder; ++x, ++out) {
        const int bx = (x + kEdge) / kEdge, by = (y + kEdge) / kEdge, bz = (z + kEdge) / kEdge;
        const BrickField::Values* values = bricks[bx + 3 * by + 9 * bz];
        const int inside =
            (x + kEdge) % kEdge + kEdge * ((y + kEdge) % kEdge + kEdge * ((z + kEdge) % kEdge));
        const float value = values != nullptr ? (*values)[inside] : 0.0f;
        tile[out] = static_cast<std::uint16_t>(
            std::lround(65535.0f * std::clamp(std::isfinite(value) ? value : 0.0f, 0.0f, 1.0f)));
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
  atlas_ = Texture(GL_R16, size.x(), size.y(), size.z());
  return true;
}

void BurnAtlas::update_map(const BrickField& damage) {
  Eigen::Vector3i low = damage.brick_indices().front(), high = low;
  for (const Eigen::Vector3i& index : damage.brick_indices()) {
    low = low.cwiseMin(index);
    high = high.cwiseMax(index);
  }
  const Eigen::Vector3i size = high - low + Eigen::Vector3i::Ones();
  std::vector<std::uint32_t> map(static_cast<std::size_t>(size.x()) * size.y() * size.z(), 0);
  for (std::size_t i = 0; i < damage.brick_count(); ++i) {
    const Eigen::Vector3i cell = damage.brick_indices()[i] - low;
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

void BurnAtlas::update(const BrickField& damage) {
  uploaded_ = 0;
  voxel_ = damage.voxel();
  const std::size_t count = damage.brick_count();
  if (count < tiles_.size()) tiles_.clear();  // another field: a restored checkpoint, say
  if (count == 0) return;
  const bool moved = reserve(static_cast<int>(count));
  const bool grown = count != tiles_.size();
  tiles_.resize(count);
  Tile tile(kTileEdge * kTileEdge * kTileEdge);
  for (std::size_t i = 0; i < count; ++i) {
    fill_tile(damage, i, tile);
    if (!moved && tile == tiles_[i]) continue;
    tiles_[i] = tile;
    const int x = static_cast<int>(i) % kTilesAcross;
    const int y = static_cast<int>(i) / kTilesAcross % kTilesAcross;
    const int z = static_cast<int>(i) / (kTilesAcross * kTilesAcross);
    atlas_.upload_3d(x * kTileEdge, y * kTileEdge, z * kTileEdge, kTileEdge, kTileEdge, kTileEdge,
                     GL_RED, GL_UNSIGNED_SHORT, tile.data());
    ++uploaded_;
  }
  if (grown) update_map(damage);
}

void BurnAtlas::bind(Program& program, unsigned map_unit, unsigned atlas_unit) const {
  map_.bind(map_unit);
  atlas_.bind(atlas_unit);
  program.set("brick_map", static_cast<int>(map_unit));
  program.set("damage_atlas", static_cast<int>(atlas_unit));
  program.set("first_brick", first_brick_);
  program.set("atlas_tiles", atlas_tiles_);
  program.set("voxel", static_cast<float>(voxel_));
}

}  // namespace viscera
