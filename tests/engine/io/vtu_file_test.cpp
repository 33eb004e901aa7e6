#include "engine/io/vtu_file.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/engine/io/file_text.h"
#include "tests/support/paths.h"
#include "tests/support/vtu_reader.h"

namespace viscera {
namespace {

using test::entries;
using test::read_vtu;
using test::TemporaryFolder;

/// A strip of `count` points: more than one block's bytes where there are many.
struct Strip {
  explicit Strip(int count) {
    for (int i = 0; i < count; ++i) {
      points.emplace_back(0.001f * static_cast<float>(i), static_cast<float>(i % 2), 0.25f);
      values.emplace_back(std::sin(static_cast<float>(i)), -1e-9f, 1e9f);
      if (i >= 2) triangles.push_back({i - 2, i - 1, i});
    }
  }
  std::vector<Vec3f> points, values;
  std::vector<std::array<int, 3>> triangles;
};

class Vtu : public testing::TestWithParam<int> {};

TEST_P(Vtu, ReadsBackAsItWasWritten) {
  const TemporaryFolder folder;
  const Strip strip(GetParam());
  ASSERT_TRUE(write_vtu(
      folder / "strip.vtu",
      {strip.points, strip.triangles, {{"displacement", strip.values}, {"force", strip.points}}}));
  const test::VtuContent read = read_vtu(folder / "strip.vtu");
  EXPECT_EQ(read.points, strip.points);
  EXPECT_EQ(read.triangles, strip.triangles);
  ASSERT_EQ(read.fields.size(), 2u);
  EXPECT_EQ(read.fields.at("displacement"), strip.values);
  EXPECT_EQ(read.fields.at("force"), strip.points);
  EXPECT_EQ(entries(folder / ""), 1) << "no temporary file stays";
}

// 65,536 points: connectivity and points end within a block, the vectors of 65,536 on its edge.
INSTANTIATE_TEST_SUITE_P(Points, Vtu, testing::Values(0, 3, 5000, 65536),
                         [](const auto& count) { return std::to_string(count.param); });

TEST(VtuFile, RefusesAFieldThatDoesntFitThePoints) {
  const TemporaryFolder folder;
  const Strip strip(5), other(4);
  const auto written =
      write_vtu(folder / "strip.vtu", {strip.points, strip.triangles, {{"force", other.values}}});
  ASSERT_FALSE(written);
  for (const char* part : {"strip.vtu", "4 values of force", "5 points"})
    EXPECT_NE(written.error().text().find(part), std::string::npos) << written.error().text();
}

TEST(VtuFile, IsRefusedWhereItCantBeWritten) {
  const TemporaryFolder folder;
  const Strip strip(5);
  EXPECT_FALSE(write_vtu(folder / "missing/strip.vtu", {strip.points, strip.triangles, {}}));
  EXPECT_FALSE(write_pvd(folder / "missing/strip.pvd", {}));
}

TEST(PvdFile, ListsPartsAndTimesAndEscapesNames) {
  const TemporaryFolder folder;
  const std::vector<PvdEntry> entries = {{0.05, 0, "liver", "liver/0001.vtu"},
                                         {0.1, 1, "a<b>&\"c\"", "c/0002.vtu"}};
  ASSERT_TRUE(write_pvd(folder / "organs.pvd", entries));
  const auto read = test::read_pvd(folder / "organs.pvd");
  ASSERT_EQ(read.size(), 2u);
  EXPECT_EQ(read[0].time, 0.05);
  EXPECT_EQ(read[0].file, "liver/0001.vtu");
  EXPECT_EQ(read[1].part, 1);
  EXPECT_EQ(read[1].name, "a&lt;b&gt;&amp;&quot;c&quot;");
}

}  // namespace
}  // namespace viscera
