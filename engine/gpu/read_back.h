// Bytes on their way from the device to the CPU while both go on working.
#pragma once

#include <cstddef>

#include "engine/gpu/buffer.h"

namespace viscera {

/// A staging buffer that stays mapped: start() copies on the device, wait() ends when what was
/// copied since the last wait() is there. One wait for all copies of a frame.
class ReadBack {
 public:
  /// data() is null where the device has no such memory.
  explicit ReadBack(std::size_t size);
  ~ReadBack();
  ReadBack(const ReadBack&) = delete;
  ReadBack& operator=(const ReadBack&) = delete;

  /// Copies to `to`; within both sizes. What shaders wrote needs a barrier before
  /// (ComputeQueue::make_readable).
  void start(const Buffer& from, std::size_t offset, std::size_t size, std::size_t to);
  /// After the last start() of a frame.
  void submit();
  /// False: the device failed, and data() holds nothing of use.
  bool wait();

  const void* data() const { return data_; }
  std::size_t size() const { return size_; }

 private:
  std::size_t size_ = 0;
  unsigned id_ = 0;
  void* data_ = nullptr;
  void* fence_ = nullptr;
};

}  // namespace viscera
