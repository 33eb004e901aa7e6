#include "kernels/smoke/collide.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <vector>

#include "kernels/base/random.h"
#include "kernels/smoke/smoke.h"

namespace viscera {
namespace {

/// A ball of unit radius from an octahedron, each triangle split in four `times` times.
struct Ball {
  std::vector<Vec3> directions;
  std::vector<SurfaceTopology::Triangle> triangles;

  explicit Ball(int times) {
    for (int axis = 0; axis < 3; ++axis)
      for (const double sign : {1.0, -1.0}) directions.push_back(sign * Vec3::Unit(axis));
    for (int corner = 0; corner < 8; ++corner) {
      const int x = corner & 1, y = 2 + (corner >> 1 & 1), z = 4 + (corner >> 2 & 1);
      const bool flip = ((corner & 1) + (corner >> 1 & 1) + (corner >> 2 & 1)) % 2 != 0;
      triangles.push_back(flip ? Eigen::Vector3i(x, z, y) : Eigen::Vector3i(x, y, z));
    }
    for (int t = 0; t < times; ++t) split();
  }

  void split() {
    std::map<std::pair<int, int>, int> middles;
    const auto middle = [&](int a, int b) {
      const auto [entry, fresh] =
          middles.try_emplace(std::minmax(a, b), static_cast<int>(directions.size()));
      if (fresh) directions.push_back((directions[a] + directions[b]).normalized());
      return entry->second;
    };
    std::vector<SurfaceTopology::Triangle> finer;
    for (const SurfaceTopology::Triangle& t : triangles) {
      const int a = middle(t[0], t[1]), b = middle(t[1], t[2]), c = middle(t[2], t[0]);
      finer.insert(finer.end(), {{t[0], a, c}, {a, t[1], b}, {c, b, t[2]}, {a, b, c}});
    }
    triangles = finer;
  }
};

// An organ's like: bumps, and a shape that breathes.
double bumpy_radius(const Vec3& d, double time, double radius) {
  const double phase = 2.0 * std::numbers::pi * time;
  return radius * (1.0 + 0.12 * std::sin(5.0 * d.x() + phase) * std::cos(4.0 * d.y()) +
                   0.15 * std::sin(1.3 * phase) + 0.06 * std::sin(9.0 * d.z() - phase));
}

std::vector<Vec3f> bumpy_ball(const Ball& ball, double time, double radius) {
  std::vector<Vec3f> positions;
  for (const Vec3& d : ball.directions) {
    positions.push_back((bumpy_radius(d, time, radius) * d).cast<float>());
  }
  return positions;
}

/// The solid angle of a surface at a point, in units of the whole: 1 inside, 0 outside.
double winding(std::span<const Vec3f> positions, std::span<const SurfaceTopology::Triangle> faces,
               const Vec3& at) {
  double sum = 0.0;
  for (const SurfaceTopology::Triangle& t : faces) {
    const Vec3 a = positions[t[0]].cast<double>() - at, b = positions[t[1]].cast<double>() - at,
               c = positions[t[2]].cast<double>() - at;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    sum += 2.0 * std::atan2(a.dot(b.cross(c)),
                            la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return sum / (4.0 * std::numbers::pi);
}

SmokeParameters around_ball() {
  SmokeParameters parameters;
  parameters.domain = Box(Vec3::Constant(-0.035), Vec3::Constant(0.035));
  parameters.lifetime = 1e6;
  parameters.deposition_velocity = 0.0;
  return parameters;
}

void emit_around(SmokeVolume& smoke, double distance, int number) {
  for (int i = 0; i < number; ++i) {
    const Vec3 d = Random(4, 0).direction(i);
    smoke.emit({.position = distance * d,
                .direction = -d,
                .radius = 1e-3,
                .temperature = 30.0,
                .mass = 1e-9,
                .particles = 1});
  }
}

int inside(const SmokeVolume& smoke, std::span<const Vec3f> positions,
           std::span<const SurfaceTopology::Triangle> faces) {
  int count = 0;
  for (std::size_t i = 0; i < smoke.particles().size(); ++i) {
    const Vec3 at = smoke.particles().position(i).cast<double>() + smoke.parameters().domain.min();
    count += winding(positions, faces, at) > 0.5;
  }
  return count;
}

TEST(Collide, NoParticleIsInsideABreathingOrganAfterTenThousandSteps) {
  const Ball ball(3);
  const SurfaceTopology topology(ball.triangles);
  SmokeParameters parameters = around_ball();
  SmokeVolume smoke(parameters);
  emit_around(smoke, 0.026, 120);
  const double dt = 1.0 / 60.0;
  std::uint64_t tested = 0, touching = 0;
  for (int step = 1; step <= 10000; ++step) {
    const std::vector<Vec3f> positions = bumpy_ball(ball, 0.4 * step * dt, 0.015);
    const SmokeSurface surface = {
        .id = 1, .topology = &topology, .positions = positions, .pose = {}};
    smoke.step(dt, {.surfaces = {&surface, 1}});
    tested += smoke.counters().tested;
    touching += smoke.counters().touching;
    if (step % 500 != 0) continue;
    ASSERT_EQ(inside(smoke, positions, ball.triangles), 0) << step;
  }
  EXPECT_EQ(smoke.particles().size(), 120u);
  EXPECT_EQ(smoke.counters().trapped, 0u);
  EXPECT_GT(touching, 10000u);
  EXPECT_LT(tested, 9000u * 120u);  // those far away weren't
}

TEST(Collide, ASurfaceThatMovesByManyCellsInAStepTakesParticlesAlong) {
  const Ball ball(2);
  const SurfaceTopology topology(ball.triangles);
  const std::vector<Vec3f> positions = bumpy_ball(ball, 0.0, 0.01);
  SmokeParameters parameters = around_ball();
  parameters.eddies.share = parameters.gravity = 0.0;
  SmokeVolume smoke(parameters);
  smoke.emit({.position = Vec3(0.012, 0.0, 0.0),
              .speed = 0.0,
              .radius = 4e-3,
              .mass = 1e-7,
              .particles = 300});
  SmokeSurface surface = {.id = 1, .topology = &topology, .positions = positions, .pose = {}};
  surface.pose.position.x() = -0.02;
  smoke.step(1.0 / 60.0, {.surfaces = {&surface, 1}});
  for (const double x : {0.018, -0.02, 0.02}) {
    surface.pose.position.x() = x;
    smoke.step(1.0 / 60.0, {.surfaces = {&surface, 1}});
    std::vector<Vec3f> moved = positions;
    for (Vec3f& p : moved) p.x() += static_cast<float>(x);
    EXPECT_EQ(inside(smoke, moved, ball.triangles), 0) << x;
    EXPECT_EQ(smoke.particles().size(), 300u);
  }
}

TEST(Collide, ASurfaceThatSaysThatItKeepsItsShapeIsMetAsOneThatDoesNot) {
  const Ball ball(3);
  const SurfaceTopology topology(ball.triangles);
  std::array<SmokeVolume, 2> smoke = {SmokeVolume(around_ball()), SmokeVolume(around_ball())};
  for (SmokeVolume& volume : smoke) emit_around(volume, 0.016, 300);
  std::uint64_t touching = 0;
  for (int step = 0; step < 60; ++step) {
    // Keeps its shape for five steps, then has another; all the time it moves and turns.
    const int shape = step / 5;
    const std::vector<Vec3f> positions = bumpy_ball(ball, 0.02 * shape, 0.01);
    SmokeSurface surface = {.id = 1, .topology = &topology, .positions = positions, .pose = {}};
    surface.pose.position.z() = 0.002 * std::sin(0.3 * step);
    surface.pose.orientation = Eigen::AngleAxisd(0.02 * step, Vec3::UnitY());
    smoke[0].step(1.0 / 60.0, {.surfaces = {&surface, 1}});
    surface.version = static_cast<std::uint64_t>(shape) + 1;
    smoke[1].step(1.0 / 60.0, {.surfaces = {&surface, 1}});
    ASSERT_EQ(smoke[0].particles().size(), smoke[1].particles().size()) << step;
    for (std::size_t i = 0; i < smoke[0].particles().size(); ++i)
      ASSERT_EQ(smoke[0].particles().position(i), smoke[1].particles().position(i)) << step;
    touching += smoke[1].counters().touching;
  }
  EXPECT_GT(touching, 0u);
}

TEST(Collide, WhatIsSqueezedBetweenOrgansDeposits) {
  const Ball ball(2);
  const SurfaceTopology topology(ball.triangles);
  const std::vector<Vec3f> positions = bumpy_ball(ball, 0.0, 0.01);
  SmokeVolume smoke(around_ball());
  smoke.emit({.speed = 0.0, .radius = 1e-3, .mass = 1e-7, .particles = 50});
  std::array<SmokeSurface, 2> surfaces = {
      SmokeSurface{.id = 1, .topology = &topology, .positions = positions, .pose = {}},
      SmokeSurface{.id = 2, .topology = &topology, .positions = positions, .pose = {}}};
  for (int step = 0; step <= 60; ++step) {
    surfaces[0].pose.position.x() = -0.016 + 0.0002 * step;
    surfaces[1].pose.position.x() = 0.016 - 0.0002 * step;
    smoke.step(1.0 / 60.0, {.surfaces = surfaces});
    for (const SmokeSurface& surface : surfaces) {
      std::vector<Vec3f> moved = positions;
      for (Vec3f& p : moved) p += surface.pose.position.cast<float>();
      ASSERT_EQ(inside(smoke, moved, ball.triangles), 0) << step;
    }
  }
  EXPECT_NEAR(smoke.airborne(), smoke.book().owed_airborne(), 1e-12 * smoke.book().emitted);
}

TEST(Collide, ParticlesStayOutOfAMovingInstrument) {
  SmokeParameters parameters = around_ball();
  SmokeVolume smoke(parameters);
  smoke.emit({.position = Vec3(0.0, 0.0, 0.0), .radius = 8e-3, .mass = 1e-7, .particles = 400});
  SmokeObstacle tool = {
      .from = Vec3(-0.03, 0.0, 0.0), .to = Vec3(-0.03, 0.0, 0.05), .radius = 2.5e-3};
  for (int step = 0; step < 120; ++step) {
    tool.from_before = tool.from, tool.to_before = tool.to;
    tool.from.x() = -0.03 * std::cos(0.2 * step);
    tool.to.x() = -0.02 * std::cos(0.2 * step);
    smoke.step(1.0 / 60.0, {.obstacles = {&tool, 1}});
    for (std::size_t i = 0; i < smoke.particles().size(); ++i) {
      const Vec3 at = smoke.particles().position(i).cast<double>() + parameters.domain.min();
      const Vec3 way = tool.to - tool.from;
      const double s = std::clamp(way.dot(at - tool.from) / way.squaredNorm(), 0.0, 1.0);
      ASSERT_GT((at - tool.from - s * way).norm(), tool.radius - 1e-6) << step;
    }
  }
  EXPECT_GT(smoke.counters().tested, 0u);
  EXPECT_LT(smoke.counters().tested, 400u);
}

TEST(Collide, EveryInstrumentIsMetHoweverManyThereAre) {
  // Forty rods side by side, more than a cell has bits, and smoke between them all.
  std::vector<SmokeObstacle> rods(40);
  for (std::size_t r = 0; r < rods.size(); ++r) {
    const double x = -0.03 + 0.0015 * static_cast<double>(r);
    rods[r].from = rods[r].from_before = Vec3(x, 0, -0.02);
    rods[r].to = rods[r].to_before = Vec3(x, 0, 0.02);
    rods[r].radius = 0.5e-3;
  }
  SmokeVolume smoke(around_ball());
  for (int frame = 0; frame < 20; ++frame) {
    for (const SmokeObstacle& rod : rods)
      ASSERT_TRUE(smoke.emit({.position = rod.from + Vec3(0.75e-3, 0, 0.01 + 1e-3 * frame),
                              .direction = Vec3::UnitX(),
                              .radius = 0.2e-3,
                              .mass = 1e-10,
                              .particles = 10}));
    smoke.step(1.0 / 60.0, {.obstacles = rods});
    for (std::size_t i = 0; i < smoke.particles().size(); ++i) {
      const Vec3 at =
          smoke.particles().position(i).cast<double>() + smoke.parameters().domain.min();
      for (std::size_t r = 0; r < rods.size(); ++r) {
        if (std::abs(at.z()) > 0.02) continue;
        ASSERT_GT(std::hypot(at.x() - rods[r].from.x(), at.y()), rods[r].radius - 1e-6)
            << "rod " << r << ", frame " << frame;
      }
    }
  }
  EXPECT_GT(smoke.counters().touching, 100u);
}

TEST(Collide, SmokeThatTouchesDepositsAtTheDepositionVelocity) {
  SmokeParameters parameters = around_ball();
  parameters.eddies.share = parameters.gravity = 0.0;
  parameters.deposition_velocity = 3e-4;
  SmokeVolume smoke(parameters);
  smoke.emit({.position = Vec3(0.0102, 0.0, 0.0),
              .speed = 0.0,
              .radius = 0.0,
              .mass = 1e-9,
              .particles = 1});
  smoke.emit({.position = Vec3(0.02, 0.0, 0.0),
              .speed = 0.0,
              .radius = 0.0,
              .mass = 1e-9,
              .particles = 1});
  const SmokeObstacle rod = {.from = Vec3(0.0, 0.0, -0.02),
                             .to = Vec3(0.0, 0.0, 0.02),
                             .from_before = Vec3(0.0, 0.0, -0.02),
                             .to_before = Vec3(0.0, 0.0, 0.02),
                             .radius = 0.01};
  for (int step = 0; step < 60; ++step) smoke.step(1.0 / 60.0, {.obstacles = {&rod, 1}});
  // Half a support radius of gas in front of the surface: rate v / (h/2), for a second.
  const double left = std::exp(-3e-4 / (0.5 * parameters.spacing));
  EXPECT_NEAR(smoke.book().deposited, 1e-9 * (1.0 - left), 1e-4 * 1e-9);
  EXPECT_NEAR(smoke.airborne() + smoke.book().deposited, smoke.book().emitted, 1e-20);
}

TEST(Collide, ASurfaceThatIsNotFiniteIsLeftOut) {
  const Ball ball(1);
  const SurfaceTopology topology(ball.triangles);
  std::vector<Vec3f> positions = bumpy_ball(ball, 0.0, 0.01);
  positions[3].x() = std::numeric_limits<float>::quiet_NaN();
  SmokeVolume smoke(around_ball());
  emit_around(smoke, 0.012, 50);
  const SmokeSurface surface = {.id = 1, .topology = &topology, .positions = positions, .pose = {}};
  smoke.step(1.0 / 60.0, {.surfaces = {&surface, 1}});
  EXPECT_EQ(smoke.counters().tested, 0u);
  for (std::size_t i = 0; i < smoke.particles().size(); ++i) {
    EXPECT_TRUE(smoke.particles().position(i).allFinite());
  }
}

}  // namespace
}  // namespace viscera
