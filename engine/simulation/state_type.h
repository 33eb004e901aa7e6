// What a world can do with all states of one type: save, load, hash, count and compare them, and
// look for numbers that aren't finite. All of it follows from the type's table of fields, here and
// nowhere else; a feature lists its types in Feature::states.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/simulation/store.h"
#include "kernels/base/archive.h"
#include "kernels/base/finite.h"

namespace viscera {

class World;

/// What becomes of numbers in a state that aren't finite (sentinel.h).
struct Strays {
  enum class Become {
    kZero,
    kAsBefore,   ///< all states of the type are those of the step's start: small ones, that mean
                 ///< something by themselves
    kUnwatched,  ///< who owns the state sees to it; other threads may be writing it
  };
  Become become = Become::kZero;
  /// What has to be done besides, before; null: nothing.
  void (*contain)(World&, Entity owner) = nullptr;
  /// Whether no state of the type can have changed in this step, so that none is looked at; null:
  /// some always may have.
  bool (*unchanged)(const World&) = nullptr;
};

struct StateType {
  using AnyPool = store_detail::AnyPool;
  std::string_view name;
  std::size_t number = 0;  ///< in a Store
  std::unique_ptr<AnyPool> (*make)() = nullptr;
  std::string (*layout)() = nullptr;
  void (*save)(const AnyPool&, ByteWriter&) = nullptr;
  void (*hash)(const AnyPool&, Hasher&) = nullptr;
  std::size_t (*bytes)(const AnyPool&) = nullptr;
  /// Those that are there stay and take their state; others are made, or go.
  void (*load)(AnyPool&, ByteReader&) = nullptr;
  /// As first_difference(); both of this type.
  std::string (*difference)(const AnyPool&, const AnyPool&) = nullptr;
  /// The first number that isn't finite of each owner that has one.
  std::vector<std::pair<Entity, StrayNumber>> (*first_strays)(const AnyPool&) = nullptr;
  void (*zero_strays)(AnyPool&, Entity owner) = nullptr;
  Strays strays = {};
  /// It says which bodies organs are: loaded before all others, whose sizes follow from that.
  bool of_bodies = false;
};

namespace state_detail {

template <class T>
const Pool<T>& pool_of(const store_detail::AnyPool& any) {
  return static_cast<const store_detail::PoolOf<T>&>(any).pool;
}

template <class T, class Sink>
void put(const Pool<T>& pool, Sink& to) {
  write(to, pool.owners());
  for (const T& one : pool) write(to, one);
}

/// Another set of owners: those that are here stay, new ones begin empty.
template <class T>
void gather(Pool<T>& pool, const std::vector<Entity>& owners, ByteReader& from) {
  Pool<T> next;
  for (const Entity owner : owners) {
    // An entity's index is one of a scene's: anything greater is no state of ours.
    if (owner.index > (1u << 20) || next.find(owner)) return void(from.fail());
    if (T* here = pool.find(owner)) {
      next.add(owner, std::move(*here));
    } else if constexpr (std::is_default_constructible_v<T>) {
      next.add(owner, T());
    } else {
      return void(from.fail());
    }
  }
  pool = std::move(next);
}

template <class T>
void load(Pool<T>& pool, ByteReader& from) {
  std::vector<Entity> owners;
  read(from, owners);
  if (from.failed()) return;
  if (owners != pool.owners()) gather(pool, owners, from);
  for (std::size_t i = 0; i < pool.size() && !from.failed(); ++i) read(from, pool[i]);
}

template <class T>
std::string difference(const Pool<T>& one, const Pool<T>& other) {
  if (one.owners() != other.owners()) return "[size]";
  for (std::size_t i = 0; i < one.size(); ++i) {
    const std::string inside = first_difference(one[i], other[i]);
    if (!inside.empty()) return "[" + std::to_string(i) + "]." + inside;
  }
  return "";
}

}  // namespace state_detail

template <StateComponent T>
StateType state_type(Strays strays = {}) {
  using Any = store_detail::AnyPool;
  return {
      .name = T::kName,
      .number = store_detail::number_of<T>(),
      .make = []() -> std::unique_ptr<Any> { return std::make_unique<store_detail::PoolOf<T>>(); },
      .layout = [] { return std::string(T::kName) + layout_of<T>(); },
      .save = [](const Any& any,
                 ByteWriter& to) { state_detail::put(state_detail::pool_of<T>(any), to); },
      .hash = [](const Any& any,
                 Hasher& to) { state_detail::put(state_detail::pool_of<T>(any), to); },
      .bytes =
          [](const Any& any) {
            ByteCounter counter;
            state_detail::put(state_detail::pool_of<T>(any), counter);
            return counter.count();
          },
      .load =
          [](Any& any, ByteReader& from) {
            state_detail::load(static_cast<store_detail::PoolOf<T>&>(any).pool, from);
          },
      .difference =
          [](const Any& one, const Any& other) {
            return state_detail::difference(state_detail::pool_of<T>(one),
                                            state_detail::pool_of<T>(other));
          },
      .first_strays =
          [](const Any& any) {
            const Pool<T>& pool = state_detail::pool_of<T>(any);
            std::vector<std::pair<Entity, StrayNumber>> found;
            for (std::size_t i = 0; i < pool.size(); ++i)
              if (auto stray = first_stray(pool[i])) found.emplace_back(pool.owner(i), *stray);
            return found;
          },
      .zero_strays =
          [](Any& any, Entity owner) {
            zero_strays(*static_cast<store_detail::PoolOf<T>&>(any).pool.find(owner));
          },
      .strays = strays,
      .of_bodies = requires {T::kOfBodies;
}
};  // namespace viscera
}

}  // namespace viscera
