// The film of a run: raw frames piped into ffmpeg, which runs as a program of its own.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

#include "kernels/base/result.h"

namespace viscera {

/// An MP4 with H.264, yuv420p, BT.709. The file takes its name when it is finished; a film that is
/// dropped unfinished leaves nothing.
class Film {
 public:
  struct Settings {
    int frames_per_second = 30;
    /// An encoder that takes nothing for so long, or doesn't end, is given up.
    std::chrono::milliseconds patience = std::chrono::minutes(2);
  };
  /// Fails for odd sizes (yuv420p halves them), a folder that is missing, and where there is no
  /// ffmpeg on the PATH.
  static Result<std::unique_ptr<Film>> start(const std::filesystem::path& file, int width,
                                             int height, const Settings& settings);
  static Result<std::unique_ptr<Film>> start(const std::filesystem::path& file, int width,
                                             int height) {
    return start(file, width, height, Settings());
  }
  ~Film();
  Film(const Film&) = delete;
  Film& operator=(const Film&) = delete;

  /// 8-bit RGB, rows from the top. Fails, with ffmpeg's last words, when it has ended early; after
  /// that the film is lost.
  Result<void> add(std::span<const std::uint8_t> rgb);
  Result<void> finish();

 private:
  struct Data;
  explicit Film(std::unique_ptr<Data> data);
  std::unique_ptr<Data> data_;
};

}  // namespace viscera
