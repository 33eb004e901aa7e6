#include "engine/run/observers/review_recorder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>

#include "engine/features/beds/beds.h"
#include "engine/simulator/build.h"
#include "tests/support/lifted_block.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

constexpr double kTop = 25e-3;  // pole of the ball [m]
constexpr double kRadius = 4e-3;

/// A probe that is 3 mm deep in the pole of a soft ball at 0.5 s and out of it again at 0.8 s.
SceneDescription poked_ball() {
  auto scene = soft_ball_scene(6e-3, 3e-3);
  scene.instruments = {straight_tool("probe", InstrumentKind::kProbe, kRadius,
                                     {{0.0, Vec3(0, 0, kTop + kRadius + 2e-3), 0.0, 1.0},
                                      {0.5, Vec3(0, 0, kTop + kRadius - 3e-3), 0.0, 1.0},
                                      {0.8, Vec3(0, 0, kTop + kRadius + 2e-3), 0.0, 1.0}})};
  return scene;
}

/// A run of a second with a picture after every `frames_a_picture` frames (0: none).
Review recorded(World& world, const SceneDescription& scene, std::uint64_t frames_a_picture) {
  Trace trace(stage_names());
  ReviewRecorder recorder(world, scene, trace, "film.mp4", frames_a_picture > 0);
  const Picture picture{4, 2, std::vector<std::uint8_t>(24, 9)};
  while (world.frame() < 60) {
    step_frame(world, trace);
    recorder.add_frame(world);
    if (frames_a_picture > 0 && world.frame() % frames_a_picture == 0)
      recorder.take(world, picture);
  }
  RunReport report;
  recorder.describe(world, report);
  auto review = recorder.review(report);
  if (!review) {
    ADD_FAILURE() << review.error().text();
    return {};
  }
  return std::move(*review);
}

const Moment* moment(const Review& review, const std::string& title) {
  const auto found = std::find_if(review.moments.begin(), review.moments.end(),
                                  [&](const Moment& m) { return m.title == title; });
  return found == review.moments.end() ? nullptr : &*found;
}

TEST(Penetration, IsHowDeepATipIsInTheTissueAtRest) {
  auto world = build(poked_ball());
  ASSERT_TRUE(world);
  EXPECT_EQ(penetrations(*world), std::vector<double>{0.0});
  step_until(*world, 0.5);
  EXPECT_NEAR(penetrations(*world)[0], 3e-3, 0.15e-3);
  step_until(*world, 0.8);
  EXPECT_EQ(penetrations(*world), std::vector<double>{0.0});
}

TEST(Penetration, IsNoneForAJawThatHoldsTissue) {
  auto scene = soft_ball_scene(6e-3, 4e-3);
  scene.instruments = {straight_tool("grasper", InstrumentKind::kGrasper, 2e-3,
                                     {{0.0, Vec3(0, 0, kTop + 4e-3), 0.0, 1.0},
                                      {0.2, Vec3(0, 0, kTop + 1e-3), 0.0, 1.0},
                                      {0.4, Vec3(0, 0, kTop + 1e-3), 0.0, 0.0},
                                      {0.8, Vec3(0, 0, kTop + 6e-3), 0.0, 0.0}})};
  auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 0.8);
  ASSERT_TRUE(world->all<InstrumentContact>()[0].grasp);
  EXPECT_EQ(penetrations(*world), std::vector<double>{0.0});
}

TEST(ReviewRecorder, KeepsTheMomentsThatMatterAndTheirPictures) {
  const auto scene = poked_ball();
  auto world = build(scene);
  ASSERT_TRUE(world);
  const Review review = recorded(*world, scene, 2);
  const Moment* contact = moment(review, "First contact");
  const Moment* peak = moment(review, "Peak force");
  const Moment* displacement = moment(review, "Greatest displacement");
  ASSERT_TRUE(contact && peak && displacement);
  // The way down of 5 mm takes half a second, and its first 2 mm are through the air.
  EXPECT_NEAR(contact->time, 0.2, 0.05);
  EXPECT_EQ(contact->detail.substr(0, 9), "probe on ");
  EXPECT_NEAR(peak->time, 0.5, 0.02);
  EXPECT_NEAR(displacement->time, 0.5, 0.02);
  for (const Moment* one : {contact, peak, displacement})
    EXPECT_TRUE(one->picture.starts_with("data:image/png;base64,")) << one->title;
  EXPECT_EQ(moment(review, "First smoke"), nullptr) << "nothing burns";
  EXPECT_EQ(moment(review, "Jaws first hold tissue"), nullptr) << "there are no jaws";
  EXPECT_TRUE(std::is_sorted(review.moments.begin(), review.moments.end(),
                             [](const Moment& a, const Moment& b) { return a.time < b.time; }));

  const Json ball = Json::parse(to_json(review.report))["organs"][0];
  EXPECT_EQ(ball["name"], scene.organs[0].name);
  EXPECT_GT(ball["greatest_displacement_m"], 2e-3);
  EXPECT_LT(ball["greatest_displacement_m"], 3.5e-3);
  EXPECT_NEAR(ball["greatest_displacement_time_s"].get<double>(), 0.5, 0.02);
}

TEST(ReviewRecorder, ShowsNoPictureOfAnotherMoment) {
  const auto scene = poked_ball();
  auto world = build(scene);
  ASSERT_TRUE(world);
  const Review review = recorded(*world, scene, 60);
  ASSERT_TRUE(moment(review, "Peak force"));
  EXPECT_EQ(moment(review, "Peak force")->picture, "") << "the only picture is half a second late";
}

TEST(ReviewRecorder, DrawsForcePenetrationDisplacementAndStages) {
  const auto scene = poked_ball();
  auto world = build(scene);
  ASSERT_TRUE(world);
  const Review review = recorded(*world, scene, 0);
  ASSERT_EQ(review.charts.size(), 4u);
  for (int chart = 0; chart < 3; ++chart) {
    ASSERT_EQ(review.charts[chart].curves.size(), 1u) << review.charts[chart].title;
    EXPECT_EQ(review.charts[chart].curves[0].buckets().size(), 60u);
  }
  const auto& depth = review.charts[1].curves[0].buckets();
  EXPECT_NEAR(depth[29].greatest, 3.0, 0.15) << "in mm, at 0.5 s";
  const auto& stages = review.charts[3].curves;
  const auto deform = std::find_if(stages.begin(), stages.end(),
                                   [](const Curve& c) { return c.name() == "deform organs"; });
  ASSERT_NE(deform, stages.end());
  EXPECT_EQ(deform->buckets().size(), 60u);
  EXPECT_NEAR(deform->buckets().back().time, 1.0, 1e-9);
}

TEST(ReviewRecorder, DrawsHowABedPartsAndKeepsItsFirstAndLastMoment) {
  LiftedBlock options;
  options.period = 1.6;
  const auto scene = lifted_block(options);
  auto world = build(scene);
  ASSERT_TRUE(world);
  const Review review = recorded(*world, scene, 2);
  const auto chart = [&](const std::string& title) {
    const auto found = std::ranges::find(review.charts, title, &Chart::title);
    return found == review.charts.end() ? nullptr : &*found;
  };
  const Chart *forces = chart("Force of the beds"), *parted = chart("Bonds parted");
  ASSERT_TRUE(forces && parted);
  ASSERT_EQ(forces->curves.size(), 1u);
  ASSERT_EQ(parted->curves.size(), 2u);
  const BedFigures figures = bed_figures(*world)[0];
  EXPECT_EQ(parted->curves[0].buckets().back().greatest, static_cast<double>(figures.bonds));
  EXPECT_EQ(parted->curves[1].buckets().back().greatest, 0.0) << "nothing burns";
  EXPECT_EQ(forces->curves[0].buckets().back().greatest, 0.0) << "nothing holds any more";
  const Moment *first = moment(review, "A first bond parts"),
               *last = moment(review, "A bed is parted whole");
  ASSERT_TRUE(first && last);
  EXPECT_LE(first->time, last->time);
  EXPECT_EQ(first->detail, "bed, by force");
  EXPECT_FALSE(last->picture.empty());
}

}  // namespace
}  // namespace viscera::test
