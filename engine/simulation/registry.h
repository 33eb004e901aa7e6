// Entities and their components: an index with a generation, and one densely packed array a
// component type. No component owns another entity by pointer.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "kernels/base/fields.h"

namespace viscera {

/// Names an entity; a stale name (the entity was destroyed) is recognised by its generation.
struct Entity {
  std::uint32_t index = UINT32_MAX;
  std::uint32_t generation = 0;

  bool operator==(const Entity&) const = default;
  static constexpr auto fields() {
    return std::tuple(field("index", &Entity::index), field("generation", &Entity::generation));
  }
};
static_assert(fields_cover<Entity>() && is_flat<Entity>());

/// Components of one type, packed in the order in which they were added; look-up by entity is O(1).
template <class T>
class Pool {
 public:
  T& add(Entity entity, T component) {
    if (slot_.size() <= entity.index) slot_.resize(entity.index + 1, kNone);
    slot_[entity.index] = static_cast<std::uint32_t>(items_.size());
    owners_.push_back(entity);
    items_.push_back(std::move(component));
    return items_.back();
  }

  /// The entity's component, or null when it has none or the name is stale.
  T* find(Entity entity) {
    const std::uint32_t slot = slot_of(entity);
    return slot == kNone ? nullptr : &items_[slot];
  }
  const T* find(Entity entity) const { return const_cast<Pool*>(this)->find(entity); }

  void remove(Entity entity) {
    const std::uint32_t slot = slot_of(entity);
    if (slot == kNone) return;
    // Order is kept, so that results don't depend on what was removed when; removal is rare.
    items_.erase(items_.begin() + slot);
    owners_.erase(owners_.begin() + slot);
    slot_[entity.index] = kNone;
    for (std::uint32_t s = slot; s < owners_.size(); ++s) slot_[owners_[s].index] = s;
  }

  void clear() { *this = Pool(); }

  std::size_t size() const { return items_.size(); }
  Entity owner(std::size_t i) const { return owners_[i]; }
  const std::vector<Entity>& owners() const { return owners_; }
  T& operator[](std::size_t i) { return items_[i]; }
  const T& operator[](std::size_t i) const { return items_[i]; }
  auto begin() { return items_.begin(); }
  auto end() { return items_.end(); }
  auto begin() const { return items_.begin(); }
  auto end() const { return items_.end(); }

 private:
  static constexpr std::uint32_t kNone = UINT32_MAX;

  std::uint32_t slot_of(Entity entity) const {
    if (entity.index >= slot_.size()) return kNone;
    const std::uint32_t slot = slot_[entity.index];
    return slot != kNone && owners_[slot] == entity ? slot : kNone;
  }

  std::vector<std::uint32_t> slot_;
  std::vector<Entity> owners_;
  std::vector<T> items_;
};

/// Hands out entities and takes them back.
class EntityIds {
 public:
  Entity create() {
    if (free_.empty()) {
      generations_.push_back(0);
      return {static_cast<std::uint32_t>(generations_.size() - 1), 0};
    }
    const std::uint32_t index = free_.back();
    free_.pop_back();
    return {index, generations_[index]};
  }
  void destroy(Entity entity) {
    if (!alive(entity)) return;
    ++generations_[entity.index];
    free_.push_back(entity.index);
  }
  bool alive(Entity entity) const {
    return entity.index < generations_.size() && generations_[entity.index] == entity.generation;
  }

 private:
  std::vector<std::uint32_t> generations_;
  std::vector<std::uint32_t> free_;
};

}  // namespace viscera
