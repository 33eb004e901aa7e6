#include "engine/render/renderer.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "engine/gpu/buffer.h"
#include "engine/gpu/egl_context.h"
#include "kernels/heat/electrode.h"
#include "tests/support/shapes.h"

namespace viscera {
namespace {

constexpr int kWidth = 256, kHeight = 144;

using Colour = std::array<double, 3>;

Colour mean(const Picture& picture, int x0, int y0, int x1, int y1) {
  Colour sum{};
  for (int y = y0; y < y1; ++y) {
    for (int x = x0; x < x1; ++x) {
      for (int c = 0; c < 3; ++c) sum[c] += picture.rgb[3 * (y * picture.width + x) + c];
    }
  }
  for (double& value : sum) value /= (x1 - x0) * (y1 - y0);
  return sum;
}

double brightness(const Colour& colour) {
  return (colour[0] + colour[1] + colour[2]) / 3.0;
}

/// A ball of tissue about the origin before a lens that looks along +y.
struct BallInView {
  BallInView(double radius, double distance, double field_of_view)
      : ball(test::icosphere(radius, 5)) {
    for (const Vec3& vertex : ball.vertices) {
      positions.push_back(vertex.cast<float>());
      normals.push_back(vertex.normalized().cast<float>());
    }
    view.camera.position = Vec3(0.0, -distance, 0.0);
    view.camera.field_of_view = field_of_view;
    OrganView organ;
    organ.id = 1;
    organ.name = "ball";
    organ.rest = &ball;
    organ.positions = positions;
    organ.normals = normals;
    view.organs.push_back(organ);
  }
  BallInView(const BallInView&) = delete;  // its view sees its ball
  BallInView& operator=(const BallInView&) = delete;

  TriangleSurface ball;
  std::vector<Vec3f> positions, normals;
  FrameView view;
};

/// A 4 cm ball of tissue 10 cm before the lens, which looks along +y.
class RendererTest : public ::testing::Test {
 protected:
  void SetUp() override {
    // One context for all cases: making it is the slow part.
    static Result<std::unique_ptr<Renderer>> shared = Renderer::create({kWidth, kHeight});
    if (!shared) GTEST_SKIP() << shared.error().text();
    renderer_ = shared->get();
    view_.camera.automatic_exposure = false;
    view_.camera.barrel = 0.0;
    view_.organs[0].id = ++last_id_;
  }

  Picture draw() {
    Picture picture;
    const Result<void> done = renderer_->draw(view_, picture);
    EXPECT_TRUE(done) << done.error().text();
    return picture;
  }

  /// The pixel over a point of the scene.
  Eigen::Vector2i pixel(const Vec3& point) const {
    const Vec3 away = point - view_.camera.position;
    const double scale = 0.5 * kHeight / (std::tan(0.35) * away.y());
    return {static_cast<int>(kWidth / 2 + scale * away.x()),
            static_cast<int>(kHeight / 2 - scale * away.z())};
  }

  static inline std::uint32_t last_id_ = 0;
  Renderer* renderer_ = nullptr;
  BallInView scene_{0.02, 0.1, 0.7};
  FrameView& view_ = scene_.view;
};

TEST_F(RendererTest, OrganIsLitInTheMiddleAndCornersAreBlack) {
  const Picture picture = draw();
  ASSERT_EQ(picture.width, kWidth);
  ASSERT_EQ(picture.height, kHeight);
  ASSERT_EQ(picture.rgb.size(), 3u * kWidth * kHeight);
  const Colour tissue = mean(picture, 108, 52, 148, 92);
  EXPECT_GT(brightness(tissue), 40.0);
  EXPECT_GT(tissue[0], tissue[2]) << "tissue is red";
  EXPECT_EQ(brightness(mean(picture, 0, 0, 40, 144)), 0.0);
  EXPECT_EQ(brightness(mean(picture, 216, 0, 256, 144)), 0.0);
}

TEST_F(RendererTest, WithoutTheMaskTheWholePictureIsSeen) {
  // A wall around the lens, seen from its inside, fills the picture.
  view_.organs[0].pose.position = view_.camera.position;
  view_.light_intensity = 0.05;
  view_.camera.round_mask = false;
  EXPECT_GT(brightness(mean(draw(), 0, 0, 20, 20)), 10.0);
  view_.camera.round_mask = true;
  EXPECT_EQ(brightness(mean(draw(), 0, 0, 20, 20)), 0.0);
}

TEST_F(RendererTest, AStrandIsSeenBeforeTissueNotBehindItAndHasALabelOfItsOwn) {
  // 12 mm across the ball's pole towards the lens, and as much behind the ball.
  StrandHalf strand;
  strand.foot_radius = strand.end_radius = 1e-3f;
  strand.reach = Vec3f(12e-3f, 0, 0);
  const Eigen::Vector2i at = pixel(Vec3(0, -0.023, 0));
  const auto labels = [&](float y) {
    strand.foot = Vec3f(-6e-3f, y, 0);
    view_.beds = {{.id = 7, .name = "bed", .halves = std::span(&strand, 1)}};
    Picture picture;
    PassImages images;
    const Result<void> done = renderer_->draw(view_, picture, &images);
    EXPECT_TRUE(done) << done.error().text();
    return images;
  };
  const auto middle = [&](const PassImages& images) {
    return static_cast<std::size_t>(images.width) * (images.height * at.y() / kHeight) +
           images.width * at.x() / kWidth;
  };
  const PassImages seen = labels(-0.023f), hidden = labels(0.023f);
  EXPECT_EQ(seen.labels[middle(seen)], 2u) << "after the ball";
  EXPECT_EQ(hidden.labels[middle(hidden)], 1u);
  EXPECT_LT(seen.depth[middle(seen)], hidden.depth[middle(hidden)]);
  EXPECT_NE(seen.clean[3 * middle(seen) + 1], hidden.clean[3 * middle(hidden) + 1]);
  view_.beds.clear();
}

TEST_F(RendererTest, SameViewGivesTheSameBytes) {
  const Picture first = draw();
  const Picture second = draw();
  EXPECT_EQ(first.rgb, second.rgb);
  const auto other = Renderer::create({kWidth, kHeight});
  ASSERT_TRUE(other) << other.error().text();
  Picture third;
  ASSERT_TRUE((*other)->draw(view_, third));
  EXPECT_EQ(first.rgb, third.rgb);
}

TEST_F(RendererTest, FirstRowIsTheTop) {
  view_.organs[0].pose.position = Vec3(0.0, 0.0, 0.03);
  const Picture picture = draw();
  EXPECT_GT(brightness(mean(picture, 118, 10, 138, 30)),
            brightness(mean(picture, 118, 114, 138, 134)) + 20.0);
}

TEST_F(RendererTest, MovedAndDeformedOrgansChangeThePicture) {
  const Picture still = draw();
  view_.organs[0].pose.position.x() = 0.01;
  EXPECT_NE(draw().rgb, still.rgb);
  view_.organs[0].pose.position.x() = 0.0;
  EXPECT_EQ(draw().rgb, still.rgb);
  for (Vec3f& position : scene_.positions) position *= 1.2f;
  EXPECT_EQ(draw().rgb, still.rgb) << "the version says that nothing moved";
  view_.organs[0].surface_version = 1;
  EXPECT_NE(draw().rgb, still.rgb);
}

TEST_F(RendererTest, ASurfaceThatLiesOnTheGpuIsDrawnLikeOneThatIsUploaded) {
  auto context = EglContext::create();
  ASSERT_TRUE(context) << context.error().text();
  const auto renderer = Renderer::create({kWidth, kHeight, Quality::kReview, *std::move(context)});
  ASSERT_TRUE(renderer) << renderer.error().text();
  const auto picture = [&] {
    ++view_.organs[0].surface_version;
    Picture drawn;
    const Result<void> done = (*renderer)->draw(view_, drawn);
    EXPECT_TRUE(done) << done.error().text();
    return drawn.rgb;
  };
  const std::vector<std::uint8_t> at_rest = picture();
  for (Vec3f& position : scene_.positions) position.x() *= 1.3f;
  const std::vector<std::uint8_t> uploaded = picture();
  ASSERT_NE(uploaded, at_rest);

  // Two surfaces in one buffer, of which this is the second.
  std::vector<Vec3f> positions(7, Vec3f::Zero()), normals(7, Vec3f::UnitZ());
  positions.insert(positions.end(), scene_.positions.begin(), scene_.positions.end());
  normals.insert(normals.end(), scene_.normals.begin(), scene_.normals.end());
  Buffer positions_there, normals_there;
  positions_there.upload(std::span<const Vec3f>(positions));
  normals_there.upload(std::span<const Vec3f>(normals));
  view_.organs[0].device = {&positions_there, &normals_there, 7};
  const std::vector<Vec3f> stale(scene_.normals.size(), Vec3f::UnitX());
  view_.organs[0].normals = stale;
  EXPECT_EQ(picture(), uploaded);
  for (Vec3f& position : scene_.positions) position.x() /= 1.3f;
  view_.organs[0].device = {};
  view_.organs[0].normals = scene_.normals;
  const std::vector<std::uint8_t> again = picture();
  EXPECT_NE(again, uploaded);
}

TEST_F(RendererTest, OrgansThatReachIntoThePictureAreDrawnAndThoseBesideItChangeNothing) {
  const Picture alone = draw();
  OrganView other = view_.organs[0];
  other.id = ++last_id_;
  view_.organs.push_back(other);
  for (const Vec3& place : {Vec3(0.3, 0.0, 0.0), Vec3(0.0, 0.0, 0.3), Vec3(0.0, -0.3, 0.0)}) {
    view_.organs[1].pose.position = place;
    EXPECT_EQ(draw().rgb, alone.rgb) << place.transpose();
  }
  // Its middle lies outside, its edge within.
  view_.organs[1].pose.position = Vec3(0.0, 0.0, 0.05);
  EXPECT_GT(brightness(mean(draw(), 124, 2, 132, 10)),
            brightness(mean(alone, 124, 2, 132, 10)) + 10);
}

TEST_F(RendererTest, BurnDarkensTheTissueWhereItIs) {
  const Picture sound = draw();
  HeatBricks bricks(0.5e-3, {}, 8192);
  const Vec3 centre(0.004, -0.019, 0.005);
  for (int z = -16; z < 40; ++z) {
    for (int y = -60; y < -16; ++y) {
      for (int x = -16; x < 40; ++x) {
        const BrickIndex voxel(x, y, z);
        const double apart =
            ((voxel.cast<double>().array() + 0.5) * 0.5e-3 - centre.array()).matrix().norm();
        if (apart > 5e-3) continue;
        const BrickIndex index = BrickField::brick_of(voxel);
        const BrickIndex inside = voxel - index * HeatBricks::kEdge;
        const auto at = static_cast<std::size_t>(inside.x() + 8 * (inside.y() + 8 * inside.z()));
        HeatBrick& brick = *bricks.warm_up(index);
        brick.harmed = true;
        brick.coagulation[at] = 10.0f;
        brick.water[at] = static_cast<float>(std::max(0.0, 1.0 - (5e-3 - apart) / 1.5e-3));
        brick.charred[at] = static_cast<float>(std::clamp((4e-3 - apart) / 1.5e-3, 0.0, 1.0));
      }
    }
  }
  view_.organs[0].burn = &bricks;
  view_.organs[0].burn_version = 1;
  const Picture burnt = draw();
  const Eigen::Vector2i at = pixel(centre);
  const auto around = [&](const Picture& picture, int dx) {
    return brightness(mean(picture, at.x() + dx - 2, at.y() - 2, at.x() + dx + 2, at.y() + 2));
  };
  EXPECT_LT(around(burnt, 0), 0.5 * around(sound, 0));
  EXPECT_NEAR(around(burnt, -25), around(sound, -25), 2.0) << "far from the burn nothing changes";
}

TEST_F(RendererTest, CoagulatedTissueIsPaleAndHotTissueGlows) {
  view_.light_intensity = 0.3;  // so that the film's curve bleaches nothing
  const Vec3 centre(0.004, -0.019, 0.005);
  const Picture sound = draw();
  HeatBricks bricks(0.5e-3, {}, 8192);
  for (int z = 0; z < 5; ++z)
    for (int y = -8; y < 0; ++y)
      for (int x = -3; x < 5; ++x) {
        HeatBrick& brick = *bricks.warm_up({x, y, z});
        brick.harmed = true;
        brick.coagulation.fill(5.0f);
      }
  view_.organs[0].burn = &bricks;
  view_.organs[0].burn_version = 1;
  const Eigen::Vector2i at = pixel(centre);
  const auto colour = [&](const Picture& picture) {
    return mean(picture, at.x() - 3, at.y() - 3, at.x() + 3, at.y() + 3);
  };
  const Colour red = colour(sound), pale = colour(draw());
  EXPECT_GT(pale[1] / pale[0], 1.15 * red[1] / red[0]) << "less red";
  // Warm isn't hot enough; 1100 K is.
  for (std::size_t i = 0; i < bricks.count(); ++i) bricks.brick(i).warm->excess.fill(200.0f);
  view_.organs[0].burn_version = 2;
  EXPECT_NEAR(brightness(colour(draw())), brightness(pale), 1.0);
  for (std::size_t i = 0; i < bricks.count(); ++i) bricks.brick(i).warm->excess.fill(800.0f);
  view_.organs[0].burn_version = 3;
  const Colour glowing = colour(draw());
  EXPECT_GT(glowing[0], pale[0] + 20.0);
  EXPECT_GT(glowing[0] - pale[0], 2.0 * (glowing[2] - pale[2]));
}

TEST(BurnPictureTest, TwoMillimetreBurnIsRoundWithAnUnevenEdgeThatShowsNoVoxels) {
  constexpr int kFullWidth = 1280, kFullHeight = 720;
  const auto renderer = Renderer::create({kFullWidth, kFullHeight});
  if (!renderer) GTEST_SKIP() << renderer.error().text();
  // 5 cm before the lens: 20 pixels a millimetre.
  BallInView scene(0.05, 0.1, 0.7);
  FrameView& view = scene.view;
  view.camera.automatic_exposure = false;
  view.camera.barrel = 0.0;
  view.light_intensity = 0.3;
  Picture sound, burnt;
  ASSERT_TRUE((*renderer)->draw(view, sound));
  // Off the voxels' grid, and off the middle, where the lens light's reflection is.
  ElectrodeContact contact;
  contact.outward = Vec3(0.0913, -1.0, 0.0517).normalized();
  contact.point = 0.05 * contact.outward;
  contact.depth = 0.5e-3;
  const Vec3& centre = contact.point;
  Bioheat heat(ThermalTissue{}, {}, [](const Vec3& x) { return x.norm() - 0.05; });
  ElectrodeTip tip(Electrode{.tip_radius = 1e-3});
  for (int tick = 0; tick < 60; ++tick) {
    tip.energise(heat, CurrentMode::kBlend, 30.0, contact, contact, 1.0 / 60.0);
    heat.step(1.0 / 60.0);
  }
  view.organs[0].burn = &heat.bricks();
  view.organs[0].burn_version = 1;
  ASSERT_TRUE((*renderer)->draw(view, burnt));

  const Vec3 away = centre - view.camera.position;
  const double scale = 0.5 * kFullHeight / (std::tan(0.35) * away.y());
  const double x0 = 0.5 * kFullWidth + scale * away.x(), y0 = 0.5 * kFullHeight - scale * away.z();
  const auto darkening = [&](double x, double y) {
    const std::size_t at =
        3 * (static_cast<std::size_t>(y) * kFullWidth + static_cast<std::size_t>(x));
    int most = 0;
    for (std::size_t c = at; c < at + 3; ++c) {
      // Darkened: a glint on the rim is none of the burn.
      most = std::max(most, sound.rgb[c] - burnt.rgb[c]);
    }
    return most;
  };
  // How far out the brown edge lies, in every direction.
  double sum = 0.0, squares = 0.0, least = 1e9, greatest = 0.0, before = 0.0, jumps = 0.0;
  constexpr int kDirections = 90;
  for (int i = 0; i < kDirections; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kDirections;
    double radius = 60.0;
    while (radius > 0.0 &&
           darkening(x0 + radius * std::cos(angle), y0 + radius * std::sin(angle)) < 60) {
      radius -= 0.25;
    }
    if (i > 0) jumps += std::abs(radius - before) / (kDirections - 1);
    before = radius;
    sum += radius;
    squares += radius * radius;
    least = std::min(least, radius);
    greatest = std::max(greatest, radius);
  }
  const double average = sum / kDirections;
  const double deviation = std::sqrt(std::max(squares / kDirections - average * average, 0.0));
  EXPECT_GT(average, 0.7e-3 * scale);
  EXPECT_LT(average, 1.6e-3 * scale);
  EXPECT_GT(deviation, 0.02 * average) << "tissue doesn't dry by a compass";
  EXPECT_LT(deviation, 0.13 * average);
  EXPECT_LT(greatest - least, 0.5 * average);
  EXPECT_LT(jumps, 0.03 * average) << "steps of voxels, a half of the radius wide";
  RecordProperty("jumps_share", std::to_string(jumps / average));
  RecordProperty("radius_mm", std::to_string(1e3 * average / scale));
  RecordProperty("deviation_share", std::to_string(deviation / average));
}

TEST_F(RendererTest, ThickSmokeHidesTheOrganAndThinSmokeVeilsIt) {
  view_.light_intensity = 0.3;  // so that the film's curve bleaches nothing
  const Picture clear = draw();
  std::vector<float> density(16 * 16 * 16, 0.0f);
  SmokeView smoke;
  smoke.optics = {4000.0, 0.9, 0.65};
  smoke.domain = Box(Vec3(-0.06, -0.07, -0.06), Vec3(0.06, -0.03, 0.06));
  smoke.size = Eigen::Vector3i::Constant(16);
  smoke.density = density;
  view_.smoke.push_back(smoke);
  EXPECT_EQ(draw().rgb, clear.rgb) << "a volume without smoke costs nothing and shows nothing";
  std::fill(density.begin(), density.end(), 2.0f);  // optical depth 320
  const Picture hidden = draw();
  view_.organs[0].pose.position.x() = 0.01;
  const Picture hidden_moved = draw();
  view_.organs[0].pose.position.x() = 0.0;
  EXPECT_LT(std::abs(brightness(mean(hidden, 100, 50, 156, 94)) -
                     brightness(mean(hidden_moved, 100, 50, 156, 94))),
            2.0);
  std::fill(density.begin(), density.end(), 3e-3f);  // optical depth 0.5
  const Picture veiled = draw();
  const auto redness = [](const Picture& picture) {
    const Colour tissue = mean(picture, 108, 52, 148, 92);
    return tissue[0] / (tissue[1] + 1.0);
  };
  EXPECT_LT(redness(veiled), 0.95 * redness(clear)) << "smoke is grey";
  EXPECT_LT(redness(hidden), redness(veiled));
}

TEST_F(RendererTest, InstrumentsStandBeforeTheOrgan) {
  const Picture bare = draw();
  for (const auto kind : {InstrumentView::Kind::kProbe, InstrumentView::Kind::kGrasper,
                          InstrumentView::Kind::kHook, InstrumentView::Kind::kSpatula}) {
    InstrumentView instrument;
    instrument.id = 1;
    instrument.kind = kind;
    instrument.tip = Vec3(0.0, -0.03, 0.0);
    instrument.shaft_direction = Vec3(0.6, -0.2, -0.5).normalized();
    instrument.side_direction = Vec3::UnitY();
    view_.instruments = {instrument};
    const Picture picture = draw();
    int changed = 0;
    for (std::size_t i = 0; i < picture.rgb.size(); i += 3) {
      changed += std::abs(picture.rgb[i] - bare.rgb[i]) > 8;
    }
    EXPECT_GT(changed, 100);
  }
}

TEST_F(RendererTest, MoreLightMakesABrighterPictureAndMiddleTonesStayClearOfBlackAndWhite) {
  double before = 0.0;
  for (const double light : {0.05, 0.1, 0.2, 0.4, 0.8, 1.6, 3.2, 6.4}) {
    view_.light_intensity = light;
    const double now = brightness(mean(draw(), 90, 60, 110, 84));
    EXPECT_GT(now, before + 1.0) << light;
    before = now;
  }
  // A grey of 18 %, lit as white is at full scale.
  view_.organs[0].look = TissueLook{};
  view_.organs[0].look.colour = view_.organs[0].look.mottle_colour = Vec3::Constant(0.18);
  view_.organs[0].look.bump_height = 0.0;
  view_.light_intensity = 1.0;
  const Colour grey = mean(draw(), 90, 60, 110, 84);
  EXPECT_GT(brightness(grey), 50.0);
  EXPECT_LT(brightness(grey), 205.0);
}

TEST_F(RendererTest, AutomaticExposureGoesAPartOfTheWay) {
  const auto lit = [&](double intensity, bool automatic) {
    view_.light_intensity = intensity;
    view_.camera.automatic_exposure = automatic;
    return brightness(mean(draw(), 90, 60, 110, 84));
  };
  const double fixed = lit(1.0, false) / lit(0.25, false);
  const double exposed = lit(1.0, true) / lit(0.25, true);
  EXPECT_GT(fixed, 1.5);
  EXPECT_GT(exposed, 1.02) << "what is dark stays darker";
  EXPECT_LT(exposed, 0.8 * fixed);
}

TEST_F(RendererTest, WetTissueHasHighlightsAndDryTissueHasNone) {
  const auto whitest = [](const Picture& picture) {
    int most = 0;
    for (std::size_t i = 0; i < picture.rgb.size(); i += 3)
      most =
          std::max<int>(most, std::min({picture.rgb[i], picture.rgb[i + 1], picture.rgb[i + 2]}));
    return most;
  };
  view_.organs[0].look.wetness = 1.0;
  EXPECT_GT(whitest(draw()), 235);
  view_.organs[0].look.wetness = 0.0;
  view_.organs[0].look.roughness = 1.0;
  EXPECT_LT(whitest(draw()), 180);
}

TEST_F(RendererTest, BarrelBendsTheFieldAndKeepsItsRim) {
  const Eigen::Vector2i edge = pixel(Vec3(0.019, 0.0, 0.0));
  const auto beyond = [&] {
    return brightness(mean(draw(), edge.x() + 3, edge.y() - 3, edge.x() + 5, edge.y() + 3));
  };
  const double straight = beyond();
  view_.camera.barrel = 0.4;
  EXPECT_GT(beyond(), straight + 20.0) << "the middle is seen larger";
  const Picture bent = draw();
  EXPECT_EQ(brightness(mean(bent, 0, 0, 40, 144)), 0.0);
  EXPECT_EQ(brightness(mean(bent, 216, 0, 256, 144)), 0.0);
}

TEST_F(RendererTest, PatternsAndVesselsShowOnTheTissue) {
  TissueLook& look = view_.organs[0].look;
  const Picture plain = draw();
  look.vessel_amount = 1.0;
  const Picture vessels = draw();
  EXPECT_NE(vessels.rgb, plain.rgb);
  for (const auto pattern : {TissueLook::Pattern::kLobules, TissueLook::Pattern::kFibres}) {
    look.pattern = pattern;
    const Picture other = draw();
    EXPECT_NE(other.rgb, vessels.rgb);
    EXPECT_NE(other.rgb, plain.rgb);
  }
}

TEST_F(RendererTest, SensorNoiseIsTheSameForTheSameFrameAndAnotherForTheNext) {
  view_.frame = 7;
  const Picture seventh = draw();
  EXPECT_EQ(draw().rgb, seventh.rgb);
  view_.frame = 8;
  const Picture eighth = draw();
  EXPECT_NE(eighth.rgb, seventh.rgb);
  const Colour a = mean(seventh, 108, 52, 148, 92), b = mean(eighth, 108, 52, 148, 92);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(a[c], b[c], 0.5);
  int most = 0;
  for (std::size_t i = 0; i < seventh.rgb.size(); ++i)
    most = std::max(most, std::abs(seventh.rgb[i] - eighth.rgb[i]));
  EXPECT_LT(most, 16) << "noise, not snow";
}

TEST_F(RendererTest, AnInstrumentShadesTheTissueBesideIt) {
  const Picture bare = draw();
  InstrumentView instrument;
  instrument.id = 1;
  instrument.tip = Vec3(-0.03, -0.035, 0.0);
  instrument.shaft_direction = Vec3::UnitX();
  instrument.shaft_radius = 2e-3;
  view_.instruments = {instrument};
  const Picture shaded = draw();
  // The light guide is above the lens: the shadow falls below the shaft.
  const int under = pixel(Vec3(0.008, -0.035, -0.003)).y();
  const int x = pixel(Vec3(0.008, -0.035, 0.0)).x();
  EXPECT_LT(brightness(mean(shaded, x - 4, under, x + 4, under + 3)),
            0.93 * brightness(mean(bare, x - 4, under, x + 4, under + 3)));
}

TEST(QualityTest, QualitiesDifferInCostAndAgreeInMeanColour) {
  BallInView scene(0.05, 0.12, 0.9);
  FrameView& view = scene.view;
  view.organs[0].look.vessel_amount = 0.5;
  std::vector<Colour> colours;
  std::vector<double> costs;
  for (const Quality quality : {Quality::kDraft, Quality::kReview, Quality::kFinal}) {
    const auto renderer = Renderer::create({640, 360, quality});
    if (!renderer) GTEST_SKIP() << renderer.error().text();
    Picture picture;
    double best = 1e9;
    for (int i = 0; i < 12; ++i) {  // beside other work few are undisturbed
      ASSERT_TRUE((*renderer)->draw(view, picture));
      double sum = 0.0;
      for (const PassTime& pass : (*renderer)->pass_times()) sum += pass.seconds;
      best = std::min(best, sum);
    }
    ASSERT_EQ(picture.width, 640);
    ASSERT_EQ(picture.height, 360);
    colours.push_back(mean(picture, 140, 0, 500, 360));
    costs.push_back(best);
  }
  EXPECT_LT(costs[0], costs[1]);
  EXPECT_LT(costs[1], costs[2]);
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(colours[0][c], colours[1][c], 4.0);
    EXPECT_NEAR(colours[2][c], colours[1][c], 4.0);
  }
}

TEST(QualityTest, NamesGoBothWaysAndOthersAreRefused) {
  for (const Quality quality : {Quality::kDraft, Quality::kReview, Quality::kFinal})
    EXPECT_EQ(quality_of(name_of(quality)), quality);
  EXPECT_FALSE(quality_of("best"));
  EXPECT_FALSE(quality_of(""));
}

TEST_F(RendererTest, TimesOfAllPassesAreReported) {
  draw();
  double sum = 0.0;
  for (const PassTime& pass : renderer_->pass_times()) sum += pass.seconds;
  EXPECT_GE(renderer_->pass_times().size(), 7u);
  EXPECT_GT(sum, 0.0);
}

TEST_F(RendererTest, MismatchedInputIsRefusedByName) {
  Picture picture;
  view_.organs[0].normals = std::span<const Vec3f>(scene_.normals).first(3);
  Result<void> done = renderer_->draw(view_, picture);
  ASSERT_FALSE(done);
  EXPECT_NE(done.error().text().find("organ ball"), std::string::npos) << done.error().text();
  view_.organs.clear();
  SmokeView smoke;
  smoke.optics = {4000.0, 0.9, 0.65};
  smoke.size = Eigen::Vector3i(2, 2, 2);
  view_.smoke.push_back(smoke);
  done = renderer_->draw(view_, picture);
  ASSERT_FALSE(done);
  EXPECT_NE(done.error().text().find("0 densities"), std::string::npos) << done.error().text();
}

TEST(RendererOptionsTest, AbsurdPictureSizesAreRefused) {
  for (const RenderOptions& options :
       {RenderOptions{0, 720}, RenderOptions{1280, -1}, RenderOptions{1 << 20, 720}}) {
    const int before = egl_contexts_created();
    const auto renderer = Renderer::create(options);
    ASSERT_FALSE(renderer);
    EXPECT_NE(renderer.error().text().find("picture size"), std::string::npos);
    EXPECT_EQ(egl_contexts_created(), before);
  }
}

}  // namespace
}  // namespace viscera
