// Files that are written on a thread of their own while the simulation goes on.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>

#include "kernels/base/result.h"

namespace viscera {

/// Runs jobs one after another, in the order they came. A job that fails doesn't keep the next from
/// running; one that throws has failed with what it says.
class FileWorker {
 public:
  using Job = std::move_only_function<Result<void>()>;
  /// `most_waiting`: jobs in the queue besides the one that runs; what they hold is memory.
  explicit FileWorker(std::size_t most_waiting = 2);
  ~FileWorker();  ///< waits for what is queued
  FileWorker(const FileWorker&) = delete;
  FileWorker& operator=(const FileWorker&) = delete;

  /// Blocks only while the queue is full.
  void add(Job job);
  /// The first failure so far, without waiting.
  Result<void> status() const;
  /// Waits for the queue; the first failure, if any.
  Result<void> finish();

  int done() const;        ///< jobs that went well
  double seconds() const;  ///< that the thread has spent in jobs

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace viscera
