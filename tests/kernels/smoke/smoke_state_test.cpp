#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "engine/verification/bodies.h"
#include "kernels/base/archive.h"
#include "kernels/base/random.h"
#include "kernels/smoke/gas_around.h"
#include "kernels/smoke/smoke.h"

namespace viscera {
namespace {

constexpr double kFrame = 1.0 / 60.0;
constexpr int kFrames = 100;

SmokeParameters cavity() {
  SmokeParameters parameters;
  parameters.domain = Box(Vec3(-0.04, -0.04, 0.3), Vec3(0.04, 0.04, 0.38));
  parameters.lifetime = 0.6;
  parameters.max_particles = 1500;
  return parameters;
}

GasParameters gas_of(const SmokeParameters& smoke) {
  GasParameters parameters;
  parameters.domain = smoke.domain;
  parameters.cells = 14;
  return parameters;
}

/// How many of the frames up to this one lie in every other stretch of that length.
int moved_by(int frame, int stretch) {
  int count = 0;
  for (int f = 0; f <= frame; ++f) count += f / stretch % 2 == 0;
  return count;
}

/// A plume under a ball that beats, moves and turns at times, a second one that comes and goes, a
/// tool and an outlet, in gas. What happens in a frame follows from its number; so all that lasts
/// is in the volume and the gas.
struct Room {
  explicit Room(int rings = 9) : shape(ringed_hemisphere(1.0, rings)), topology(triangles()) {}

  std::vector<Eigen::Vector3i> triangles() const {
    std::vector<Eigen::Vector3i> made;
    for (const auto& t : shape.triangles) made.emplace_back(t[0], t[1], t[2]);
    return made;
  }
  std::vector<Vec3f> grown(double radius) const {
    std::vector<Vec3f> vertices;
    for (const Vec3& at : shape.vertices) vertices.push_back((radius * at).cast<float>());
    return vertices;
  }
  void step(int frame) {
    if (frame % 3 != 1) {
      volume.emit({.position = Vec3(0.0, 0.0, 0.32),
                   .mass = 2e-7,
                   .particles = 20 + frame % 5,
                   .duration = kFrame});
      gas.give({.position = Vec3(0.0, 0.0, 0.32),
                .reach = 0.01,
                .impulse = 1e-8,
                .gift = GasGift::steam(GasMixture(), 2e-8, 380.0)});
    }
    const int beats = moved_by(frame, 5), turns = moved_by(frame, 9), ways = moved_by(frame, 4);
    const std::vector<Vec3f> beating = grown(0.012 + 0.001 * std::sin(0.4 * beats));
    const std::vector<Vec3f> still = grown(0.006);
    std::vector<SmokeSurface> surfaces;
    surfaces.push_back(
        {7, &topology, beating,
         Pose{Vec3(0.004, 4e-4 * ways, 0.33),
              Quaternion(Eigen::AngleAxisd(3.0 + 0.02 * turns, Vec3(1, 1, 0).normalized()))},
         static_cast<std::uint64_t>(beats)});
    if (frame / 6 % 2 == 0)
      surfaces.insert(
          surfaces.begin(),
          {3, &topology, still, Pose{Vec3(-0.008, 0.0, 0.324), Quaternion::Identity()}, 1});
    const SmokeObstacle tool = {.from = Vec3(0.0, -0.006, 0.323),
                                .to = Vec3(0.0, -0.03, 0.33),
                                .from_before = Vec3(0.0, -0.0062, 0.323),
                                .to_before = Vec3(0.0, -0.03, 0.33),
                                .radius = 2e-3};
    const SmokeOutlet outlet = {.position = Vec3(0.0, 0.015, 0.33),
                                .radius = 4e-3,
                                .flow = frame / 8 % 2 == 0 ? 5e-5 : 0.0};
    const GasEvacuator suction = {.position = outlet.position, .flow = outlet.flow};
    gas.set_evacuators({&suction, 1});
    GasAround around(gas, volume.parameters().domain.min());
    volume.step(
        kFrame,
        {.gas = &around, .surfaces = surfaces, .obstacles = {&tool, 1}, .outlets = {&outlet, 1}});
    gas.step(kFrame);
  }

  TriangleSurface shape;
  SurfaceTopology topology;
  SmokeVolume volume{cavity()};
  GasGrid gas{gas_of(cavity())};
};

template <class T>
void take(const std::vector<std::byte>& bytes, T& into) {
  ByteReader reader(bytes);
  typename T::State state;
  read(reader, state);
  ASSERT_FALSE(reader.failed());
  ASSERT_TRUE(reader.at_end());
  ASSERT_TRUE(into.fits(state));
  into.restore(std::move(state));
}

struct Moment {
  std::vector<std::byte> smoke, gas;
};

/// The states after each frame of one life.
const std::vector<Moment>& one_life() {
  static const std::vector<Moment> moments = [] {
    std::vector<Moment> made;
    Room room;
    for (int frame = 0; frame < kFrames; ++frame) {
      room.step(frame);
      made.push_back({saved(room.volume), saved(room.gas)});
    }
    return made;
  }();
  return moments;
}

void expect_the_same_life(Room& room, int from) {
  for (int frame = from + 1; frame < kFrames; ++frame) {
    room.step(frame);
    const Moment& expected = one_life()[static_cast<std::size_t>(frame)];
    if (saved(room.volume) == expected.smoke && saved(room.gas) == expected.gas) continue;
    Room other;
    take(expected.smoke, other.volume);
    take(expected.gas, other.gas);
    FAIL() << "from " << from << ", frame " << frame << ": "
           << first_difference(other.volume, room.volume) << ' '
           << first_difference(other.gas, room.gas);
  }
}

void restore(Room& room, int frame) {
  take(one_life()[static_cast<std::size_t>(frame)].smoke, room.volume);
  take(one_life()[static_cast<std::size_t>(frame)].gas, room.gas);
}

std::set<int> random_frames(std::uint64_t seed, int count) {
  std::set<int> frames;
  for (std::uint64_t i = 0; static_cast<int>(frames.size()) < count; ++i)
    frames.insert(static_cast<int>((kFrames - 10) * Random(seed, 0).uniform(i)));
  return frames;
}

TEST(SmokeState, ItsTestMeetsAllThatLasts) {
  Room room;
  std::uint64_t touching = 0;
  for (int frame = 0; frame < kFrames; ++frame) {
    room.step(frame);
    touching += room.volume.counters().touching;
  }
  EXPECT_GT(touching, 1000u);
  EXPECT_GT(room.volume.counters().retired, 100u);
  EXPECT_GT(room.volume.book().background, 0.0);
  EXPECT_GT(room.volume.book().evacuated, 0.0);
  EXPECT_GT(room.volume.book().deposited, 0.0);
  EXPECT_GT(room.gas.report().speed, 0.01);
  const SurfaceCells::State& surfaces = room.volume.surface_cells().state();
  ASSERT_FALSE(surfaces.surfaces.empty());
  EXPECT_TRUE(surfaces.surfaces.back().surface.state().blocks_fit);
}

TEST(SmokeState, ANewVolumeGoesOnFromRandomMomentsToTheBit) {
  for (const int frame : random_frames(1, 6)) {
    Room room;
    restore(room, frame);
    expect_the_same_life(room, frame);
  }
}

TEST(SmokeState, AVolumeThatLivedOtherwiseGoesOnFromRandomMomentsToTheBit) {
  Room room;
  for (int frame = 300; frame < 330; ++frame) room.step(frame);
  for (const int frame : random_frames(2, 4)) {
    restore(room, frame);
    expect_the_same_life(room, frame);
  }
}

TEST(SmokeState, ACopyGoesOnToTheBitWhileTheFirstDoesSomethingElse) {
  Room room, other;
  for (int frame = 0; frame <= 50; ++frame) room.step(frame);
  SmokeVolume::State smoke = room.volume.state();
  GasGrid::State gas = room.gas.state();
  for (int frame = 200; frame < 205; ++frame) room.step(frame);
  other.volume.restore(std::move(smoke));
  other.gas.restore(std::move(gas));
  expect_the_same_life(other, 50);
}

TEST(SmokeState, BytesThatEndEarlyAreRefusedAndChangeNothing) {
  const std::vector<std::byte>& bytes = one_life()[60].smoke;
  Room room;
  room.step(0);
  const std::vector<std::byte> before = saved(room.volume);
  for (std::uint64_t i = 0; i < 200; ++i) {
    const auto size =
        static_cast<std::size_t>(static_cast<double>(bytes.size()) * Random(3, 0).uniform(i));
    ByteReader reader(std::span<const std::byte>(bytes).first(size));
    read(reader, room.volume);
    EXPECT_TRUE(reader.failed()) << size;
  }
  EXPECT_EQ(saved(room.volume), before);
}

TEST(SmokeState, WhatIsNotOfSuchAVolumeDoesNotFit) {
  const auto fits_after = [](const std::function<void(SmokeVolume::State&)>& change) {
    Room room;
    restore(room, 60);
    SmokeVolume::State state = room.volume.state();
    change(state);
    return room.volume.fits(state);
  };
  const auto with_surface = [&](const std::function<void(MovingSurface::State&)>& change) {
    return fits_after([&](SmokeVolume::State& state) {
      SurfaceCells::State cells = state.surfaces.state();
      MovingSurface& last = cells.surfaces.back().surface;
      MovingSurface::State surface = last.state();
      change(surface);
      last.restore(std::move(surface));
      state.surfaces.restore(std::move(cells));
    });
  };
  using State = SmokeVolume::State;
  using Surface = MovingSurface::State;
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_TRUE(fits_after([](State&) {}));
  EXPECT_FALSE(fits_after([](State& s) { s.particles.masses.pop_back(); }));
  EXPECT_FALSE(fits_after([](State& s) { s.particles.ids.push_back(1); }));
  EXPECT_FALSE(fits_after([](State& s) { s.particles.resize(cavity().max_particles + 1); }));
  EXPECT_FALSE(fits_after([](State& s) { s.particles.positions[2].y = kNan; }));
  EXPECT_FALSE(fits_after([](State& s) { s.particles.velocities[1].w = 1.0f / 0.0f; }));
  EXPECT_TRUE(with_surface([](Surface&) {}));
  EXPECT_FALSE(with_surface([](Surface& s) { s.shape.front().x() = kNan; }));
  EXPECT_FALSE(with_surface([](Surface& s) { s.order[3] = static_cast<int>(s.order.size()); }));
  EXPECT_FALSE(with_surface([](Surface& s) { s.order[3] = -1; }));
  EXPECT_FALSE(with_surface([](Surface& s) { s.blocks.pop_back(); }));
  EXPECT_FALSE(with_surface([](Surface& s) { s.groups.emplace_back(); }));
}

TEST(SmokeState, ASurfaceOfOtherTrianglesThanThenCountsAsNotHavingMoved) {
  Room room, finer(10);
  restore(room, 60);
  restore(finer, 60);
  const std::vector<Vec3f> now = room.grown(0.02), now_finer = finer.grown(0.02);
  const SmokeSurface same = {7, &room.topology, now, Pose{Vec3(0, 0, 0.35)}, 0};
  const SmokeSurface other = {7, &finer.topology, now_finer, Pose{Vec3(0, 0, 0.35)}, 0};
  const Eigen::AlignedBox3f all(Vec3f::Constant(-1.0f), Vec3f::Constant(1.0f));
  SurfaceCells cells = room.volume.surface_cells();
  cells.advance({&same, 1}, cavity().domain.min());
  EXPECT_GT(cells.greatest_way(all), 5e-3f);
  cells = room.volume.surface_cells();
  cells.advance({&other, 1}, cavity().domain.min());
  EXPECT_EQ(cells.greatest_way(all), 0.0f);
  // And it may be stepped on with, whatever the order of the old triangles was.
  const std::vector<Float4> particles = room.volume.particles().positions;
  const std::vector<Float4> still(particles.size(), Float4{});
  cells.build(particles, still, 1.0, kFrame, 3e-3f, {2e-3f, 0.0f}, {});
  EXPECT_GT(cells.triangles().size(), 0u);
}

}  // namespace
}  // namespace viscera
