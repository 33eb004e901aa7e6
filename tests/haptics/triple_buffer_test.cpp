#include "haptics/triple_buffer.h"

#include <gtest/gtest.h>

#include <thread>

namespace viscera {
namespace {

TEST(TripleBuffer, NothingIsThereBeforeTheFirstPublish) {
  TripleBuffer<int> buffer;
  EXPECT_FALSE(buffer.update());
}

TEST(TripleBuffer, TheReaderGetsTheNewestAndOnlyOnce) {
  TripleBuffer<int> buffer;
  for (int i = 1; i <= 5; ++i) {
    buffer.back() = i;
    buffer.publish();
  }
  EXPECT_TRUE(buffer.update());
  EXPECT_EQ(buffer.front(), 5);
  EXPECT_FALSE(buffer.update());
  EXPECT_EQ(buffer.front(), 5);
}

TEST(TripleBuffer, IsRestoredWithWhatIsPublishedAndNotYetTaken) {
  TripleBuffer<int> buffer, other;
  for (int i = 1; i <= 4; ++i) {
    buffer.back() = i;
    buffer.publish();
    if (i == 3) buffer.update();
  }
  other.back() = 9;
  other.publish();
  ASSERT_TRUE(TripleBuffer<int>::fits(buffer.state()));
  other.restore(buffer.state());
  for (TripleBuffer<int>* one : {&buffer, &other}) {
    EXPECT_EQ(one->front(), 3);
    EXPECT_TRUE(one->update());
    EXPECT_EQ(one->front(), 4);
    EXPECT_FALSE(one->update());
  }
  EXPECT_EQ(buffer.back(), other.back());
  TripleBuffer<int>::State state = buffer.state();
  state.back = state.front;
  EXPECT_FALSE(TripleBuffer<int>::fits(state));
}

TEST(TripleBuffer, AReaderNeverSeesAHalfWrittenValueAndNeverGoesBack) {
  struct Pair {
    std::uint64_t a = 0, b = 0;
  };
  TripleBuffer<Pair> buffer;
  constexpr std::uint64_t kWrites = 200'000;
  std::thread writer([&] {
    for (std::uint64_t i = 1; i <= kWrites; ++i) {
      buffer.back() = {i, ~i};
      buffer.publish();
    }
  });
  std::uint64_t last = 0;
  while (last < kWrites) {
    if (!buffer.update()) continue;
    const Pair pair = buffer.front();
    ASSERT_EQ(pair.b, ~pair.a);
    ASSERT_GT(pair.a, last);
    last = pair.a;
  }
  writer.join();
}

}  // namespace
}  // namespace viscera
