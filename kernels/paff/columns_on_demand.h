// Columns of a compliance that are made when they are first asked for.
//
// All columns of a large body's surface would take gigabytes and minutes, and tools press little of
// it. So a body above a budget has room for all of them, which costs no memory until it is written,
// and a source that makes them in fixed blocks. A block is always made whole, by the same
// operations in the same order: the bits of a column don't depend on when, why or by which thread
// it was made.
#pragma once

#include <atomic>
#include <cstddef>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

namespace viscera {

/// Makes blocks of columns. Constant; safe from many threads.
class ColumnSource {
 public:
  virtual ~ColumnSource() = default;
  virtual std::size_t blocks() const = 0;
  /// The block that makes the three columns of a touchable place.
  virtual std::size_t block_of(int touchable) const = 0;
  /// Writes its columns, whole, where they belong in `columns`: those of all touchable places.
  virtual void make(std::size_t block, float* columns) const = 0;
  virtual std::size_t memory_bytes() const = 0;
};

/// What was made of one body's columns, and what that cost while something ran. Not part of any
/// state.
struct ColumnFigures {
  std::size_t prepared = 0;   ///< columns that were there before anything ran
  std::size_t on_demand = 0;  ///< columns made since
  double on_demand_s = 0.0;   ///< that took
};

/// Which blocks are there. One for each array of columns; safe from many threads.
class ColumnsOnDemand {
 public:
  /// None is there yet. `touchable`: places that have columns.
  ColumnsOnDemand(std::shared_ptr<const ColumnSource> source, std::size_t touchable);

  /// Makes what is missing of these places' columns. Returns when all are there, also those that
  /// another thread is making.
  void need(std::span<const int> touchable, float* columns);
  void need_all(float* columns);
  /// The columns of these places were written by somebody else: whole blocks of them count.
  void take_as_made(std::span<const int> touchable);
  /// What was made until now counts as prepared.
  void end_preparation();

  /// The touchable places whose columns are there, ascending.
  std::vector<int> made() const;
  bool is_made(int touchable) const { return is_there_[source_->block_of(touchable)]; }
  ColumnFigures figures() const;
  const ColumnSource& source() const { return *source_; }

 private:
  void make(std::span<const std::size_t> blocks, float* columns);

  std::shared_ptr<const ColumnSource> source_;
  std::size_t touchable_;
  std::vector<std::size_t> places_in_;  // of each block
  std::unique_ptr<std::atomic<bool>[]> is_there_;
  std::mutex making_;
  std::atomic<std::size_t> prepared_ = 0, on_demand_ = 0;
  std::atomic<double> on_demand_s_ = 0.0;
};

}  // namespace viscera
