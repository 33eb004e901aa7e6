#include "engine/run/observers/frame_pictures.h"

#include <fmt/format.h>

#include "engine/io/atomic_file.h"
#include "engine/io/png_file.h"

namespace viscera {

std::filesystem::path frame_file(const std::filesystem::path& run_folder, std::uint64_t number) {
  return run_folder / "frames" / fmt::format("{:04}.png", number);
}

Result<void> FramePictures::open(const std::filesystem::path& folder) {
  folder_ = folder;
  return check_out_folder(folder / "frames");
}

Result<void> FramePictures::add_picture(FrameViews& views) {
  const auto shot = views.shot();
  if (!shot) return std::unexpected(shot.error());
  const Picture& picture = shot->picture;
  auto written =
      write_png(frame_file(folder_, views.number()), picture.width, picture.height, picture.rgb);
  if (written) ++pictures_;
  return written;
}

void FramePictures::describe(const World&, RunReport& report) const {
  report.pictures = pictures_;
}

Result<void> FramePictures::save_state(ByteWriter& writer) {
  return save_whole(writer, pictures_);
}

Result<void> FramePictures::load_state(ByteReader& reader) {
  return load_whole(reader, pictures_);
}

}  // namespace viscera
