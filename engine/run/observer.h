// What a run is watched for: its film, its volumes, its curves, its measures. The step knows no
// observer; observers know neither each other nor who comes first.
#pragma once

#include <filesystem>
#include <string>
#include <utility>

#include "engine/io/report.h"
#include "engine/run/frame_views.h"
#include "engine/simulation/world.h"
#include "engine/simulator/build.h"
#include "kernels/base/archive.h"
#include "kernels/base/result.h"

namespace viscera {

/// Looks at a world from frame to frame and makes a file, or a part of the report, of what it saw.
/// What is dear to make and wanted by several (grids of smoke, the picture) it asks of FrameViews.
///
/// Calls come as: open, then begin or load_state, then add_frame after every frame of simulation
/// with add_picture at the times of pictures, then close, describe, present. A phase has called all
/// observers before the next one starts. One that has failed at a frame sees no further one, but is
/// closed: close() keeps what it has.
class Observer {
 public:
  /// Which pictures' times it is called at.
  enum class Looks {
    kNever,
    kWanted,  ///< those that the person asked for (--snapshots), or all
    kAlways
  };

  /// `name`: of its part in a checkpoint; empty: it has none. `stage`: what its work for pictures
  /// is counted as.
  explicit Observer(std::string name, Looks looks = Looks::kNever,
                    RunStage stage = RunStage::kRecord)
      : name_(std::move(name)), looks_(looks), stage_(stage) {}
  virtual ~Observer() = default;
  Observer(const Observer&) = delete;
  Observer& operator=(const Observer&) = delete;

  const std::string& name() const { return name_; }
  Looks looks() const { return looks_; }
  RunStage stage() const { return stage_; }

  /// The run's folder, from which older files have gone. Makes subfolders.
  virtual Result<void> open(const std::filesystem::path&) { return {}; }
  /// A run from its start; begins files.
  virtual Result<void> begin() { return {}; }

  /// After every frame. What goes wrong with a file is kept for status().
  virtual void add_frame(const World&) {}
  virtual Result<void> add_picture(FrameViews&) { return {}; }
  /// What has gone wrong since it began, without waiting. Asked after every frame.
  virtual Result<void> status() const { return {}; }

  /// Ends its files; the world is as after the last frame. Whatever went wrong before, here or
  /// elsewhere, what it has is made a file as far as it goes.
  virtual Result<void> close(const World&) { return {}; }
  /// Fills in its part of the report, whose organs, times and features' sections are known; what it
  /// adds to those goes into sections of the same keys.
  virtual void describe(const World&, RunReport&) const {}
  /// The report is whole, every file is closed.
  virtual Result<void> present(const RunReport&) { return {}; }

  /// All that it needs to go on from here in another process, for which the files that it refers to
  /// are on the disk.
  virtual Result<void> save_state(ByteWriter& writer) = 0;
  /// In place of begin(). Fails for what can't be its state in this scene; it's not to be used
  /// then.
  virtual Result<void> load_state(ByteReader& reader) = 0;

 private:
  std::string name_;
  Looks looks_;
  RunStage stage_;
};

/// A state with what it consists of, so that load_whole() takes no other's bytes for it.
template <class State>
Result<void> save_whole(ByteWriter& writer, const State& state) {
  write(writer, layout_of<State>());
  write(writer, state);
  return {};
}

/// Reads such a state to its last byte.
template <class State>
Result<void> load_whole(ByteReader& reader, State& state) {
  std::string layout;
  read(reader, layout);
  if (reader.failed() || layout != layout_of<State>())
    return failure("found a layout " + layout + ", expected " + layout_of<State>());
  read(reader, state);
  if (reader.failed() || !reader.at_end()) return failure("expected other contents");
  return {};
}

/// One that keeps nothing from frame to frame.
class StatelessObserver : public Observer {
 public:
  using Observer::Observer;
  Result<void> save_state(ByteWriter&) override { return {}; }
  Result<void> load_state(ByteReader& reader) override {
    if (!reader.at_end()) return failure("expected it empty");
    return {};
  }
};

}  // namespace viscera
