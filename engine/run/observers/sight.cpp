#include "engine/run/observers/sight.h"

namespace viscera {
namespace {

constexpr double kHidden = 0.5;

}  // namespace

Result<void> Sight::add_picture(FrameViews& views) {
  const std::optional<CameraView> camera = views.camera();
  if (!camera) return {};
  const std::optional<double> seen = sight_of_tips(views.world(), views.smoke(), *camera);
  if (!seen) return {};
  ++state_.looks;
  if (*seen < kHidden) ++state_.hidden;
  return {};
}

std::optional<double> Sight::time_in_smoke() const {
  if (state_.looks == 0) return {};
  return static_cast<double>(state_.hidden) / static_cast<double>(state_.looks);
}

void Sight::describe(const World&, RunReport& report) const {
  report.smoke.time_in_smoke = time_in_smoke();
  if (report.smoke.time_in_smoke)
    report.trainee.time_in_smoke = *report.smoke.time_in_smoke * report.duration_s;
}

Result<void> Sight::save_state(ByteWriter& writer) {
  return save_whole(writer, state_);
}

Result<void> Sight::load_state(ByteReader& reader) {
  return load_whole(reader, state_);
}

}  // namespace viscera
