// One observer that fails, or throws, and the others.
#include "engine/run/watch.h"

#include <gtest/gtest.h>

#include <new>
#include <stdexcept>

#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

/// What an observer was called for, letter by letter: f a frame, c the end, d report, p page.
struct Calls {
  std::string text;
};

class Scripted : public StatelessObserver {
 public:
  Scripted(std::string name, Calls& calls, std::string fails)
      : StatelessObserver(std::move(name)), calls_(calls), fails_(std::move(fails)) {}

  void add_frame(const World&) override {
    calls_.text += 'f';
    if (fails_ == "throws at a frame") throw std::runtime_error("thrown");
    if (fails_ == "runs out of memory") throw std::bad_alloc();
  }
  Result<void> status() const override {
    if (fails_ == "fails at a frame") return failure("a.csv: can't be written");
    return {};
  }
  Result<void> close(const World&) override {
    calls_.text += 'c';
    if (fails_ == "fails at the end") return failure("film.mp4: can't be written");
    return {};
  }
  void describe(const World&, RunReport&) const override {
    calls_.text += 'd';
    if (fails_ == "throws at the report") throw 5;
  }
  Result<void> present(const RunReport&) override {
    calls_.text += 'p';
    return {};
  }

 private:
  Calls& calls_;
  std::string fails_;
};

struct Case {
  const char* fails;
  const char* why;
  const char* calls;  // of two frames and the end
};

class WatchOfTwo : public testing::TestWithParam<Case> {};

TEST_P(WatchOfTwo, TheOtherOneSeesTheWholeRunAndTheFailureIsKept) {
  const auto world = build(soft_ball_scene(10e-3, 6e-3));
  Calls broken, sound;
  Watch watch;
  watch.add(std::make_unique<Scripted>("broken", broken, GetParam().fails));
  watch.add(std::make_unique<Scripted>("sound", sound, ""));
  RunReport report;
  watch.add_frame(*world);
  watch.add_frame(*world);
  watch.close(*world);
  watch.describe(*world, report);
  watch.present(report);
  EXPECT_EQ(sound.text, "ffcdp");
  EXPECT_EQ(broken.text, GetParam().calls);
  ASSERT_EQ(watch.failures().size(), 1u);
  EXPECT_EQ(watch.failures()[0].what, "broken");
  EXPECT_EQ(watch.failures()[0].why, GetParam().why);
}

INSTANTIATE_TEST_SUITE_P(
    Failing, WatchOfTwo,
    testing::Values(Case{"fails at a frame", "a.csv: can't be written", "fcdp"},
                    Case{"throws at a frame", "internal error: thrown", "fcdp"},
                    Case{"runs out of memory", "out of memory", "fcdp"},
                    Case{"fails at the end", "film.mp4: can't be written", "ffcdp"},
                    Case{"throws at the report", "internal error", "ffcdp"}),
    [](const auto& one) {
      std::string name = one.param.fails;
      std::erase(name, ' ');
      return name;
    });

TEST(Watch, TellsWhatSeveralFailWithOnce) {
  const auto world = build(soft_ball_scene(10e-3, 6e-3));
  Calls calls;
  Watch watch;
  watch.add(std::make_unique<Scripted>("film", calls, "fails at a frame"));
  watch.add(std::make_unique<Scripted>("frames", calls, "fails at a frame"));
  watch.add_frame(*world);
  ASSERT_EQ(watch.failures().size(), 1u);
  EXPECT_EQ(watch.failures()[0].what, "film");
}

TEST(Watch, AProgressLineThatFailsIsNoFailureOfTheRun) {
  const auto world = build(soft_ball_scene(10e-3, 6e-3));
  Calls calls;
  Watch watch;
  watch.add(std::make_unique<Scripted>("", calls, "throws at a frame"));
  watch.add_frame(*world);
  EXPECT_TRUE(watch.failures().empty());
}

}  // namespace
}  // namespace viscera::test
