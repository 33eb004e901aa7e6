// Memory of zeros that costs nothing until it is written.
#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <cstdlib>
#include <limits>
#include <new>
#include <utility>

namespace viscera {

/// Allocator for a vector of numbers that may stay empty in large parts: a fresh vector reads as
/// zeros, and the system gives a page of it when something is first written there. A vector that
/// shrinks and grows again in place finds its old numbers.
template <class T>
struct ZeroedPages {
  using value_type = T;

  ZeroedPages() = default;
  template <class U>
  ZeroedPages(const ZeroedPages<U>&) {}  // NOLINT: conversions between types are the rule here

  T* allocate(std::size_t count) {
    if (count > std::numeric_limits<std::size_t>::max() / sizeof(T)) throw std::bad_alloc();
    if (count * sizeof(T) >= kMapped) {
      // More than there is may be asked for: most of it stays empty.
      void* mapped = ::mmap(nullptr, count * sizeof(T), PROT_READ | PROT_WRITE,
                            MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
      if (mapped == MAP_FAILED) throw std::bad_alloc();
      return static_cast<T*>(mapped);
    }
    void* memory = std::calloc(count, sizeof(T));
    if (memory == nullptr) throw std::bad_alloc();
    return static_cast<T*>(memory);
  }
  void deallocate(T* memory, std::size_t count) {
    if (count * sizeof(T) >= kMapped)
      ::munmap(memory, count * sizeof(T));
    else
      std::free(memory);
  }
  template <class U>
  void construct(U*) noexcept {}
  template <class U, class... Values>
  void construct(U* at, Values&&... values) {
    ::new (static_cast<void*>(at)) U(std::forward<Values>(values)...);
  }
  bool operator==(const ZeroedPages&) const { return true; }

 private:
  static constexpr std::size_t kMapped = std::size_t{1} << 30;
};

}  // namespace viscera
