#include "engine/run/observers/pass_series.h"

#include <fmt/format.h>

#include "engine/io/atomic_file.h"

namespace viscera {

Result<void> PassSeries::open(const std::filesystem::path& folder) {
  folder_ = folder / "passes";
  return check_out_folder(folder_);
}

Result<void> PassSeries::add_picture(FrameViews& views) {
  const auto shot = views.shot();
  if (!shot) return std::unexpected(shot.error());
  writer_.write(folder_ / fmt::format("{:04}.exr", views.number()), shot->passes,
                pass_context(shot->view, scene_, views.world().time(), with_smoke_));
  return {};
}

Result<void> PassSeries::close(const World&) {
  return writer_.finish();
}

Result<void> PassSeries::save_state(ByteWriter&) {
  return writer_.finish();
}

}  // namespace viscera
