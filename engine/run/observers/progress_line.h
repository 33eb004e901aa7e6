// The progress of a run for the person who waits.
#pragma once

#include <optional>

#include "engine/io/progress_bar.h"
#include "engine/run/observer.h"

namespace viscera {

class ProgressLine : public StatelessObserver {
 public:
  explicit ProgressLine(std::uint64_t frames) : StatelessObserver(""), frames_(frames) {}

  Result<void> open(const std::filesystem::path& folder) override;
  void add_frame(const World& world) override;
  Result<void> close(const World& world) override;

 private:
  std::uint64_t frames_;  ///< of the whole run
  std::optional<ProgressBar> bar_;
};

}  // namespace viscera
