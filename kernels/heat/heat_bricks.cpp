#include "kernels/heat/heat_bricks.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
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

}  // namespace

HeatBricks::State::State(const State& other) : empty(other.empty), overflowed(other.overflowed) {
  bricks.reserve(other.bricks.size());
  for (const auto& brick : other.bricks) bricks.push_back(std::make_unique<HeatBrick>(*brick));
}

HeatBricks::State& HeatBricks::State::operator=(State other) {
  bricks.swap(other.bricks);
  empty.swap(other.empty);
  overflowed = other.overflowed;
  return *this;
}

HeatBricks::HeatBricks(double voxel, SignedDistance distance, std::size_t most,
                       std::shared_ptr<State> where)
    : voxel_(voxel),
      distance_(std::move(distance)),
      most_(most),
      state_(where ? std::move(where) : std::make_shared<State>()) {
  assert(voxel > 0.0);
}

void HeatBricks::restore(State state) {
  find_geometry(state);
  *state_ = std::move(state);
  link_neighbours();
}

std::shared_ptr<const BrickGeometry> HeatBricks::geometry_at(const BrickIndex& index) const {
  const int shape = shape_numbers_.find(index);
  if (shape == BrickMap::kNone) return make_geometry(index, voxel_, distance_);
  const auto& shaped = shapes_[static_cast<std::size_t>(shape)].geometry;
  return shaped ? shaped : without_blood(make_geometry(index, voxel_, distance_));
}

std::vector<HeatBrick*> HeatBricks::take_shapes(std::vector<ShapedBrick> shapes) {
  const BrickMap before = std::exchange(shape_numbers_, {});
  const std::vector<ShapedBrick> shapes_before = std::exchange(shapes_, std::move(shapes));
  for (std::size_t i = 0; i < shapes_.size(); ++i)
    shape_numbers_.set(shapes_[i].index, static_cast<int>(i));
  std::vector<HeatBrick*> changed;
  for (const auto& brick : state_->bricks) {
    const int was = before.find(brick->index), is = shape_numbers_.find(brick->index);
    if (was == BrickMap::kNone && is == BrickMap::kNone) continue;
    // What had no blood, and was as the distance says, is so still.
    if (was != BrickMap::kNone && is != BrickMap::kNone &&
        !shapes_before[static_cast<std::size_t>(was)].geometry &&
        !shapes_[static_cast<std::size_t>(is)].geometry)
      continue;
    changed.push_back(brick.get());
  }
  parallel_for_each_index(changed.size(), 1, [&](std::size_t c) {
    changed[c]->geometry = geometry_at(changed[c]->index);
  });
  return changed;
}

void HeatBricks::find_geometry(State& state) const {
  std::vector<HeatBrick*> missing;
  for (const auto& brick : state.bricks) {
    if (brick->geometry) continue;
    if (const HeatBrick* here = find(brick->index))
      brick->geometry = here->geometry;
    else
      missing.push_back(brick.get());
  }
  parallel_for_each_index(missing.size(), 1, [&](std::size_t m) {
    missing[m]->geometry = geometry_at(missing[m]->index);
  });
}

void HeatBricks::link_neighbours() {
  numbers_ = {};
  for (std::size_t i = 0; i < count(); ++i) numbers_.set(brick(i).index, static_cast<int>(i));
  for (const BrickIndex& index : state_->empty) numbers_.set(index, kEmpty);
  for (const auto& brick : state_->bricks) {
    for (int side = 0; side < 6; ++side) {
      const int other = numbers_.find(beside(brick->index, side));
      brick->neighbours[side] =
          other < 0 ? nullptr : state_->bricks[static_cast<std::size_t>(other)].get();
    }
  }
}

bool HeatBricks::fits(const State& state) const {
  if (state.bricks.size() > most_) return false;
  BrickMap taken;
  const auto is_new = [&](const BrickIndex& index) {
    if (!BrickMap::holds(index) || taken.find(index) != BrickMap::kNone) return false;
    taken.set(index, 0);
    return true;
  };
  const auto within = [](const auto& values, float low, float high) {
    return std::ranges::all_of(values, [&](float v) { return v >= low && v <= high; });
  };
  constexpr float kMost = std::numeric_limits<float>::max();
  for (const auto& brick : state.bricks) {
    if (!brick || !is_new(brick->index) || !within(brick->water, 0.0f, 1.0f) ||
        !within(brick->charred, 0.0f, 1.0f) || !within(brick->dose, 0.0f, kMost) ||
        !within(brick->coagulation, 0.0f, kMost) || !within(brick->collagen, 0.0f, kMost))
      return false;
    if (!brick->warm) continue;
    const BrickWarmth& warm = *brick->warm;
    if (!within(warm.excess, -kMost, kMost) || !within(warm.border, 0.0f, kMost) ||
        !(warm.greatest >= 0.0f && warm.greatest <= kMost) || warm.idle < 0)
      return false;
  }
  return std::ranges::all_of(state.empty, is_new);
}

const HeatBrick* HeatBricks::find(const BrickIndex& index) const {
  const int number = numbers_.find(index);
  return number < 0 ? nullptr : state_->bricks[static_cast<std::size_t>(number)].get();
}

HeatBrick* HeatBricks::warm_up(const BrickIndex& index) {
  return warm_up(index, nullptr);
}

std::vector<HeatBrick*> HeatBricks::warm_up(std::span<const BrickIndex> indices) {
  // To ask where the surface is takes by far the longest.
  std::vector<std::shared_ptr<const BrickGeometry>> made(indices.size());
  std::vector<std::size_t> missing;
  for (std::size_t i = 0; i < indices.size(); ++i)
    if (numbers_.find(indices[i]) == BrickMap::kNone && state_->bricks.size() < most_)
      missing.push_back(i);
  parallel_for_each_index(missing.size(), 1, [&](std::size_t m) {
    made[missing[m]] = geometry_at(indices[missing[m]]);
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
    if (state_->bricks.size() >= most_) {
      state_->overflowed = true;
      return nullptr;
    }
    if (!geometry) geometry = geometry_at(index);
    if (geometry->empty) {
      numbers_.set(index, kEmpty);
      state_->empty.push_back(index);
      return nullptr;
    }
    number = static_cast<int>(state_->bricks.size());
    numbers_.set(index, number);
    auto made = std::make_unique<HeatBrick>();
    made->index = index;
    made->geometry = std::move(geometry);
    made->water.fill(1.0f);
    for (BrickField::Values* field :
         {&made->charred, &made->dose, &made->coagulation, &made->collagen})
      field->fill(0.0f);
    for (int side = 0; side < 6; ++side) {
      const int other = numbers_.find(beside(index, side));
      if (other < 0) continue;
      made->neighbours[side] = state_->bricks[static_cast<std::size_t>(other)].get();
      made->neighbours[side]->neighbours[opposite(side)] = made.get();
    }
    state_->bricks.push_back(std::move(made));
  }
  HeatBrick& brick = *state_->bricks[static_cast<std::size_t>(number)];
  if (!brick.warm) brick.warm = std::make_unique<HeatBrick::Warm>();
  return &brick;
}

void HeatBricks::cool_down(std::size_t i) {
  HeatBrick& brick = *state_->bricks[i];
  brick.warm.reset();
  if (brick.harmed) return;
  for (int side = 0; side < 6; ++side)
    if (brick.neighbours[side]) brick.neighbours[side]->neighbours[opposite(side)] = nullptr;
  numbers_.erase(brick.index);
  if (i + 1 < state_->bricks.size()) {
    state_->bricks[i] = std::move(state_->bricks.back());
    numbers_.set(state_->bricks[i]->index, static_cast<int>(i));
  }
  state_->bricks.pop_back();
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
  return brick && brick->warm ? static_cast<double>(brick->warm->excess[static_cast<std::size_t>(
                                    BrickField::place_in_brick(voxel, index))])
                              : 0.0;
}

double HeatBricks::lasting_at(const BrickIndex& voxel, BrickField::Values BrickTissue::*field,
                              double sound) const {
  const BrickIndex index = BrickField::brick_of(voxel);
  const HeatBrick* brick = find(index);
  return brick ? static_cast<double>((brick->*field)[static_cast<std::size_t>(
                     BrickField::place_in_brick(voxel, index))])
               : sound;
}

double HeatBricks::tissue_at(const BrickIndex& voxel) const {
  const BrickIndex index = BrickField::brick_of(voxel);
  if (numbers_.find(index) == kEmpty) return 0.0;
  const HeatBrick* brick = find(index);
  return brick ? static_cast<double>(brick->geometry->fraction[static_cast<std::size_t>(
                     BrickField::place_in_brick(voxel, index))])
               : 1.0;
}

double HeatBricks::water_at(const BrickIndex& voxel) const {
  return lasting_at(voxel, &BrickTissue::water, 1.0);
}

double HeatBricks::charred_at(const BrickIndex& voxel) const {
  return lasting_at(voxel, &BrickTissue::charred, 0.0);
}

double HeatBricks::dose_at(const BrickIndex& voxel) const {
  return lasting_at(voxel, &BrickTissue::dose, 0.0);
}

double HeatBricks::coagulation_at(const BrickIndex& voxel) const {
  return lasting_at(voxel, &BrickTissue::coagulation, 0.0);
}

double HeatBricks::collagen_at(const BrickIndex& voxel) const {
  return lasting_at(voxel, &BrickTissue::collagen, 0.0);
}

std::size_t HeatBricks::memory_bytes() const {
  std::size_t bytes = numbers_.memory_bytes() + state_->empty.capacity() * sizeof(BrickIndex) +
                      state_->bricks.capacity() * sizeof(state_->bricks[0]) +
                      shape_numbers_.memory_bytes() + shapes_.capacity() * sizeof(ShapedBrick);
  for (const ShapedBrick& shape : shapes_)
    if (shape.geometry) bytes += shape.geometry->memory_bytes();
  for (const auto& brick : state_->bricks) {
    bytes += sizeof(HeatBrick) + brick->geometry->memory_bytes();
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
