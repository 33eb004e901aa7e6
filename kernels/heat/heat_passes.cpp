#include "kernels/heat/heat_passes.h"

#include <algorithm>

#include "kernels/base/parallel.h"

namespace viscera {
namespace {

/// Bricks that a thread takes at once: some ten microseconds of work.
constexpr std::size_t kChunk = 4;

}  // namespace

template <class Body>
void CpuHeatPasses::for_warm(const Body& body) {
  parallel_for_each_index(warm_.size(), kChunk, [&](std::size_t i) { body(*warm_[i]); });
}

bool CpuHeatPasses::start(std::span<HeatBrick* const> warm, const HeatModel& model) {
  warm_ = warm;
  model_ = model;
  for (HeatBrick* brick : warm_) {
    brick->warm->sums = {};
    brick->warm->vapour.clear();
  }
  return true;
}

HeatFlows CpuHeatPasses::prepare() {
  for_warm([&](HeatBrick& brick) { prepare_brick(brick, *model_.numbers); });
  return rates();
}

HeatFlows CpuHeatPasses::rates() {
  for_warm([&](HeatBrick& brick) { find_rates(brick, *model_.numbers); });
  HeatFlows all;
  for (const HeatBrick* brick : warm_) {
    all.living += brick->warm->living_sum;
    all.boundary += brick->warm->boundary_sum;
    all.source += brick->warm->source_sum;
    all.fastest = std::max(all.fastest, brick->warm->fastest);
  }
  return all;
}

void CpuHeatPasses::advance(double dt) {
  for_warm([&](HeatBrick& brick) { advance_brick(brick, static_cast<float>(dt)); });
}

void CpuHeatPasses::advance_stage(const SuperStage& stage, int j, double dt) {
  for_warm(
      [&](HeatBrick& brick) { viscera::advance_stage(brick, stage, j, static_cast<float>(dt)); });
}

void CpuHeatPasses::settle(double dt) {
  for_warm([&](HeatBrick& brick) {
    settle_brick(brick, *model_.numbers, *model_.tissue, *model_.cooling, dt);
  });
}

bool CpuHeatPasses::finish(bool) {
  warm_ = {};
  return true;
}

}  // namespace viscera
