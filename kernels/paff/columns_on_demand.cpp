#include "kernels/paff/columns_on_demand.h"

#include <oneapi/tbb/task_arena.h>

#include <algorithm>

#include "kernels/base/parallel.h"
#include "kernels/base/stopwatch.h"

namespace viscera {

ColumnsOnDemand::ColumnsOnDemand(std::shared_ptr<const ColumnSource> source, std::size_t touchable)
    : source_(std::move(source)),
      touchable_(touchable),
      places_in_(source_->blocks(), 0),
      is_there_(new std::atomic<bool>[source_->blocks()]()) {
  for (std::size_t t = 0; t < touchable; ++t) ++places_in_[source_->block_of(static_cast<int>(t))];
}

void ColumnsOnDemand::need(std::span<const int> touchable, float* columns) {
  std::vector<std::size_t> missing;
  for (const int place : touchable) {
    const std::size_t block = source_->block_of(place);
    if (!is_there_[block].load(std::memory_order_acquire)) missing.push_back(block);
  }
  if (!missing.empty()) make(missing, columns);
}

void ColumnsOnDemand::need_all(float* columns) {
  std::vector<std::size_t> all(source_->blocks());
  for (std::size_t b = 0; b < all.size(); ++b) all[b] = b;
  make(all, columns);
}

void ColumnsOnDemand::make(std::span<const std::size_t> blocks, float* columns) {
  const std::lock_guard lock(making_);
  const Stopwatch watch;
  std::vector<std::size_t> missing;
  for (const std::size_t block : blocks)
    if (!is_there_[block].load(std::memory_order_relaxed)) missing.push_back(block);
  std::sort(missing.begin(), missing.end());
  missing.erase(std::unique(missing.begin(), missing.end()), missing.end());
  if (missing.empty()) return;
  // Without isolation this thread might take up somebody else's task that needs columns, too, and
  // wait for its own lock.
  oneapi::tbb::this_task_arena::isolate([&] {
    parallel_for_each_index(missing.size(), 1,
                            [&](std::size_t m) { source_->make(missing[m], columns); });
  });
  for (const std::size_t block : missing) {
    is_there_[block].store(true, std::memory_order_release);
    on_demand_ += 3 * places_in_[block];
  }
  on_demand_s_ += watch.seconds();
}

void ColumnsOnDemand::take_as_made(std::span<const int> touchable) {
  std::vector<std::size_t> given(places_in_.size(), 0);
  for (const int place : touchable) ++given[source_->block_of(place)];
  for (std::size_t b = 0; b < given.size(); ++b) {
    if (given[b] == 0 || given[b] != places_in_[b] || is_there_[b]) continue;
    is_there_[b] = true;
    on_demand_ += 3 * places_in_[b];
  }
}

void ColumnsOnDemand::end_preparation() {
  prepared_ += on_demand_.exchange(0);
  on_demand_s_ = 0.0;
}

std::vector<int> ColumnsOnDemand::made() const {
  std::vector<int> places;
  for (std::size_t t = 0; t < touchable_; ++t)
    if (is_made(static_cast<int>(t))) places.push_back(static_cast<int>(t));
  return places;
}

ColumnFigures ColumnsOnDemand::figures() const {
  return {prepared_, on_demand_, on_demand_s_};
}

}  // namespace viscera
