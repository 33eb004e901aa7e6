#include "tools/bench/bench_smoke_picture.h"

#include "engine/io/interrupt.h"
#include "engine/io/trace.h"
#include "kernels/base/stopwatch.h"

namespace viscera {
namespace {

constexpr double kFieldOfView = 0.5;  // vertical [rad]

}  // namespace

Result<SmokePictures> SmokePictures::create(std::shared_ptr<EglContext> context) {
  RenderOptions options;
  options.width = kWidth;
  options.height = kHeight;
  options.quality = Quality::kReview;
  options.context = std::move(context);
  auto renderer = Renderer::create(options);
  if (!renderer) return std::unexpected(renderer.error());
  return SmokePictures(*std::move(renderer));
}

Result<SmokePictureTimes> SmokePictures::time(const SmokeCase& smoke, const SmokeGrid& grid,
                                              int pictures) {
  const Box& domain = smoke.parameters().domain;
  std::vector<Vec3f> positions, normals;
  for (const Vec3& at : smoke.sheet().vertices) positions.push_back(at.cast<float>());
  for (const Vec3& normal : vertex_normals(smoke.sheet())) normals.push_back(normal.cast<float>());
  FrameView view;
  // From the top of the smoke the sheet is wider than the view.
  view.camera.position = domain.center();
  view.camera.position.z() = domain.max().z();
  view.camera.forward = -Vec3::UnitZ();
  view.camera.up = Vec3::UnitY();
  view.camera.field_of_view = kFieldOfView;
  view.camera.round_mask = false;
  OrganView sheet;
  sheet.id = ++sheets_;
  sheet.name = "sheet";
  sheet.rest = &smoke.sheet();
  sheet.positions = positions;
  sheet.normals = normals;
  view.organs.push_back(sheet);
  SmokeView drawn;
  drawn.domain = grid.domain;
  drawn.size = grid.size;
  drawn.density = grid.density;
  drawn.temperature = grid.temperature;
  view.smoke.push_back(drawn);

  std::vector<double> times;
  for (int p = 0; p <= pictures; ++p) {
    if (interrupted()) return failure(kCancelled);
    const Stopwatch watch;
    if (auto done = renderer_->draw(view, picture_); !done) return std::unexpected(done.error());
    if (p > 0) times.push_back(1e3 * watch.seconds());
    ++view.frame;
  }
  const Quantiles found = quantiles(times);
  return SmokePictureTimes{found.median, found.p99};
}

}  // namespace viscera
