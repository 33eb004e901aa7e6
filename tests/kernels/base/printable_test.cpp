#include "kernels/base/printable.h"

#include <gtest/gtest.h>

namespace viscera {
namespace {

TEST(Printable, LeavesTextAsItIs) {
  EXPECT_EQ(printable("liver.obj: 3 °C, 肝\n\tnext"), "liver.obj: 3 °C, 肝\n\tnext");
  EXPECT_EQ(printable(""), "");
  EXPECT_EQ(printable("a clef: \xf0\x9d\x84\x9e"), "a clef: \xf0\x9d\x84\x9e");  // of four bytes
}

TEST(Printable, TakesTheirPowerFromControlCharacters) {
  EXPECT_EQ(printable("\x1b[2J\x07\r\x7f"), "\\x1b[2J\\x07\\x0d\\x7f");
  EXPECT_EQ(printable(std::string_view("a\0b", 3)), "a\\x00b");
  EXPECT_EQ(printable("\xc2\x9b"
                      "31m"),
            "\\x9b31m");  // CSI in one character
}

TEST(Printable, ShowsWhatTurnsTheDirectionOfWriting) {
  EXPECT_EQ(printable("a\xe2\x80\xae"
                      "b"),
            "a\\u202eb");
  EXPECT_EQ(printable("\xef\xbb\xbf"), "\\ufeff");
  // Isolates, U+2066 to U+2069, and the characters beside them.
  EXPECT_EQ(printable("\xe2\x81\xa5\xe2\x81\xa6\xe2\x81\xa9\xe2\x81\xaa"),
            "\xe2\x81\xa5\\u2066\\u2069\xe2\x81\xaa");
}

TEST(Printable, ShowsBytesThatAreNoText) {
  EXPECT_EQ(printable("\xff\xc3"), "\\xff\\xc3");
  EXPECT_EQ(printable("\xc0\xaf"), "\\xc0\\xaf");                    // overlong
  EXPECT_EQ(printable("\xed\xa0\x80"), "\\xed\\xa0\\x80");           // a surrogate
  EXPECT_EQ(printable("\xf4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80");  // beyond Unicode
  EXPECT_EQ(printable("\xe8\x82"), "\\xe8\\x82");                    // cut off
}

TEST(Shortened, EndsAtAWholeCharacter) {
  EXPECT_EQ(shortened("liver", 5), "liver");
  EXPECT_EQ(shortened("livers", 5), "liver...");
  EXPECT_EQ(shortened("ab肝", 4), "ab...");
}

}  // namespace
}  // namespace viscera
