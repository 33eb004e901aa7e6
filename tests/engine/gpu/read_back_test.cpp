#include "engine/gpu/read_back.h"

#include <gtest/gtest.h>

#include <array>
#include <cstring>

#include "engine/gpu/egl_context.h"

namespace viscera {
namespace {

TEST(ReadBack, GivesThePartsThatWereStartedAtTheirPlacesFrameAfterFrame) {
  const auto context = EglContext::create();
  if (!context) GTEST_SKIP() << context.error().text();
  Buffer buffer;
  ReadBack read_back(6 * sizeof(float));
  ASSERT_NE(read_back.data(), nullptr);
  for (int frame = 0; frame < 3; ++frame) {
    std::array<float, 6> values{};
    for (std::size_t i = 0; i < 6; ++i) values[i] = static_cast<float>(10 * frame) + i;
    buffer.upload(std::span<const float>(values));
    read_back.start(buffer, 0, 2 * sizeof(float), 4 * sizeof(float));
    read_back.start(buffer, 4 * sizeof(float), 2 * sizeof(float), 0);
    read_back.submit();
    ASSERT_TRUE(read_back.wait());
    std::array<float, 6> read{};
    std::memcpy(read.data(), read_back.data(), sizeof read);
    for (const std::size_t i : {0u, 1u, 4u, 5u}) EXPECT_EQ(read[(i + 4) % 8], values[i]) << frame;
  }
  EXPECT_FALSE(read_back.wait()) << "nothing is on its way";
}

}  // namespace
}  // namespace viscera
