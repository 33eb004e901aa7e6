// What moved the tools, for --replay.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "engine/io/atomic_file.h"
#include "engine/run/observer.h"

namespace viscera {

/// Writes simulator/controls_file.h; the file takes its name when the run ends.
class ControlsRecorder : public Observer {
 public:
  explicit ControlsRecorder(std::filesystem::path file)
      : Observer("controls"), file_(std::move(file)) {}

  Result<void> begin() override;
  void add_frame(const World& world) override;
  Result<void> status() const override { return out_->status(); }
  Result<void> close(const World& world) override;
  Result<void> save_state(ByteWriter& writer) override;
  Result<void> load_state(ByteReader& reader) override;

 private:
  std::filesystem::path file_;
  std::optional<AtomicFile> out_;
};

}  // namespace viscera
