// Which elastic law a tissue follows; the laws themselves stand in kernels/hive/hyperelastic.h.
#pragma once

#include <string_view>

namespace viscera {

enum class HyperelasticModel { kLinear, kStvk, kNeoHookean };

constexpr std::string_view name_of(HyperelasticModel model) {
  constexpr std::string_view names[] = {"linear", "stvk", "neo_hookean"};
  return names[static_cast<int>(model)];
}

}  // namespace viscera
