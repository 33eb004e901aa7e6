// A bound for what a library that parses may take, in the fuzzers that hold memory.cpp.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

namespace viscera::fuzz {

/// What may yet be asked of `new` [bytes]; SIZE_MAX: anything.
inline std::atomic<std::size_t> memory_left{SIZE_MAX};

/// While it lives, requests beyond so many bytes in all throw std::bad_alloc.
class MemoryBudget {
 public:
  explicit MemoryBudget(std::size_t bytes) { memory_left = bytes; }
  ~MemoryBudget() { memory_left = SIZE_MAX; }
  MemoryBudget(const MemoryBudget&) = delete;
  MemoryBudget& operator=(const MemoryBudget&) = delete;
};

}  // namespace viscera::fuzz
