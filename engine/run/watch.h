// All observers of a run.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "engine/run/observer.h"
#include "engine/simulator/checkpoint_file.h"

namespace viscera {

/// Calls them phase by phase (observer.h). Before a run has begun the first failure ends a phase.
/// From then on none keeps the others from being called, whether it fails or throws.
class Watch {
 public:
  void add(std::unique_ptr<Observer> observer) { watching_.push_back({std::move(observer)}); }

  Result<void> open(const std::filesystem::path& folder);
  Result<void> begin();
  /// These four give the first failure of theirs and keep all for failures().
  Result<void> add_frame(const World& world);
  /// `wanted`: the person asked for a picture of this time.
  Result<void> add_picture(FrameViews& views, StageClock& clock, bool wanted);
  Result<void> close(const World& world);
  Result<void> present(const RunReport& report);
  Result<void> describe(const World& world, RunReport& report);

  /// Of frames, pictures and the end. Of what several tell in the same words, one.
  const std::vector<FailureReport>& failures() const { return failures_; }

  /// A part each, by its name.
  Result<void> save(std::vector<CheckpointPart>& parts);
  /// In place of begin(). Fails for a checkpoint that lacks a part, or has one that nobody here
  /// knows: the run was started with other options. `others`: parts that aren't observers'.
  Result<void> load(const Checkpoint& checkpoint, const std::vector<std::string>& others);

 private:
  struct Watching {
    std::unique_ptr<Observer> observer;
    bool failed = false;  ///< at a frame or a picture
  };

  template <class Call>
  Result<void> until_one_fails(const Call& call) {
    for (const Watching& one : watching_)
      if (Result<void> done = call(*one.observer); !done) return done;
    return {};
  }
  /// `call` takes an observer and may throw. `failed_too`: those that failed before are called.
  template <class Call>
  Result<void> each(double time, bool failed_too, const Call& call);

  std::vector<Watching> watching_;
  std::vector<FailureReport> failures_;
};

}  // namespace viscera
