#include "engine/io/review.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <regex>

#include "tests/engine/io/file_text.h"
#include "tests/support/paths.h"

namespace viscera {
namespace {

using nlohmann::json;
using test::file_text;
using test::TemporaryFolder;

json page_data(const std::string& page) {
  const std::string open = "<script type=\"application/json\" id=\"run\">";
  const std::size_t begin = page.find(open) + open.size();
  return json::parse(page.substr(begin, page.find("</script>", begin) - begin));
}

TEST(Curve, KeepsEverySampleOfAShortRun) {
  Curve curve("hook");
  for (int i = 0; i < 100; ++i) curve.add(1e-3 * i, i);
  ASSERT_EQ(curve.buckets().size(), 100u);
  EXPECT_EQ(curve.buckets()[42].least, 42.0);
  EXPECT_EQ(curve.buckets()[42].greatest, 42.0);
}

TEST(Curve, LosesNoPeakOfALongRun) {
  Curve curve("hook");
  constexpr int kTicks = 1'000'000;
  double sum = 0.0;
  for (int i = 0; i < kTicks; ++i) {
    const double value = i == 654'321 ? 9.0 : i == 12'345 ? -4.0 : std::sin(1e-3 * i);
    sum += value;
    curve.add(1e-3 * i, value);
  }
  EXPECT_LE(curve.buckets().size(), Curve::kBuckets);
  EXPECT_GE(curve.buckets().size(), Curve::kBuckets / 2);
  double least = 0.0, greatest = 0.0, total = 0.0, before = -1.0;
  std::size_t count = 0;
  for (const Curve::Bucket& bucket : curve.buckets()) {
    EXPECT_GT(bucket.time, before);
    before = bucket.time;
    least = std::min(least, bucket.least);
    greatest = std::max(greatest, bucket.greatest);
    total += bucket.sum;
    count += bucket.count;
  }
  EXPECT_EQ(least, -4.0);
  EXPECT_EQ(greatest, 9.0);
  EXPECT_EQ(count, static_cast<std::size_t>(kTicks));
  EXPECT_NEAR(total, sum, 1e-6);
}

TEST(Curve, LeavesOutWhatIsntFinite) {
  Curve curve("hook");
  curve.add(0.0, std::nan(""));
  curve.add(0.1, INFINITY);
  curve.add(0.2, 1.0);
  EXPECT_EQ(curve.buckets().size(), 1u);
}

TEST(Review, HoldsTheReportTheFilmAndTheCurves) {
  const TemporaryFolder folder;
  Review review;
  review.report.title = "Cautery";
  review.report.command = "viscera run a.json";
  review.film = "film.mp4";
  review.charts.push_back({.title = "Force", .unit = "N", .curves = {Curve("hook")}, .note = ""});
  review.charts[0].curves[0].add(0.0, 0.0);
  review.charts[0].curves[0].add(0.5, 1.23456789);
  ASSERT_TRUE(write_review(folder / "review.html", review));
  const json data = page_data(file_text(folder / "review.html"));
  EXPECT_EQ(data["report"]["title"], "Cautery");
  EXPECT_EQ(data["film"], "film.mp4");
  EXPECT_EQ(data["charts"][0]["curves"][0]["name"], "hook");
  EXPECT_NEAR(data["charts"][0]["curves"][0]["mean"][1].get<double>(), 1.2346, 1e-6);
}

TEST(Review, HoldsMomentsWithTheirPictures) {
  const TemporaryFolder folder;
  Review review;
  review.moments = {{"First contact", "hook on liver", 0.7, "data:image/png;base64,AAAA"},
                    {"Peak force", "hook, 1.2 N", 1.4, ""}};
  ASSERT_TRUE(write_review(folder / "review.html", review));
  const json moments = page_data(file_text(folder / "review.html"))["moments"];
  ASSERT_EQ(moments.size(), 2u);
  EXPECT_EQ(moments[0]["title"], "First contact");
  EXPECT_EQ(moments[0]["picture"], "data:image/png;base64,AAAA");
  EXPECT_EQ(moments[1]["detail"], "hook, 1.2 N");
  EXPECT_EQ(moments[1]["time"], 1.4);
}

std::string film_text(const std::string& page) {
  const std::string open = "<script type=\"text/plain\" id=\"film\">";
  const std::size_t begin = page.find(open) + open.size();
  return page.substr(begin, page.find("</script>", begin) - begin);
}

TEST(Review, HoldsTheFilmThatLiesBesideIt) {
  const TemporaryFolder folder;
  Review review;
  review.film = "film.mp4";
  ASSERT_TRUE(write_review(folder / "review.html", review));
  EXPECT_EQ(film_text(file_text(folder / "review.html")), "") << "there is none to take in";
  test::put_text(folder / "film.mp4", "foobar");
  ASSERT_TRUE(write_review(folder / "review.html", review));
  EXPECT_EQ(film_text(file_text(folder / "review.html")), "Zm9vYmFy");
}

TEST(Review, SaysOfSingleSamplesOnlyTheirValue) {
  const TemporaryFolder folder;
  Review review;
  review.charts.push_back(
      {.title = "Force", .unit = "N", .curves = {Curve("a"), Curve("b")}, .note = ""});
  for (int i = 0; i < 10; ++i) review.charts[0].curves[0].add(0.1 * i, i);
  for (int i = 0; i < 2000; ++i) review.charts[0].curves[1].add(0.001 * i, i);
  ASSERT_TRUE(write_review(folder / "review.html", review));
  const json curves = page_data(file_text(folder / "review.html"))["charts"][0]["curves"];
  EXPECT_FALSE(curves[0].contains("greatest"));
  EXPECT_EQ(curves[1]["greatest"].size(), curves[1]["mean"].size());
}

TEST(Thumbnail, IsTheMeanOfItsPixels) {
  std::vector<std::uint8_t> rgb;
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 8; ++x)
      for (const int value : {x < 4 ? 10 : 20, 40 * (x % 2), y}) rgb.push_back(value);
  const Thumbnail small = thumbnail(rgb, 8, 4, 2);
  EXPECT_EQ(small.width, 2);
  EXPECT_EQ(small.height, 1);
  EXPECT_EQ(small.rgb, (std::vector<std::uint8_t>{10, 20, 2, 20, 20, 2}));
  const auto uri = data_uri(small);
  ASSERT_TRUE(uri);
  EXPECT_TRUE(uri->starts_with("data:image/png;base64,iVBORw0KGgo")) << *uri;
}

TEST(Thumbnail, OfASmallPictureIsThePicture) {
  const std::vector<std::uint8_t> rgb(3 * 3 * 2, 7);
  EXPECT_EQ(thumbnail(rgb, 3, 2, 320).rgb, rgb);
}

TEST(Review, NamesCantBreakOutOfTheData) {
  const TemporaryFolder folder;
  Review review;
  review.report.title = "</script><script>alert(1)</script><!-- {{run data}}";
  ASSERT_TRUE(write_review(folder / "review.html", review));
  const std::string page = file_text(folder / "review.html");
  EXPECT_EQ(page.find("<script>alert"), std::string::npos);
  EXPECT_EQ(page_data(page)["report"]["title"], review.report.title);
}

TEST(Review, NeedsNoNetwork) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_review(folder / "review.html", Review()));
  std::string page = file_text(folder / "review.html");
  // The name of SVG's elements is a web address that is never fetched.
  page = std::regex_replace(page, std::regex("http://www\\.w3\\.org/2000/svg"), "");
  EXPECT_EQ(page.find("http://"), std::string::npos);
  EXPECT_EQ(page.find("https://"), std::string::npos);
  EXPECT_EQ(page.find("<link"), std::string::npos);
  EXPECT_EQ(page.find("@import"), std::string::npos);
}

TEST(Review, IsRefusedWhereItCantBeWritten) {
  const TemporaryFolder folder;
  EXPECT_FALSE(write_review(folder / "missing/review.html", Review()));
  std::filesystem::create_symlink("/dev/full", folder / "full.html");
  const auto full = write_review(folder / "full.html", Review());
  ASSERT_FALSE(full);
  EXPECT_NE(full.error().text().find("No space left on device"), std::string::npos)
      << full.error().text();
}

}  // namespace
}  // namespace viscera
