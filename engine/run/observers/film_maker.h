// film.mp4: every picture, 30 a second.
#pragma once

#include <memory>

#include "engine/io/film.h"
#include "engine/run/observer.h"

namespace viscera {

inline constexpr const char* kFilmName = "film.mp4";

/// An encoder can't be stopped and taken up again by another process. One that goes on starts anew
/// with the pictures in frames/ up to there, which are the same pixels, so that what is decoded in
/// the end is the same too.
class FilmMaker : public Observer {
 public:
  /// Starts the encoder: whoever waits for minutes of preparation wants to know before whether
  /// there is one. `folder`: the run's.
  static Result<std::unique_ptr<FilmMaker>> start(const std::filesystem::path& folder, int width,
                                                  int height);

  Result<void> add_picture(FrameViews& views) override;
  /// Shorter than two frames, or stopped before: there is nothing to film. Where the encoder has
  /// gone, or its disk was full, another one makes the film of the pictures in frames/ up to there;
  /// fails where that can't be either.
  Result<void> close(const World& world) override;
  Result<void> save_state(ByteWriter& writer) override;
  Result<void> load_state(ByteReader& reader) override;

 private:
  FilmMaker(std::filesystem::path folder, int width, int height)
      : Observer("film", Looks::kWanted, RunStage::kEncode),
        folder_(std::move(folder)),
        width_(width),
        height_(height) {}
  Result<void> film_again();
  /// Adds the pictures in frames/, in their order, up to the first that isn't there; fails where
  /// that is one of the first `least`.
  Result<void> add_frames(Film& film, std::uint64_t least) const;

  std::filesystem::path folder_;
  int width_, height_;
  std::unique_ptr<Film> film_;
  std::uint64_t pictures_ = 0;
};

}  // namespace viscera
