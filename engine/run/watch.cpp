#include "engine/run/watch.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <utility>

#include "kernels/base/caught.h"

namespace viscera {

template <class Call>
Result<void> Watch::each(double time, bool failed_too, const Call& call) {
  Result<void> first;
  for (Watching& one : watching_) {
    if (one.failed && !failed_too) continue;
    Result<void> done = caught([&] { return call(*one.observer); });
    if (done) continue;
    one.failed = true;
    if (one.observer->name().empty()) continue;  // keeps nothing, makes nothing: the progress line
    const std::string why = done.error().text();
    if (std::ranges::find(failures_, why, &FailureReport::why) == failures_.end())
      failures_.push_back({one.observer->name(), time, why});
    if (first) first = std::move(done);
  }
  return first;
}

Result<void> Watch::open(const std::filesystem::path& folder) {
  return until_one_fails([&](Observer& observer) { return observer.open(folder); });
}

Result<void> Watch::begin() {
  return until_one_fails([](Observer& observer) { return observer.begin(); });
}

Result<void> Watch::add_frame(const World& world) {
  return each(world.time(), false, [&](Observer& observer) {
    observer.add_frame(world);
    return observer.status();
  });
}

Result<void> Watch::add_picture(FrameViews& views, StageClock& clock, bool wanted) {
  return each(views.world().time(), false, [&](Observer& observer) -> Result<void> {
    if (observer.looks() == Observer::Looks::kNever) return {};
    if (observer.looks() == Observer::Looks::kWanted && !wanted) return {};
    const StageClock::Scope scope(clock, observer.stage());
    return observer.add_picture(views);
  });
}

Result<void> Watch::close(const World& world) {
  return each(world.time(), true, [&](Observer& observer) { return observer.close(world); });
}

Result<void> Watch::describe(const World& world, RunReport& report) {
  return each(world.time(), true, [&](Observer& observer) -> Result<void> {
    observer.describe(world, report);
    return {};
  });
}

Result<void> Watch::present(const RunReport& report) {
  return each(report.duration_s, true,
              [&](Observer& observer) { return observer.present(report); });
}

Result<void> Watch::save(std::vector<CheckpointPart>& parts) {
  return until_one_fails([&](Observer& observer) -> Result<void> {
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
        std::ranges::none_of(
            watching_, [&](const Watching& one) { return one.observer->name() == part.name; }))
      return failure(fmt::format("checkpoint: found a part \"{}\", expected none of that name: {}",
                                 part.name, kOptions));
  return until_one_fails([&](Observer& observer) -> Result<void> {
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
