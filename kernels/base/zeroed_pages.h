// Memory of zeros that costs nothing until it is written.
#pragma once

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
    void* memory = std::calloc(count, sizeof(T));
    if (memory == nullptr) throw std::bad_alloc();
    return static_cast<T*>(memory);
  }
  void deallocate(T* memory, std::size_t) { std::free(memory); }
  template <class U>
  void construct(U*) noexcept {}
  template <class U, class... Values>
  void construct(U* at, Values&&... values) {
    ::new (static_cast<void*>(at)) U(std::forward<Values>(values)...);
  }
  bool operator==(const ZeroedPages&) const { return true; }
};

}  // namespace viscera
