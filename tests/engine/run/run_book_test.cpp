#include "engine/run/run_book.h"

#include <gtest/gtest.h>

#include "engine/simulator/build.h"

namespace viscera {
namespace {

constexpr FrameFlag kSparks{"sparks", "it sparked: less power"};
constexpr FrameFlag kHoles{"holes", "it leaks: mend it"};
const std::vector<FrameFlag> kFlags = {kSparks, kHoles};

Trace stages() {
  return Trace(stage_names());
}

TEST(RunBook, GoesOnWithFlagsTimeAndTheTraceOfWhatWasBefore) {
  Trace before = stages();
  const auto now = Trace::Clock::now();
  before.add(stage_index(RunStage::kDraw), 2, now, now + std::chrono::milliseconds(5));
  const RunOptions options;
  RunBook book_before;
  book_before.wall_s = 12.5;
  book_before.flags.raise(kHoles);
  book_before.flags.raise(kSparks);
  const CheckpointPart part = book_part(book_before, before, options);
  RunBook book;
  Trace after = stages();
  const Result<void> loaded = load_book(part, options, kFlags, book, after);
  ASSERT_TRUE(loaded) << loaded.error().text();
  EXPECT_EQ(book.flags, book_before.flags);
  EXPECT_EQ(book.wall_s, 12.5);
  ASSERT_EQ(after.size(), 1u);
  EXPECT_EQ(after.events()[0].frame, 2u);
  EXPECT_EQ(after.events()[0].duration, 5000000);
  const auto later = Trace::Clock::now();
  after.add(stage_index(RunStage::kDraw), 4, later, later);
  EXPECT_GE(after.events()[1].start, after.events()[0].start + after.events()[0].duration);
}

TEST(RunBook, OtherOptionsAreRefusedWithBoth) {
  RunOptions options;
  const CheckpointPart part = book_part({}, stages(), options);
  options.width = 640;
  options.height = 360;
  RunBook book;
  Trace trace = stages();
  const Result<void> refused = load_book(part, options, kFlags, book, trace);
  ASSERT_FALSE(refused);
  for (const char* words : {"found one of a run with pictures of 1280 x 720",
                            "expected pictures "
                            "of 640 x 360"})
    EXPECT_NE(refused.error().text().find(words), std::string::npos) << refused.error().text();
  // What no file depends on may change.
  options = {};
  options.quiet = true;
  options.threads = 1;
  EXPECT_TRUE(load_book(part, options, kFlags, book, trace));
}

TEST(RunBook, AFlagThatNoFeatureRaisesIsRefusedByItsName) {
  RunBook book;
  book.flags.raise(kHoles);
  Trace trace = stages();
  const CheckpointPart part = book_part(book, trace, {});
  const Result<void> refused = load_book(part, {}, std::vector<FrameFlag>{kSparks}, book, trace);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().text().find("found the flag \"holes\""), std::string::npos)
      << refused.error().text();
}

TEST(RunBook, CutOffAtAnyLengthIsRefused) {
  const RunOptions options;
  Trace before = stages();
  const auto now = Trace::Clock::now();
  before.add(0, 1, now, now);
  const CheckpointPart whole = book_part({}, before, options);
  for (std::size_t length = 0; length < whole.bytes.size(); ++length) {
    CheckpointPart cut = whole;
    cut.bytes.resize(length);
    RunBook book;
    Trace trace = stages();
    EXPECT_FALSE(load_book(cut, options, kFlags, book, trace)) << length;
  }
}

TEST(RunBook, EventsOfUnknownStagesAreRefused) {
  Trace before({"one", "two"});
  const auto now = Trace::Clock::now();
  before.add(1, 1, now, now);
  RunBook book;
  Trace trace({"one"});
  EXPECT_FALSE(load_book(book_part({}, before, {}), {}, kFlags, book, trace));
  EXPECT_EQ(trace.size(), 0u);
}

}  // namespace
}  // namespace viscera
