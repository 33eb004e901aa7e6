#include "engine/run/observers/sight.h"

#include <algorithm>
#include <nlohmann/json.hpp>

namespace viscera {
namespace {

constexpr double kHidden = 0.5;

}  // namespace

Result<void> Sight::add_picture(FrameViews& views) {
  const std::optional<CameraView> camera = views.camera();
  if (!camera) return {};
  state_.last = sight_of_view(views.world(), views.smoke(), *camera);
  state_.least = std::min(state_.least.value_or(1.0), *state_.last);
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
  if (state_.last)
    report.sections.push_back(
        report_section("smoke", {{"view_least", *state_.least}, {"view_at_end", *state_.last}}));
  const std::optional<double> share = time_in_smoke();
  if (!share) return;
  report.sections.push_back(report_section("smoke", {{"time_in_smoke", *share}}));
  report.sections.push_back(
      report_section("trainee", {{"time_in_smoke_s", *share * report.duration_s}}));
}

Result<void> Sight::save_state(ByteWriter& writer) {
  return save_whole(writer, state_);
}

Result<void> Sight::load_state(ByteReader& reader) {
  return load_whole(reader, state_);
}

}  // namespace viscera
