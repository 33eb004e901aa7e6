#include "tests/haptics/allocations.h"

#include <cerrno>
#include <cstddef>

#include "kernels/base/sanitized.h"

#if defined(__GLIBC__) && !defined(VISCERA_SANITIZED)
#define VISCERA_COUNTS_ALLOCATIONS 1
#endif

namespace {
thread_local std::uint64_t counted = 0;
}

#ifdef VISCERA_COUNTS_ALLOCATIONS
// The program's own malloc comes before the C library's, which stays reachable by these names.
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* old, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) {
  ++counted;
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  ++counted;
  return __libc_calloc(count, size);
}
void* realloc(void* old, std::size_t size) {
  ++counted;
  return __libc_realloc(old, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  ++counted;
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** out, std::size_t alignment, std::size_t size) {
  ++counted;
  *out = __libc_memalign(alignment, size);
  return *out || size == 0 ? 0 : ENOMEM;
}
}
#endif

namespace viscera::test {

bool allocations_are_counted() {
#ifdef VISCERA_COUNTS_ALLOCATIONS
  return true;
#else
  return false;
#endif
}

std::uint64_t allocations() {
  return counted;
}

}  // namespace viscera::test
