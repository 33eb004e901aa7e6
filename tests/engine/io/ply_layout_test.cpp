#include "engine/io/ply_layout.h"

#include <gtest/gtest.h>

#include <string>

namespace viscera::test {
namespace {

const std::string kVertices =
    "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
const std::string kFace = "element face 1\nproperty list uchar int vertex_indices\n";
const std::string kRows = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

std::string text(const std::string& header, const std::string& rows = kRows,
                 const std::string& format = "ascii") {
  return "ply\nformat " + format + " 1.0\n" + header + "end_header\n" + rows;
}

/// "": it is taken.
std::string refusal(const std::string& bytes) {
  const auto checked = check_ply("one.ply", bytes);
  return checked ? "" : checked.error().text();
}

TEST(PlyLayout, WhatTheHeaderPromisesIsThere) {
  EXPECT_EQ(refusal(text(kVertices + kFace)), "");
  EXPECT_EQ(refusal(text("comment by hand\nobj_info x\n" + kVertices + kFace)), "");
  std::string crlf;
  for (const char c : text(kVertices + kFace))
    crlf += c == '\n' ? std::string("\r\n") : std::string(1, c);
  EXPECT_EQ(refusal(crlf), "");
  const std::string binary(3 * 12, '\0');
  EXPECT_EQ(refusal(text(kVertices + kFace, binary + '\3' + std::string(12, '\0'),
                         "binary_little_endian")),
            "");
  const std::string wide = "element face 1\nproperty list uint32 int32 vertex_indices\n";
  EXPECT_EQ(
      refusal(text(kVertices + wide, binary + std::string("\0\0\0\3", 4) + std::string(12, '\0'),
                   "binary_big_endian")),
      "");
  EXPECT_EQ(refusal(text(kVertices + "element none 0\n" + kFace)), "");
}

TEST(PlyLayout, LinesThatNoHeaderHasAreNamedWithWhatWasExpected) {
  const auto expect_refused = [](const std::string& bytes, const std::string& words) {
    EXPECT_NE(refusal(bytes).find(words), std::string::npos) << refusal(bytes);
  };
  expect_refused("plx\n", "one.ply: found \"plx\" on line 1 of the header, expected ply");
  expect_refused("ply\nformat ascii 1.0\n",
                 "found the end of the file on line 2 of the header, expected end_header");
  expect_refused("ply\nformat ascii 2.0\nend_header\n",
                 "found \"format ascii 2.0\" on line 2 of the header");
  expect_refused("ply\nformat text 1.0\nend_header\n", "expected one format");
  expect_refused("ply\nformat ascii 1.0\nformat ascii 1.0\nend_header\n", "expected one format");
  expect_refused("ply\n" + kVertices + "end_header\n", "found no format");
  expect_refused(text("propelto fyrat z\n"),
                 "found \"propelto fyrat z\" on line 3 of the header, expected format, comment");
  expect_refused(text("element vertex -3\n"), "expected element, a name and how many there are");
  expect_refused(text("element vertex 3 3\n"), "expected element, a name and how many");
  expect_refused(text("property float x\n"), "expected property, a type");
  expect_refused(text(kVertices + "property real w\n"), "found \"property real w\"");
  expect_refused(text(kVertices + "property list float int w\n"), "property list, two types");
  expect_refused(text(kFace), "found no x of vertices");
  expect_refused(text("element vertex 3\nproperty list uchar float x\n"), "found no x of vertices");
  expect_refused(text(kVertices + "element many 4000000000\n"),
                 "found 4000000000 of the element many without a property");
  std::string wide = kVertices;
  for (int i = 0; i < 300; ++i) wide += "property float a\n";
  expect_refused(text(wide), "at most 256 properties");
  std::string many = kVertices;
  for (int i = 0; i < 70; ++i) many += "element a 0\n";
  expect_refused(text(many), "at most 64 elements");
}

TEST(PlyLayout, TextOfTheFileIsShownShortAndHarmless) {
  const std::string told = refusal("ply\n\x1b[2J" + std::string(100000, 'x') + "\n");
  EXPECT_EQ(told.find('\x1b'), std::string::npos);
  EXPECT_LT(told.size(), 250u);
}

TEST(PlyLayout, RowsThatAreMissingAreCounted) {
  for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    const std::string told = refusal(text(kVertices + kFace, "", format));
    EXPECT_NE(told.find("one.ply: found 0 whole rows of the element vertex, expected the 3"),
              std::string::npos)
        << told;
  }
  const std::string two(2 * 12 + 5, '\0');
  EXPECT_NE(refusal(text(kVertices, two, "binary_little_endian")).find("found 2 whole rows"),
            std::string::npos);
  // A list whose length is beyond the file, or no number.
  const std::string binary(3 * 12, '\0');
  EXPECT_NE(refusal(text(kVertices + kFace, binary + "\xff", "binary_little_endian"))
                .find("found 0 whole rows of the element face"),
            std::string::npos);
  EXPECT_NE(refusal(text(kVertices + kFace, "0 0 0 1 0 0 0 1 0 x 0 1 2")).find("element face"),
            std::string::npos);
  EXPECT_NE(refusal(text(kVertices + kFace, "0 0 0 1 0 0 0 1 0 999999999999 0 1 2")).find("face"),
            std::string::npos);
  EXPECT_NE(refusal(text("element vertex 18446744073709551615\nproperty float x\nproperty float y\n"
                         "property double z\n",
                         binary, "binary_little_endian"))
                .find("found 2 whole rows"),
            std::string::npos);
}

TEST(PlyLayout, EveryBeginningOfAFileIsRefused) {
  const std::string whole = text(kVertices + kFace);
  for (std::size_t size = 0; size + 2 < whole.size(); ++size)
    EXPECT_NE(refusal(whole.substr(0, size)), "") << size;
}

}  // namespace
}  // namespace viscera::test
