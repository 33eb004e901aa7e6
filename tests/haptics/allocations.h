// Counts what the calling thread takes from the heap.
#pragma once

#include <cstdint>

namespace viscera::test {

/// False under sanitizers, which have a heap of their own.
bool allocations_are_counted();
/// Calls of malloc and its kin by this thread so far; operator new and Eigen end there.
std::uint64_t allocations();

}  // namespace viscera::test
