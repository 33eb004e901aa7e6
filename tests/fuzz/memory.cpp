// What two libraries that parse get for `new`, in their fuzzers. OpenVDB makes as many nodes and as
// long strings as a file says, and to fill those takes most of the time: beyond a MemoryBudget a
// request throws, as too much does in viscera_reader, whose memory is limited. assimp takes 16 MB
// for each OBJ file, and new pages for them cost five times what reading it does: a large block
// that was given back is kept for the next request of its size, poisoned, so that its use after it
// was given back is still found.
#include "tests/fuzz/memory.h"

#include <sanitizer/allocator_interface.h>
#include <sanitizer/asan_interface.h>

#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <new>

namespace {

constexpr std::size_t kLarge = 1 << 22;  // bytes from which on a block is kept

std::atomic<void*> kept{nullptr};

// A request that fails ends the budget: its error needs memory, too.
bool is_too_much(std::size_t size) {
  std::atomic<std::size_t>& left = viscera::fuzz::memory_left;
  if (left == SIZE_MAX) return false;
  const bool too_much = size > left;
  left = too_much ? SIZE_MAX : left - size;
  return too_much;
}

void* of_kept(std::size_t size) {
  void* block = kept.exchange(nullptr);
  if (block == nullptr) return nullptr;
  if (__sanitizer_get_allocated_size(block) == size) {
    __asan_unpoison_memory_region(block, size);
    return block;
  }
  std::free(block);
  return nullptr;
}

void* allocate(std::size_t size) {
  if (is_too_much(size)) throw std::bad_alloc();
  if (size >= kLarge)
    if (void* block = of_kept(size)) return block;
  if (void* block = std::malloc(size)) return block;
  throw std::bad_alloc();
}

void release(void* block) noexcept {
  if (block == nullptr) return;
  const std::size_t size = __sanitizer_get_allocated_size(block);
  if (size < kLarge) return std::free(block);
  __asan_poison_memory_region(block, size);
  std::free(kept.exchange(block));
}

}  // namespace

void* operator new(std::size_t size) {
  return allocate(size);
}
void* operator new[](std::size_t size) {
  return allocate(size);
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  return is_too_much(size) ? nullptr : std::malloc(size);
}
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept {
  return is_too_much(size) ? nullptr : std::malloc(size);
}
void operator delete(void* block) noexcept {
  release(block);
}
void operator delete[](void* block) noexcept {
  release(block);
}
void operator delete(void* block, std::size_t) noexcept {
  release(block);
}
void operator delete[](void* block, std::size_t) noexcept {
  release(block);
}
