#include "tests/engine/run/watched_run.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "engine/features/cautery/cautery_keys.h"
#include "engine/features/smoke/smoke_keys.h"
#include "engine/run/observers/film_maker.h"
#include "engine/run/observers/force_curves.h"
#include "engine/run/observers/frame_pictures.h"
#include "engine/run/observers/lesion_curve.h"
#include "engine/run/observers/pass_series.h"
#include "engine/run/observers/review_recorder.h"
#include "engine/run/observers/run_hash.h"
#include "engine/run/observers/sight.h"
#include "engine/run/observers/smoke_series.h"
#include "engine/run/observers/trainee.h"
#include "engine/run/observers/vtk_series.h"
#include "engine/simulator/build.h"

namespace viscera::test {
namespace {

constexpr double kTop = 25e-3;  // pole of the ball [m]
constexpr int kWidth = 160, kHeight = 90;

}  // namespace

SceneDescription watched_scene() {
  SceneDescription scene = soft_ball_scene(7e-3, 5e-3);
  scene.name = "watched";
  scene.instruments = {straight_tool("hook", InstrumentKind::kHook, 1e-3,
                                     {{0.0, Vec3(0, 0, kTop + 1.5e-3), 30.0, 1.0},
                                      {0.2, Vec3(0, 0, kTop + 0.1e-3), 30.0, 1.0},
                                      {0.5, Vec3(2e-3, 0, kTop - 0.5e-3), 30.0, 1.0}})};
  scene.extras.get<HeatDescription>().lesion_of = "hook";
  SmokeDescription smoke;
  smoke.name = "plume";
  smoke.domain = Box(Vec3(-30e-3, -30e-3, 15e-3), Vec3(30e-3, 30e-3, 60e-3));
  EmitterDescription steady;
  steady.position = Vec3(10e-3, 0, kTop + 5e-3);
  steady.rate = 2e-6;
  steady.particles = 600;
  steady.when = {0.15, 10.0};
  smoke.emitters = {steady};
  scene.extras.set(SmokeDescriptions{smoke});
  CameraDescription camera;
  CameraKey key;
  key.tip = Vec3(0, -0.1, 40e-3);
  key.target = Vec3(0, 0, kTop);
  camera.path = {key};
  scene.camera = camera;
  return scene;
}

WatchedRun::WatchedRun(const SceneDescription& scene, const std::filesystem::path& folder,
                       bool pictures, std::uint64_t frame)
    : scene_(scene), folder_(folder), world_(build(scene)), trace_(stage_names()) {
  Trace unseen(stage_names());
  while (world_->frame() < frame) step_frame(*world_, unseen);
  if (pictures) {
    auto studio = Studio::open({kWidth, kHeight, Quality::kDraft, true}, nullptr);
    if (studio) studio_ = *std::move(studio);
    EXPECT_TRUE(studio_);
    auto film = FilmMaker::start(folder, kWidth, kHeight);
    EXPECT_TRUE(film) << film.error().text();
    if (film) watch_.add(*std::move(film));
    watch_.add(std::make_unique<FramePictures>());
    watch_.add(std::make_unique<PassSeries>(scene, std::set<Pass>{Pass::kDepth, Pass::kBeauty}));
  }
  makers_.emplace(FrameViews::Makers{.scene = scene, .studio = studio_.get(), .clock = clock_});
  makers_->endoscope.emplace(*scene.camera);
  watch_.add(std::make_unique<VtkSeries>(*world_));
  watch_.add(std::make_unique<SmokeSeries>(scene.name));
  watch_.add(std::make_unique<Sight>());
  watch_.add(std::make_unique<RunHash>());
  watch_.add(std::make_unique<LesionCurve>(*world_, scene));
  watch_.add(std::make_unique<Trainee>(*world_, scene));
  watch_.add(std::make_unique<ReviewRecorder>(*world_, scene, trace_, pictures ? kFilmName : "",
                                              pictures));
  watch_.add(std::make_unique<ForceCurves>(scene));
}

WatchedRun::~WatchedRun() = default;

Result<void> WatchedRun::begin() {
  if (auto opened = watch_.open(folder_); !opened) return opened;
  return watch_.begin();
}

Result<void> WatchedRun::go_on(const Checkpoint& checkpoint) {
  if (auto opened = watch_.open(folder_); !opened) return opened;
  return watch_.load(checkpoint, {});
}

Result<void> WatchedRun::step_to(std::uint64_t frame) {
  Trace unseen(stage_names());
  while (world_->frame() < frame) {
    step_frame(*world_, unseen);
    watch_.add_frame(*world_);
    const std::uint64_t apart = steps_a_picture(world_->model().steps());
    if (world_->frame() % apart != 0) continue;
    const std::uint64_t number = world_->frame() / apart - 1;
    FrameViews views(*world_, *makers_, number, number);
    if (auto seen = watch_.add_picture(views, clock_, true); !seen) return seen;
  }
  return {};
}

Result<Checkpoint> WatchedRun::save() {
  Checkpoint checkpoint;
  if (auto saved = watch_.save(checkpoint.parts); !saved) return std::unexpected(saved.error());
  return checkpoint;
}

Result<RunReport> WatchedRun::end() {
  if (auto closed = watch_.close(*world_); !closed) return std::unexpected(closed.error());
  RunReport report;
  report.duration_s = world_->time();
  watch_.describe(*world_, report);
  report.sections.push_back(report_section("smoke", {{"writing_s", 0.0}}));
  if (auto shown = watch_.present(report); !shown) return std::unexpected(shown.error());
  return report;
}

}  // namespace viscera::test
