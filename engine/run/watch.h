// All observers of a run.
#pragma once

#include <memory>
#include <vector>

#include "engine/run/observer.h"
#include "engine/simulator/checkpoint_file.h"

namespace viscera {

/// Calls them phase by phase (observer.h). The first failure ends a phase.
class Watch {
 public:
  void add(std::unique_ptr<Observer> observer) { observers_.push_back(std::move(observer)); }

  Result<void> open(const std::filesystem::path& folder);
  Result<void> begin();
  void add_frame(const World& world);
  /// `wanted`: the person asked for a picture of this time.
  Result<void> add_picture(FrameViews& views, StageClock& clock, bool wanted);
  Result<void> close(const World& world);
  void describe(const World& world, RunReport& report) const;
  Result<void> present(const RunReport& report);

  /// A part each, by its name.
  Result<void> save(std::vector<CheckpointPart>& parts);
  /// In place of begin(). Fails for a checkpoint that lacks a part, or has one that nobody here
  /// knows: the run was started with other options. `others`: parts that aren't observers'.
  Result<void> load(const Checkpoint& checkpoint, const std::vector<std::string>& others);

 private:
  template <class Call>
  Result<void> each(const Call& call) {
    for (const std::unique_ptr<Observer>& observer : observers_)
      if (Result<void> done = call(*observer); !done) return done;
    return {};
  }

  std::vector<std::unique_ptr<Observer>> observers_;
};

}  // namespace viscera
