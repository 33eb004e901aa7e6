#include "engine/run/observers/smoke_series.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "engine/features/smoke/smoke.h"
#include "engine/io/atomic_file.h"

namespace viscera {

Result<void> SmokeSeries::open(const std::filesystem::path& folder) {
  folder_ = folder / "smoke";
  return check_out_folder(folder_);
}

Result<void> SmokeSeries::add_picture(FrameViews& views) {
  const World& world = views.world();
  const std::span<const ShownSmoke> shown = views.smoke();
  const Pool<SmokeSource>& sources = world.all<SmokeSource>();
  for (std::size_t s = 0; s < sources.size(); ++s) {
    if (world.find<SmokeBody>(sources.owner(s))->volume.particles().size() == 0) continue;
    const std::string& name = sources[s].description.name;
    const std::filesystem::path folder = sources.size() == 1 ? folder_ : folder_ / name;
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    writer_.write(folder / fmt::format("{:04}.vdb", views.number()), shown[s].grid, world.time(),
                  name, scene_);
  }
  return {};
}

Result<void> SmokeSeries::close(const World&) {
  return writer_.finish();
}

SmokeSeries::State SmokeSeries::so_far() const {
  return {before_.written + static_cast<std::uint64_t>(writer_.written()),
          before_.seconds + writer_.seconds()};
}

void SmokeSeries::describe(const World&, RunReport& report) const {
  const State all = so_far();
  report.sections.push_back(
      report_section("smoke", {{"volumes", all.written}, {"writing_s", all.seconds}}));
}

Result<void> SmokeSeries::save_state(ByteWriter& writer) {
  if (auto written = writer_.finish(); !written) return written;
  return save_whole(writer, so_far());
}

Result<void> SmokeSeries::load_state(ByteReader& reader) {
  return load_whole(reader, before_);
}

}  // namespace viscera
