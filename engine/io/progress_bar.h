// Progress of set-up and of a run for the person who waits: a bar on a terminal, a line each tenth
// in a log.
#pragma once

#include <cstdio>
#include <functional>
#include <string>
#include <string_view>

#include "kernels/base/progress.h"

namespace viscera {

class ProgressBar {
 public:
  using Clock = std::function<double()>;  ///< [s]

  /// On stderr, as a bar where that is a terminal.
  explicit ProgressBar(std::string title);
  ProgressBar(std::string title, std::FILE* stream, bool terminal, Clock clock);
  ~ProgressBar();  ///< ends the line that the bar stands on
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// `fraction` in [0, 1]; `what` is a short present participle.
  void update(double fraction, std::string_view what);
  /// For work that reports through Progress; says stop after Ctrl-C. Valid while this object lives.
  Progress progress();

 private:
  void draw(double fraction, std::string_view what, double now);

  std::string title_;
  std::FILE* stream_;
  bool terminal_;
  Clock clock_;
  double start_;            ///< [s]
  double drawn_at_ = -1.0;  ///< [s]; negative: never
  int drawn_tenth_ = -1;
  double drawn_fraction_ = -1.0;
};

/// "4 s", "2 min 05 s", "1 h 03 min".
std::string duration_text(double seconds);

}  // namespace viscera
