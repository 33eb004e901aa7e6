// What `viscera profile` makes of measured times.
#include "tools/profile/profile_report.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

namespace viscera {
namespace {

ProfileCase measured(const Occupancy& occupancy, const std::vector<double>& steps,
                     const std::vector<std::size_t>& touched) {
  ProfileCase one(occupancy);
  one.best_step = steps;
  one.organs_touched = touched;
  one.stages = {{"step", steps}};
  return one;
}

ProfileReport small_report() {
  ProfileReport report;
  report.scene = "made up";
  report.idle = {measured({1, 0, 1}, {2e-6, 2e-6, 2e-6}, {0, 0, 0}),
                 measured({11, 0, 1}, {3e-6, 3e-6, 3e-6}, {0, 0, 0})};
  report.touched = {measured({1, 1, 1}, {2e-6, 102e-6, 102e-6}, {0, 1, 1}),
                    measured({11, 1, 1}, {90e-6, 153e-6, 153e-6}, {0, 1, 1})};
  report.memory = {{1, 5'000'000}, {11, 25'000'000}};
  return report;
}

TEST(ProfileFit, FindsTheLineThroughPoints) {
  const auto fit = fit_line({{1.0, 5.0}, {2.0, 7.0}, {4.0, 11.0}});
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->slope, 2.0, 1e-12);
  EXPECT_NEAR(fit->at(0.0), 3.0, 1e-12);
}

TEST(ProfileFit, OneNumberOfOrgansHasNoSlope) {
  EXPECT_FALSE(fit_line({}));
  EXPECT_FALSE(fit_line({{3.0, 5.0}}));
  EXPECT_FALSE(fit_line({{3.0, 5.0}, {3.0, 6.0}}));
}

TEST(ProfileReport, CountsTouchedOrgansInTheFramesThatTouchThem) {
  const ProfileReport report = small_report();
  EXPECT_NEAR(*report.touched_organ_us(), 100.0, 1e-9);
  EXPECT_NEAR(*report.cost_of_organs(), 1.5, 1e-9);
  EXPECT_NEAR(report.idle_fit()->slope, 0.1, 1e-9);
}

TEST(ProfileReport, SaysWhatIsntReached) {
  std::ostringstream out;
  print(small_report(), out);
  const std::string text = out.str();
  for (const char* line : {"a frame of 11 organs over one of 1, 1 touched", "organs 2 to 11 add"}) {
    const std::size_t at = text.find(line);
    ASSERT_NE(at, std::string::npos) << line << text;
    EXPECT_NE(text.substr(at, text.find('\n', at) - at).find("NOT MET"), std::string::npos) << text;
  }
}

TEST(ProfileReport, WithoutTouchedOrgansHasNoCostOfOne) {
  ProfileReport report = small_report();
  report.touched.clear();
  const auto json = nlohmann::json::parse(to_json_text(report));
  EXPECT_TRUE(json["touched_organ_us"].is_null());
  EXPECT_NEAR(json["idle_organ_us"].get<double>(), 0.1, 1e-9);
  report.idle.pop_back();
  EXPECT_TRUE(nlohmann::json::parse(to_json_text(report))["idle_organ_us"].is_null());
}

}  // namespace
}  // namespace viscera
