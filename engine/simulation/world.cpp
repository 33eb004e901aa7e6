#include "engine/simulation/world.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "engine/simulation/feature.h"
#include "engine/simulation/state_type.h"

namespace viscera {
namespace {

template <class Sink>
void put_clock(Sink& to, const Clock& clock) {
  write(to, clock);
}

}  // namespace

World::World(std::shared_ptr<const SceneModel> model)
    : model_(std::move(model)), bodies_(model_->constants().all<OrganBody>()) {
  for (const Feature& feature : model_->features())
    types_.insert(types_.end(), feature.states.begin(), feature.states.end());
  std::ranges::sort(types_, {}, &StateType::name);
  std::ranges::stable_partition(types_, &StateType::of_bodies);
  for (const StateType& type : types_) state_.at(type.number) = type.make();
}

World::World(World&&) noexcept = default;
World::~World() = default;

store_detail::AnyPool& World::states_of(const StateType& type) {
  return *state_.at(type.number);
}

const store_detail::AnyPool& World::states_of(const StateType& type) const {
  return state_.at(type.number);
}

void World::replace(Entity organ, std::shared_ptr<const OrganModel> body,
                    const Continuation* continuation) {
  // Until the features are done: what they have refers to it.
  const std::shared_ptr<const OrganModel> before =
      std::exchange(bodies_.find(organ)->model, std::move(body));
  for (const Feature& feature : model_->features())
    if (feature.replaced) feature.replaced(*this, organ, continuation);
}

std::vector<std::byte> World::save_state() const {
  ByteWriter writer;
  writer.reserve(state_bytes());
  put_clock(writer, clock_);
  for (const StateType& type : types_) type.save(state_.at(type.number), writer);
  return writer.take();
}

Result<void> World::load_state(std::span<const std::byte> bytes) {
  ByteReader reader(bytes);
  Clock clock;
  read(reader, clock);
  bool bodies = false;
  for (const StateType& type : types_) {
    if (!type.of_bodies && !std::exchange(bodies, true))
      for (const Feature& feature : model_->features())
        if (feature.bodies_loaded)
          if (auto made = feature.bodies_loaded(*this); !made) return made;
    type.load(*state_.at(type.number), reader);
    if (reader.failed())
      return failure(
          fmt::format("{}: found a state that doesn't fit this scene's, expected one "
                      "that was saved from it",
                      type.name));
  }
  if (reader.failed() || !reader.at_end())
    return failure("state: found more or less of it than this scene has");
  clock_ = clock;
  for (const Feature& feature : model_->features())
    if (feature.restored) feature.restored(*this);
  return {};
}

std::string World::state_hash() const {
  Hasher hasher;
  put_clock(hasher, clock_);
  for (const StateType& type : types_) {
    hasher.text(type.name);
    type.hash(state_.at(type.number), hasher);
  }
  return hasher.hex();
}

std::size_t World::state_bytes() const {
  ByteCounter counter;
  put_clock(counter, clock_);
  std::size_t bytes = counter.count();
  for (const StateType& type : types_) bytes += type.bytes(state_.at(type.number));
  return bytes;
}

std::string World::state_layout() const {
  std::string text;
  for (const StateType& type : types_) text += type.layout() + "\n";
  return text;
}

std::string World::state_difference(const World& other) const {
  if (std::string inside = first_difference(clock_, other.clock_); !inside.empty())
    return "clock." + inside;
  for (const StateType& type : types_) {
    const std::string inside =
        type.difference(state_.at(type.number), other.state_.at(type.number));
    if (!inside.empty()) return std::string(type.name) + inside;
  }
  return "";
}

}  // namespace viscera
