// The world: entities, their components, and the clock. Constant ones stand in the model, which
// worlds share; state is what a step changes and the next one starts from; runtime follows from
// both. No globals: two worlds in one program are independent.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "engine/simulation/components.h"
#include "engine/simulation/model.h"

namespace viscera {

struct Continuation;
struct StateType;

struct Clock {
  static constexpr std::string_view kName = "clock";
  std::uint64_t tick = 0;   ///< 1 kHz ticks since the start; the time in ms
  std::uint64_t frame = 0;  ///< frames done
  static constexpr auto fields() {
    return std::tuple(field("tick", &Clock::tick), field("frame", &Clock::frame));
  }
};

class World {
 public:
  /// Empty of state: start_world() fills it.
  explicit World(std::shared_ptr<const SceneModel> model);
  World(World&&) noexcept;
  ~World();

  const SceneModel& model() const { return *model_; }
  const std::shared_ptr<const SceneModel>& shared_model() const { return model_; }

  /// All components of a type. Constant ones can only be looked at.
  template <class T>
  decltype(auto) all() {
    return pool_of<T>(*this);
  }
  template <class T>
  const Pool<T>& all() const {
    return pool_of<T>(*this);
  }
  /// An entity's; null where it has none.
  template <class T>
  auto* find(Entity entity) {
    return all<T>().find(entity);
  }
  template <class T>
  const T* find(Entity entity) const {
    return all<T>().find(entity);
  }
  /// One that the whole scene has; null where it has none.
  template <class T>
  auto* one() {
    return all<T>().find(kWhole);
  }
  template <class T>
  const T* one() const {
    return all<T>().find(kWhole);
  }
  template <class T>
  bool has() const {
    return all<T>().size() > 0;
  }

  std::uint64_t tick() const { return clock_.tick; }
  std::uint64_t frame() const { return clock_.frame; }
  double time() const { return static_cast<double>(clock_.tick) * 1e-3; }
  void set_clock(const Clock& clock) { clock_ = clock; }

  /// The types that its states have, by name, and all states of one of them.
  const std::vector<StateType>& state_types() const { return types_; }
  store_detail::AnyPool& states_of(const StateType& type);
  const store_detail::AnyPool& states_of(const StateType& type) const;

  /// From now on an organ is another body, as where it was cut; features make anew what follows
  /// from it (Feature::replaced). Which body it is must follow from state (StateType::of_bodies).
  /// `continuation`: how it goes on as the old one did; null: it is at rest, or its state is
  /// loaded.
  void replace(Entity organ, std::shared_ptr<const OrganModel> body,
               const Continuation* continuation);

  // --- state as a whole ---

  /// All of it, as bytes for load_state() of a world of the same model.
  std::vector<std::byte> save_state() const;
  /// Takes such bytes, and makes what follows from them. Fails, saying what doesn't fit, on bytes
  /// of another model or layout; the world is then not to be stepped any more.
  Result<void> load_state(std::span<const std::byte> bytes);
  /// Equal for equal states, bit for bit.
  std::string state_hash() const;
  std::size_t state_bytes() const;
  /// Tells one layout of state from another: names and kinds of all fields.
  std::string state_layout() const;
  /// The first field in which two worlds of one model differ; empty: none.
  std::string state_difference(const World& other) const;

 private:
  template <class T, class Self>
  static decltype(auto) pool_of(Self& self) {
    if constexpr (std::is_same_v<T, OrganBody>)
      return std::as_const(self.bodies_);
    else if constexpr (ConstantComponent<T>)
      return std::as_const(*self.model_).constants().template all<T>();
    else if constexpr (StateComponent<T>)
      return self.state_.template all<T>();
    else
      return self.runtime_.template all<T>();
  }

  std::shared_ptr<const SceneModel> model_;
  std::vector<StateType> types_;  ///< all states that the model's features have, by name
  Pool<OrganBody> bodies_;        ///< the model's, until replace()
  Store state_, runtime_;
  Clock clock_;
};

/// Where an organ's frame stands now.
inline const Pose& pose_of(const World& world, Entity organ) {
  return world.find<OrganPose>(organ)->pose;
}

}  // namespace viscera
