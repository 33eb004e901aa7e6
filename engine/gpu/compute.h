// Dispatches of compute kernels that declare the buffers they read and write.
#pragma once

#include <cstddef>
#include <initializer_list>
#include <set>

#include "engine/gpu/buffer.h"
#include "engine/gpu/program.h"

namespace viscera {

/// Issues dispatches, and between them the barriers that their declared reads and writes need. A
/// software driver runs dispatches one after another, so that a barrier forgotten by hand would
/// never show there.
class ComputeQueue {
 public:
  struct Use {
    unsigned binding;
    const Buffer* buffer;
  };

  /// `groups_per_axis`: what the device takes; more groups are laid out in rows of that many, and
  /// the kernel learns by its uniform `groups` how many of them there are.
  explicit ComputeQueue(std::size_t groups_per_axis) : groups_per_axis_(groups_per_axis) {}

  void dispatch(Program& program, std::size_t groups, std::initializer_list<Use> reads,
                std::initializer_list<Use> writes);
  /// Before anything but a dispatch uses what was written: drawing, read-back.
  void make_readable();

 private:
  std::size_t groups_per_axis_;
  std::set<unsigned> read_, written_;  // since the last barrier
};

}  // namespace viscera
