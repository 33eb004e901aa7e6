#include "engine/io/base64.h"

#include <gtest/gtest.h>

namespace viscera {
namespace {

TEST(Base64, GivesTheStandardsOwnExamples) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
}

TEST(Base64, TakesEveryByte) {
  EXPECT_EQ(base64(std::string("\x00\xff\xfb\xef", 4)), "AP/77w==");
}

}  // namespace
}  // namespace viscera
