// Parallel loops over oneTBB whose results don't depend on the number of threads: fixed chunks, and
// sums in the order of the chunks.
#pragma once

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cstddef>
#include <vector>

namespace viscera {

/// Calls body(begin, end) for consecutive chunks of [0, count). The chunks are the same whatever
/// the number of threads, so a body may keep one accumulator a chunk.
template <class Body>
void parallel_chunks(std::size_t count, std::size_t chunk, const Body& body) {
  if (count == 0) return;
  const std::size_t chunks = (count + chunk - 1) / chunk;
  if (chunks == 1) {
    body(std::size_t{0}, count);
    return;
  }
  oneapi::tbb::parallel_for(std::size_t{0}, chunks, [&](std::size_t c) {
    body(c * chunk, std::min(count, (c + 1) * chunk));
  });
}

/// Calls body(i) for i in [0, count), in chunks.
template <class Body>
void parallel_for_each_index(std::size_t count, std::size_t chunk, const Body& body) {
  parallel_chunks(count, chunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) body(i);
  });
}

/// Sum of value(begin, end) over fixed chunks, added in order: the same last digits for any number
/// of threads.
template <class T, class Value>
T parallel_sum(std::size_t count, std::size_t chunk, T zero, const Value& value) {
  const std::size_t chunks = (count + chunk - 1) / chunk;
  std::vector<T> parts(chunks, zero);
  parallel_chunks(count, chunk, [&](std::size_t begin, std::size_t end) {
    parts[begin / chunk] = value(begin, end);
  });
  T sum = zero;
  for (const T& part : parts) sum += part;
  return sum;
}

}  // namespace viscera
