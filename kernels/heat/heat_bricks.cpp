#include "kernels/heat/heat_bricks.h"

#include <cassert>
#include <cmath>
#include <utility>

#include "kernels/base/parallel.h"

namespace viscera {
namespace {

constexpr int kEmpty = -2;

BrickIndex beside(const BrickIndex& index, int side) {
  BrickIndex neighbour = index;
  neighbour[side / 2] += side % 2 ? 1 : -1;
  return neighbour;
}

constexpr int opposite(int side) {
  return side ^ 1;
}

// Which voxel of its brick a voxel is.
int within(const BrickIndex& voxel, const BrickIndex& brick) {
  const BrickIndex local = voxel - brick * HeatBricks::kEdge;
  return local.x() + HeatBricks::kEdge * (local.y() + HeatBricks::kEdge * local.z());
}

}  // namespace

HeatBricks::HeatBricks(double voxel, SignedDistance distance, std::size_t most)
    : voxel_(voxel), distance_(std::move(distance)), most_(most) {
  assert(voxel > 0.0);
}

const HeatBrick* HeatBricks::find(const BrickIndex& index) const {
  const int number = numbers_.find(index);
  return number < 0 ? nullptr : bricks_[static_cast<std::size_t>(number)].get();
}

HeatBrick* HeatBricks::warm_up(const BrickIndex& index) {
  return warm_up(index, nullptr);
}

std::vector<HeatBrick*> HeatBricks::warm_up(std::span<const BrickIndex> indices) {
  // To ask where the surface is takes by far the longest.
  std::vector<std::shared_ptr<const BrickGeometry>> made(indices.size());
  std::vector<std::size_t> missing;
  for (std::size_t i = 0; i < indices.size(); ++i)
    if (numbers_.find(indices[i]) == BrickMap::kNone && bricks_.size() < most_)
      missing.push_back(i);
  parallel_for_each_index(missing.size(), 1, [&](std::size_t m) {
    made[missing[m]] = make_geometry(indices[missing[m]], voxel_, distance_);
  });
  std::vector<HeatBrick*> bricks;
  for (std::size_t i = 0; i < indices.size(); ++i)
    if (HeatBrick* brick = warm_up(indices[i], std::move(made[i]))) bricks.push_back(brick);
  return bricks;
}

HeatBrick* HeatBricks::warm_up(const BrickIndex& index,
                               std::shared_ptr<const BrickGeometry> geometry) {
  int number = numbers_.find(index);
  if (number == kEmpty) return nullptr;
  if (number == BrickMap::kNone) {
    if (bricks_.size() >= most_) {
      overflowed_ = true;
      return nullptr;
    }
    if (!geometry) geometry = make_geometry(index, voxel_, distance_);
    if (geometry->empty) {
      numbers_.set(index, kEmpty);
      return nullptr;
    }
    number = static_cast<int>(bricks_.size());
    numbers_.set(index, number);
    auto made = std::make_unique<HeatBrick>();
    made->index = index;
    made->geometry = std::move(geometry);
    made->water.fill(1.0f);
    made->damage.fill(0.0f);
    made->charred.fill(0.0f);
    for (int side = 0; side < 6; ++side) {
      const int other = numbers_.find(beside(index, side));
      if (other < 0) continue;
      made->neighbours[side] = bricks_[static_cast<std::size_t>(other)].get();
      made->neighbours[side]->neighbours[opposite(side)] = made.get();
    }
    bricks_.push_back(std::move(made));
  }
  HeatBrick& brick = *bricks_[static_cast<std::size_t>(number)];
  if (!brick.warm) brick.warm = std::make_unique<HeatBrick::Warm>();
  return &brick;
}

void HeatBricks::cool_down(std::size_t i) {
  HeatBrick& brick = *bricks_[i];
  brick.warm.reset();
  if (brick.harmed) return;
  for (int side = 0; side < 6; ++side)
    if (brick.neighbours[side]) brick.neighbours[side]->neighbours[opposite(side)] = nullptr;
  numbers_.erase(brick.index);
  if (i + 1 < bricks_.size()) {
    bricks_[i] = std::move(bricks_.back());
    numbers_.set(bricks_[i]->index, static_cast<int>(i));
  }
  bricks_.pop_back();
}

BrickIndex HeatBricks::voxel_of(const Vec3& rest_position) const {
  return (rest_position / voxel_).array().floor().cast<int>();
}

Vec3 HeatBricks::centre(const HeatBrick& brick, int voxel) const {
  const BrickIndex local(voxel % kEdge, voxel / kEdge % kEdge, voxel / (kEdge * kEdge));
  return ((brick.index * kEdge + local).cast<double>().array() + 0.5) * voxel_;
}

double HeatBricks::excess_at(const BrickIndex& voxel) const {
  const BrickIndex index = BrickField::brick_of(voxel);
  const HeatBrick* brick = find(index);
  return brick && brick->warm ? static_cast<double>(brick->warm->excess[within(voxel, index)])
                              : 0.0;
}

double HeatBricks::damage_at(const BrickIndex& voxel) const {
  const BrickIndex index = BrickField::brick_of(voxel);
  const HeatBrick* brick = find(index);
  return brick ? static_cast<double>(brick->damage[within(voxel, index)]) : 0.0;
}

double HeatBricks::water_at(const BrickIndex& voxel) const {
  const BrickIndex index = BrickField::brick_of(voxel);
  const HeatBrick* brick = find(index);
  return brick ? static_cast<double>(brick->water[within(voxel, index)]) : 1.0;
}

double HeatBricks::charred_at(const BrickIndex& voxel) const {
  const BrickIndex index = BrickField::brick_of(voxel);
  const HeatBrick* brick = find(index);
  return brick ? static_cast<double>(brick->charred[within(voxel, index)]) : 0.0;
}

std::size_t HeatBricks::memory_bytes() const {
  std::size_t bytes = numbers_.memory_bytes() + bricks_.capacity() * sizeof(bricks_[0]);
  for (const auto& brick : bricks_) {
    bytes += sizeof(HeatBrick);
    if (brick->geometry != BrickGeometry::whole())
      bytes += sizeof(BrickGeometry) +
               brick->geometry->surface.capacity() * sizeof(BrickGeometry::Surface);
    if (!brick->warm) continue;
    bytes += sizeof(HeatBrick::Warm) + brick->warm->vapour.capacity() * sizeof(VoxelVapour);
    if (brick->warm->stages) bytes += sizeof(*brick->warm->stages);
  }
  return bytes;
}

std::size_t HeatBricks::bytes_for(const Vec3& size, double voxel) {
  const double edge = kEdge * voxel;
  const Vec3 bricks = (size / edge).array().ceil();
  return static_cast<std::size_t>(bricks.prod()) *
         (sizeof(HeatBrick) + sizeof(HeatBrick::Warm) + sizeof(BrickGeometry));
}

}  // namespace viscera
