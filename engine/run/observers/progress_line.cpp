#include "engine/run/observers/progress_line.h"

namespace viscera {

Result<void> ProgressLine::open(const std::filesystem::path&) {
  bar_.emplace("simulating");
  if (frames_ > 0) bar_->update(0.0, "stepping");
  return {};
}

void ProgressLine::add_frame(const World& world) {
  // That the last frame is done the end of the run says.
  if (world.frame() < frames_)
    bar_->update(static_cast<double>(world.frame()) / static_cast<double>(frames_), "stepping");
}

Result<void> ProgressLine::close(const World&) {
  bar_.reset();
  return {};
}

}  // namespace viscera
