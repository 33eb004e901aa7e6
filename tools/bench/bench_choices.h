// What several benches check of the cases that a command names.
#pragma once

#include <fmt/format.h>

#include <string>
#include <utility>
#include <vector>

#include "kernels/base/result.h"
#include "kernels/formulations/formulations.h"

namespace viscera {

/// What was named, or the whole list.
template <class T>
std::vector<T> or_default(const std::vector<T>& named, std::vector<T> otherwise) {
  return named.empty() ? std::move(otherwise) : named;
}

/// A message for each name that is none of a formulation, and each count that no body is made of.
inline void check_bodies_named(const std::vector<std::string>& formulations,
                               const std::vector<std::size_t>& nodes, Error& mistakes) {
  for (const std::string& name : formulations)
    if (!find_formulation(name))
      mistakes.messages.push_back("--formulation: " + unknown_formulation(name));
  for (const std::size_t count : nodes)
    if (count < 50 || count > 200'000)
      mistakes.messages.push_back(
          fmt::format("--nodes: found {}, expected from 50 to 200000", count));
}

}  // namespace viscera
