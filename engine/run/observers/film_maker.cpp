#include "engine/run/observers/film_maker.h"

#include "engine/io/png_file.h"
#include "engine/run/observers/frame_pictures.h"

namespace viscera {

Result<std::unique_ptr<FilmMaker>> FilmMaker::start(const std::filesystem::path& folder, int width,
                                                    int height) {
  auto film = Film::start(folder / kFilmName, width, height);
  if (!film) return std::unexpected(film.error());
  return std::unique_ptr<FilmMaker>(new FilmMaker(folder, *std::move(film)));
}

Result<void> FilmMaker::add_picture(FrameViews& views) {
  const auto shot = views.shot();
  if (!shot) return std::unexpected(shot.error());
  ++pictures_;
  return film_->add(shot->picture.rgb);
}

Result<void> FilmMaker::close(const World&) {
  if (pictures_ == 0) {
    film_.reset();
    return {};
  }
  return film_->finish();
}

Result<void> FilmMaker::save_state(ByteWriter& writer) {
  return save_whole(writer, pictures_);
}

Result<void> FilmMaker::load_state(ByteReader& reader) {
  if (auto whole = load_whole(reader, pictures_); !whole) return whole;
  // All pictures are filmed, so that they are numbered without a gap.
  for (std::uint64_t number = 0; number < pictures_; ++number) {
    const auto picture = read_png(frame_file(folder_, number));
    if (!picture) return std::unexpected(picture.error());
    if (auto added = film_->add(picture->rgb); !added) return added;
  }
  return {};
}

}  // namespace viscera
