#include "engine/verification/ball_and_hive.h"

#include <algorithm>
#include <cmath>

#include "kernels/contact/cell_pattern.h"

namespace viscera {
namespace {

constexpr double kHalfGround = 10.0, kHiveRadius = 4.0;  // radii of the ball
constexpr int kSquares = 20, kHiveNodes = 80;

TriangleSurface flat_ground(double half) {
  TriangleSurface flat;
  for (int i = 0; i <= kSquares; ++i)
    for (int j = 0; j <= kSquares; ++j)
      flat.vertices.emplace_back(half * (2.0 * i / kSquares - 1.0),
                                 half * (2.0 * j / kSquares - 1.0), 0.0);
  for (int i = 0; i < kSquares; ++i)
    for (int j = 0; j < kSquares; ++j) {
      const int a = i * (kSquares + 1) + j, b = a + kSquares + 1;
      flat.triangles.push_back({a, b, b + 1});
      flat.triangles.push_back({a, b + 1, a + 1});
    }
  return flat;
}

}  // namespace

BallAndHive::BallAndHive(const NonlinearSettings& settings, double ball_radius)
    : ball_(ball_radius),
      rings_(settings.rings),
      material_(settings.material),
      places_(hexagonal_grid(1.0, settings.rings).places),
      ground_(std::make_unique<WalkableSurface>(
          WalkableSurface::make(flat_ground(kHalfGround * ball_radius)).value())),
      nonlinear_(std::make_unique<NonlinearHive>(NonlinearHive::create(settings).value())) {
  hive_ = std::make_unique<Hive>(another());
}

Hive BallAndHive::another() const {
  HiveSettings settings;
  settings.material = material_;
  settings.radius = kHiveRadius * ball_;
  settings.nodes = kHiveNodes;
  Hive hive =
      Hive::create({ground_.get(), nullptr, nullptr}, settings, static_cast<int>(places_.size()))
          .value();
  hive.build(ground_->nearest(Vec3(0.2 * ball_, 0.4 * ball_, 0.0)));
  if (!cells_.empty()) hive.seat(cells_);
  return hive;
}

void BallAndHive::seat(double depth) {
  across_ = ball_pattern_radius(ball_, depth);
  const double pitch = across_ / (rings_ + 0.1);
  cells_.clear();
  depths_.clear();
  for (const Vec2& place : places_) {
    ContactCell cell;
    cell.position = hive_->centre().position + Vec3(pitch * place.x(), pitch * place.y(), 0.0);
    cell.area = std::sqrt(0.75) * pitch * pitch;
    cells_.push_back(cell);
    depths_.push_back(depth - ball_ +
                      std::sqrt(ball_ * ball_ - pitch * pitch * place.squaredNorm()));
  }
  hive_->seat(cells_);
}

double BallAndHive::linear(double depth) {
  seat(depth);
  return hive_->press(depths_).force.z();
}

NonlinearForce BallAndHive::press(double depth, TimeIsUp time) {
  seat(depth);
  const NonlinearHive::Share share{hive_.get(), 1.0};
  return nonlinear_->press({&share, 1}, depths_, across_, ball_, time);
}

NonlinearForce BallAndHive::go(double from, double to, double step) {
  const int ticks = std::max(1, static_cast<int>(std::ceil(std::abs(to - from) / step)));
  NonlinearForce force;
  for (int i = 1; i <= ticks; ++i) force = press(from + (to - from) * i / ticks);
  return force;
}

}  // namespace viscera
