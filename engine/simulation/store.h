// All components of one sort (constant, state or runtime), a pool a type; and single values that
// belong to no entity. Found by type, so that a feature brings its own without anybody's list.
//
// What a component is, its type says once:
//   constant  `static constexpr bool kConstant = true;`: made with the model, shared by simulations
//   state     has a table of fields (kernels/base/fields.h) and a name: what a step changes and the
//             next one starts from; its feature lists it (state_type.h)
//   runtime   anything else: made from the two, of no effect on what comes next
#pragma once

#include <atomic>
#include <memory>
#include <string_view>
#include <vector>

#include "engine/simulation/registry.h"

namespace viscera {

template <class T>
concept ConstantComponent = requires {
  requires T::kConstant;
};
template <class T>
concept StateComponent = !ConstantComponent<T> && HasFields<T> && requires {
  { T::kName } -> std::convertible_to<std::string_view>;
};

namespace store_detail {

/// A pool whose type is forgotten.
class AnyPool {
 public:
  virtual ~AnyPool() = default;
};

template <class T>
class PoolOf final : public AnyPool {
 public:
  Pool<T> pool;
};

inline std::size_t next_number() {
  static std::atomic<std::size_t> next = 0;
  return next++;
}
/// A number for each component type, by first use.
template <class T>
std::size_t number_of() {
  static const std::size_t number = next_number();
  return number;
}

}  // namespace store_detail

class Store {
 public:
  template <class T>
  Pool<T>& all() {
    using Held = store_detail::PoolOf<T>;
    std::unique_ptr<store_detail::AnyPool>& pool = at(store_detail::number_of<T>());
    if (!pool) pool = std::make_unique<Held>();
    return static_cast<Held&>(*pool).pool;
  }
  template <class T>
  const Pool<T>& all() const {
    using Held = store_detail::PoolOf<T>;
    static const Pool<T> kNone;
    const std::size_t number = store_detail::number_of<T>();
    if (pools_.size() <= number || !pools_[number]) return kNone;
    return static_cast<const Held&>(*pools_[number]).pool;
  }

  /// The pool of a type by its number; null: there is none yet.
  std::unique_ptr<store_detail::AnyPool>& at(std::size_t number) {
    if (pools_.size() <= number) pools_.resize(number + 1);
    return pools_[number];
  }
  const store_detail::AnyPool& at(std::size_t number) const { return *pools_[number]; }

 private:
  std::vector<std::unique_ptr<store_detail::AnyPool>> pools_;
};

/// Stands for the scene as a whole where a component isn't of one thing in it.
inline constexpr Entity kWhole{0, UINT32_MAX};

}  // namespace viscera
