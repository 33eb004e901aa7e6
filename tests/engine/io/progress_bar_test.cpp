#include "engine/io/progress_bar.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <functional>

#include "engine/io/interrupt.h"

namespace viscera {
namespace {

/// What `use` prints on a bar whose clock it drives.
std::string printed(bool terminal, const std::function<void(ProgressBar&, double& clock)>& use) {
  char* text = nullptr;
  std::size_t size = 0;
  std::FILE* stream = open_memstream(&text, &size);
  double clock = 0.0;
  {
    ProgressBar bar("liver", stream, terminal, [&clock] { return clock; });
    use(bar, clock);
  }
  std::fclose(stream);
  std::string result(text, size);
  std::free(text);
  return result;
}

TEST(ProgressBar, WritesALineATenthInALog) {
  const std::string text = printed(false, [](ProgressBar& bar, double& clock) {
    for (int i = 0; i <= 1000; ++i) {
      clock = 0.02 * i;
      bar.update(i / 1000.0, "factoring");
    }
  });
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 11);
  EXPECT_EQ(text.find('\r'), std::string::npos);
  EXPECT_NE(text.find("liver  50 % factoring, 10 s left\n"), std::string::npos) << text;
  EXPECT_TRUE(text.ends_with("liver 100 % factoring, took 20 s\n")) << text;
}

TEST(ProgressBar, UpdatesOneLineOnATerminal) {
  const std::string text = printed(true, [](ProgressBar& bar, double& clock) {
    for (int i = 0; i <= 1000; ++i) {
      clock = 1e-3 * i;
      bar.update(i / 1000.0, "factoring");
    }
  });
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1);
  EXPECT_LE(std::count(text.begin(), text.end(), '\r'), 12);
  EXPECT_NE(text.find("[###############...............]  50 % factoring, 1 s left"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("100 %"), std::string::npos);
}

TEST(ProgressBar, OnATerminalIsNeverWiderThanIt) {
  const std::string text =
      printed(true, [](ProgressBar& bar, double&) { bar.update(0.5, std::string(500, 'x')); });
  EXPECT_LT(text.size(), 100u);
}

TEST(ProgressBar, BearsAbsurdFractions) {
  const std::string text = printed(false, [](ProgressBar& bar, double&) {
    bar.update(-3.0, "a");
    bar.update(0.0 / 0.0, "a");
    bar.update(7.0, "a");
    bar.update(0.2, "a");
  });
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 2);
}

TEST(ProgressBar, TellsTheWorkToStopAfterCtrlC) {
  printed(false, [](ProgressBar& bar, double&) {
    const Progress progress = bar.progress();
    install_interrupt_handler();
    EXPECT_TRUE(progress(0.1, "factoring"));
    std::raise(SIGINT);
    EXPECT_FALSE(progress(0.2, "factoring"));
    remove_interrupt_handler();
  });
}

TEST(DurationText, ReadsLikeSpeech) {
  EXPECT_EQ(duration_text(4.4), "4 s");
  EXPECT_EQ(duration_text(125.0), "2 min 05 s");
  EXPECT_EQ(duration_text(3780.0), "1 h 03 min");
}

}  // namespace
}  // namespace viscera
