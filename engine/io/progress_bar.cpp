#include "engine/io/progress_bar.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "engine/io/interrupt.h"

namespace viscera {
namespace {

constexpr int kCells = 30;
constexpr double kRedraw = 0.1;          // [s]
constexpr double kTrustEstimate = 0.02;  // below this share the remaining time is a guess

double steady_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

int terminal_columns(std::FILE* stream) {
  winsize size = {};
  if (ioctl(fileno(stream), TIOCGWINSZ, &size) == 0 && size.ws_col > 0) return size.ws_col;
  return 80;
}

}  // namespace

std::string duration_text(double seconds) {
  const long total = std::lround(std::max(0.0, seconds));
  char text[48];
  if (total < 60) {
    std::snprintf(text, sizeof text, "%ld s", total);
  } else if (total < 3600) {
    std::snprintf(text, sizeof text, "%ld min %02ld s", total / 60, total % 60);
  } else {
    std::snprintf(text, sizeof text, "%ld h %02ld min", total / 3600, total % 3600 / 60);
  }
  return text;
}

ProgressBar::ProgressBar(std::string title)
    : ProgressBar(std::move(title), stderr, isatty(STDERR_FILENO) == 1, steady_seconds) {}

ProgressBar::ProgressBar(std::string title, std::FILE* stream, bool terminal, Clock clock)
    : title_(std::move(title)),
      stream_(stream),
      terminal_(terminal),
      clock_(std::move(clock)),
      start_(clock_()) {}

ProgressBar::~ProgressBar() {
  if (terminal_ && drawn_at_ >= 0.0) std::fputc('\n', stream_);
}

void ProgressBar::update(double fraction, std::string_view what) {
  fraction = std::isfinite(fraction) ? std::clamp(fraction, 0.0, 1.0) : 0.0;
  const double now = clock_();
  const bool finished = fraction >= 1.0 && drawn_fraction_ < 1.0;
  if (terminal_) {
    if (drawn_at_ >= 0.0 && now - drawn_at_ < kRedraw && !finished) return;
  } else {
    // A hair more, so that a sum of tenths counts as the tenth it stands for.
    const int tenth = static_cast<int>(fraction * 10.0 + 1e-9);
    if (tenth <= drawn_tenth_) return;
    drawn_tenth_ = tenth;
  }
  draw(fraction, what, now);
}

void ProgressBar::draw(double fraction, std::string_view what, double now) {
  const double elapsed = now - start_;
  std::string line = title_ + " ";
  char percent[16];
  std::snprintf(percent, sizeof percent, "%3d %%", static_cast<int>(fraction * 100.0 + 1e-9));
  if (terminal_) {
    const int full = static_cast<int>(fraction * kCells + 1e-9);
    line += "[" + std::string(full, '#') + std::string(kCells - full, '.') + "] ";
  }
  line += percent;
  if (!what.empty()) line += " " + std::string(what);
  if (fraction >= 1.0) {
    line += ", took " + duration_text(elapsed);
  } else if (fraction >= kTrustEstimate) {
    line += ", " + duration_text(std::ceil(elapsed * (1.0 - fraction) / fraction - 1e-9)) + " left";
  }
  if (terminal_) {
    // A wrapped line couldn't be overwritten by the next one.
    const auto columns = static_cast<std::size_t>(terminal_columns(stream_));
    if (line.size() >= columns) line.resize(columns - 1);
    std::fprintf(stream_, "\r%s\x1b[K", line.c_str());
  } else {
    std::fprintf(stream_, "%s\n", line.c_str());
  }
  std::fflush(stream_);
  drawn_at_ = now;
  drawn_fraction_ = fraction;
}

Progress ProgressBar::progress() {
  return [this](double fraction, std::string_view what) {
    update(fraction, what);
    return !interrupted();
  };
}

}  // namespace viscera
