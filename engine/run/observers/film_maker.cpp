#include "engine/run/observers/film_maker.h"

#include "engine/io/png_file.h"
#include "engine/run/observers/frame_pictures.h"

namespace viscera {

Result<std::unique_ptr<FilmMaker>> FilmMaker::start(const std::filesystem::path& folder, int width,
                                                    int height) {
  auto film = Film::start(folder / kFilmName, width, height);
  if (!film) return std::unexpected(film.error());
  std::unique_ptr<FilmMaker> maker(new FilmMaker(folder, width, height));
  maker->film_ = *std::move(film);
  return maker;
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
  if (film_->finish()) return {};
  film_.reset();  // what there is of its file leaves its room to the next
  return film_again();
}

Result<void> FilmMaker::film_again() {
  auto film = Film::start(folder_ / kFilmName, width_, height_);
  if (!film) return std::unexpected(film.error());
  if (auto added = add_frames(**film, 1); !added) return added;
  return (*film)->finish();
}

Result<void> FilmMaker::add_frames(Film& film, std::uint64_t least) const {
  std::error_code error;
  for (std::uint64_t number = 0; number < pictures_; ++number) {
    const std::filesystem::path file = frame_file(folder_, number);
    if (number >= least && !std::filesystem::exists(file, error)) break;
    const auto picture = read_png(file);
    if (!picture) return std::unexpected(picture.error());
    if (auto added = film.add(picture->rgb); !added) return added;
  }
  return {};
}

Result<void> FilmMaker::save_state(ByteWriter& writer) {
  return save_whole(writer, pictures_);
}

Result<void> FilmMaker::load_state(ByteReader& reader) {
  if (auto whole = load_whole(reader, pictures_); !whole) return whole;
  // All pictures are filmed, so that they are numbered without a gap.
  return add_frames(*film_, pictures_);
}

}  // namespace viscera
