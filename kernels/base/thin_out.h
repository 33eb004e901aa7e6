// Fewer samples of many.
#pragma once

#include <cstddef>
#include <vector>

namespace viscera {

/// Keeps every n-th value, so that `most` are left at most.
template <class T>
void thin_out(std::vector<T>& values, std::size_t most) {
  if (values.size() <= most) return;
  const std::size_t step = values.size() / most + 1;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < values.size(); i += step) values[kept++] = values[i];
  values.resize(kept);
}

}  // namespace viscera
