#include "engine/run/watch.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>

namespace viscera {

Result<void> Watch::open(const std::filesystem::path& folder) {
  return each([&](Observer& observer) { return observer.open(folder); });
}

Result<void> Watch::begin() {
  return each([](Observer& observer) { return observer.begin(); });
}

void Watch::add_frame(const World& world) {
  for (const std::unique_ptr<Observer>& observer : observers_) observer->add_frame(world);
}

Result<void> Watch::add_picture(FrameViews& views, StageClock& clock, bool wanted) {
  return each([&](Observer& observer) -> Result<void> {
    if (observer.looks() == Observer::Looks::kNever) return {};
    if (observer.looks() == Observer::Looks::kWanted && !wanted) return {};
    const StageClock::Scope scope(clock, observer.stage());
    return observer.add_picture(views);
  });
}

Result<void> Watch::close(const World& world) {
  return each([&](Observer& observer) { return observer.close(world); });
}

void Watch::describe(const World& world, RunReport& report) const {
  for (const std::unique_ptr<Observer>& observer : observers_) observer->describe(world, report);
}

Result<void> Watch::present(const RunReport& report) {
  return each([&](Observer& observer) { return observer.present(report); });
}

Result<void> Watch::save(std::vector<CheckpointPart>& parts) {
  return each([&](Observer& observer) -> Result<void> {
    if (observer.name().empty()) return {};
    ByteWriter writer;
    if (Result<void> saved = observer.save_state(writer); !saved) return saved;
    parts.push_back({observer.name(), writer.take()});
    return {};
  });
}

Result<void> Watch::load(const Checkpoint& checkpoint, const std::vector<std::string>& others) {
  constexpr const char* kOptions = "a run goes on with the options that it was started with";
  for (const CheckpointPart& part : checkpoint.parts)
    if (std::ranges::find(others, part.name) == others.end() &&
        std::ranges::none_of(observers_, [&](const auto& one) { return one->name() == part.name; }))
      return failure(fmt::format("checkpoint: found a part \"{}\", expected none of that name: {}",
                                 part.name, kOptions));
  return each([&](Observer& observer) -> Result<void> {
    if (observer.name().empty()) return {};
    const CheckpointPart* part = checkpoint.find(observer.name());
    if (!part)
      return failure(fmt::format("checkpoint: found no part \"{}\", expected one: {}",
                                 observer.name(), kOptions));
    ByteReader reader(part->bytes);
    Result<void> loaded = observer.load_state(reader);
    if (!loaded)
      return failure(
          fmt::format("checkpoint: its part \"{}\": {}", part->name, loaded.error().text()));
    return {};
  });
}

}  // namespace viscera
