#include "engine/gpu/gpu_smoke.h"

#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <numbers>
#include <set>
#include <stdexcept>

#include "engine/gpu/egl_context.h"
#include "kernels/base/random.h"
#include "kernels/smoke/integrate.h"
#include "kernels/smoke/smoke.h"
#include "tests/engine/gpu/smoke_cloud.h"

namespace viscera {
namespace {

constexpr double kUnit = 0x1p-24;  // rounding of single precision

bool same(const Float4& a, const Float4& b) {
  return std::memcmp(&a, &b, sizeof a) == 0;
}

bool same(const SmokeParticles& a, const SmokeParticles& b) {
  return a.size() == b.size() &&
         std::ranges::equal(a.positions, b.positions,
                            [](auto& p, auto& q) { return same(p, q); }) &&
         std::ranges::equal(a.velocities, b.velocities,
                            [](auto& p, auto& q) { return same(p, q); }) &&
         a.masses == b.masses && a.ids == b.ids;
}

/// The particles by id.
SmokeParticles sorted_by_id(const SmokeParticles& particles) {
  std::vector<std::size_t> order(particles.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::ranges::sort(order, {}, [&](std::size_t i) { return particles.ids[i]; });
  SmokeParticles sorted;
  sorted.resize(particles.size());
  for (std::size_t i = 0; i < order.size(); ++i) sorted.copy(order[i], particles, i);
  return sorted;
}

double greatest_speed(const SmokeParticles& particles) {
  double most = 0.0;
  for (const Float4& v : particles.velocities) most = std::max<double>(most, v.xyz().norm());
  return most;
}

class GpuSmokeTest : public testing::Test {
 protected:
  void SetUp() override {
    auto made = EglContext::create();
    if (!made) GTEST_SKIP() << made.error().text();
    context_ = *std::move(made);
    RecordProperty("device", context_->device());
    gpu_ = create();
  }
  static std::shared_ptr<GpuSmoke> create(GpuLimits limits = GpuLimits::of_device(),
                                          std::shared_ptr<EglContext> context = nullptr) {
    auto made = GpuSmoke::create(limits, std::move(context));
    if (!made) throw std::runtime_error(made.error().text());
    return *std::move(made);
  }

  std::unique_ptr<EglContext> context_;
  std::shared_ptr<GpuSmoke> gpu_;
};

TEST_F(GpuSmokeTest, BinSortsIntoTheVeryOrderOfTheCpu) {
  // Not multiples of a work group; all in one cell; many more cells than particles.
  struct Case {
    int count;
    float cell;
  };
  for (const auto& [count, cell] :
       {Case{1, 3e-3f}, {127, 1.0f}, {2000, 3e-3f}, {20011, 3e-3f}, {3000, 3e-4f}}) {
    SCOPED_TRACE(count);
    SmokeParticles particles = smoke_cloud(count, 5);
    ASSERT_TRUE(gpu_->start(particles)) << gpu_->trouble();
    gpu_->exchange(cell, smoke_viscosity(Laplacian::kPairwise));
    SmokeBins bins;
    bin(particles, cell, bins);
    EXPECT_EQ(std::memcmp(&gpu_->grid(), &bins.grid, sizeof bins.grid), 0);
    EXPECT_EQ(gpu_->read_cell_begin(), bins.cell_begin);
    EXPECT_TRUE(same(gpu_->read_particles(), particles));
  }
}

/// What rounding may make of the accelerations in double the single-precision sums of either side.
/// Which neighbours a particle has, and their q, are the same bits on both sides.
struct PairBounds {
  std::vector<double> bound;  // of a component [m/s2]
  std::vector<double> drag;   // [1/s]

  PairBounds(const SmokeParticles& p, const SmokeBins& bins, const ViscosityParameters& pass) {
    const std::size_t n = p.size();
    std::vector<double> g(n), relative(n), excess(n), excess_error(n), roundings(n);
    bound.assign(n, 0.0);
    drag.resize(n);
    const double inverse = pass.inverse_square;
    const auto around = [&](std::size_t i, const auto& visit) {
      const std::uint32_t cell = cell_number(bins.grid, cell_of(bins.grid, p.positions[i]));
      for (const auto& [first, last] : bins.runs(cell)) {
        for (std::size_t j = first; j < last; ++j) {
          const Vec3 d = (p.position(j) - p.position(i)).cast<double>();
          const double q = 1.0 - d.squaredNorm() * inverse;
          if (q > 0.0) visit(j, d, q);
        }
      }
    };
    for (std::size_t i = 0; i < n; ++i) {
      double squares = 0.0, cubes = 0.0, lengths = 0.0;
      Vec3 first = Vec3::Zero();
      int near = 0;
      around(i, [&](std::size_t, const Vec3& d, double q) {
        ++near, squares += q * q, cubes += q * q * q, first += q * q * d;
        lengths += q * q * d.norm();
      });
      const double m = roundings[i] = near + 4;
      const double off_squares = m * kUnit * squares, off_cubes = m * kUnit * cubes;
      const double moment = squares - cubes, off_moment = off_squares + off_cubes;
      const double f2 = first.squaredNorm(), off_f = m * kUnit * lengths;
      const double rest = std::max(squares - 1.0, 1e-6);
      const double relaxed = moment - 2.0 * f2 * inverse / rest;
      const double off_relaxed =
          off_moment + 2.0 * inverse / rest *
                           (4.0 * std::sqrt(f2) * off_f + f2 * (off_squares / rest + 8.0 * kUnit));
      const double used = std::max({relaxed, 0.5 * moment, cubes / 3.0});
      const bool alone = near < static_cast<int>(pass.fewest_neighbours) + 1;
      g[i] = alone ? 0.0 : 6.0 * inverse / used;
      relative[i] = std::max({off_relaxed, off_moment, off_cubes}) / used + 4.0 * kUnit;
      excess[i] = std::clamp(pass.fill * cubes - 1.0, 0.0, double{pass.most_excess});
      excess_error[i] = pass.fill * off_cubes + 4.0 * kUnit;
      drag[i] = 2.0 * pass.gas_drag * excess_error[i];
    }
    const double nu = pass.laplacian == Laplacian::kPairwise ? pass.viscosity : 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      around(i, [&](std::size_t j, const Vec3& d, double q) {
        const double w = q * q * std::min(0.5 * (g[i] + g[j]), 1.2 * std::min(g[i], g[j]));
        const double share = std::max(relative[i], relative[j]) + (roundings[i] + 8.0) * kUnit;
        const double exchange =
            nu * w * (p.velocity(j) - p.velocity(i)).cast<double>().cwiseAbs().maxCoeff();
        const double push = pass.crowding * w * d.cwiseAbs().maxCoeff();
        // Two sides.
        bound[i] += 2.0 * (share * (exchange + push * (excess[i] + excess[j])) +
                           push * (excess_error[i] + excess_error[j]));
      });
    }
  }
};

TEST_F(GpuSmokeTest, PairwiseViscosityCrowdingAndDragMatchTheCpuToCountedRoundings) {
  for (const int count : {2000, 20000}) {
    SmokeParticles particles = smoke_cloud(count, 7);
    ViscosityParameters pass = smoke_viscosity(Laplacian::kPairwise);
    ASSERT_TRUE(gpu_->start(particles)) << gpu_->trouble();
    gpu_->exchange(kSmokeSupport, pass);
    const std::vector<Float4> found = gpu_->read_accelerations();

    SmokeBins bins;
    bin(particles, kSmokeSupport, bins);
    pass.particles = static_cast<std::uint32_t>(particles.size());
    ViscosityPass cpu;
    cpu.run(particles.positions, particles.velocities, bins, pass);
    EXPECT_EQ(gpu_->isolated(), cpu.isolated());
    EXPECT_GT(cpu.isolated(), 0u);
    const PairBounds bounds(particles, bins, pass);
    double worst = 0.0, greatest = 0.0;
    for (std::size_t i = 0; i < particles.size(); ++i) {
      const Float4 &a = cpu.accelerations()[i], &b = found[i];
      const double off = (a.xyz() - b.xyz()).cast<double>().cwiseAbs().maxCoeff();
      ASSERT_LE(off, bounds.bound[i]) << "particle " << i;
      ASSERT_LE(std::abs(a.w - b.w), bounds.drag[i]) << "particle " << i;
      worst = std::max(worst, off);
      greatest = std::max<double>(greatest, a.xyz().cwiseAbs().maxCoeff());
    }
    RecordProperty("error_of_greatest_" + std::to_string(count), std::to_string(worst / greatest));
    EXPECT_LT(worst, 1e-4 * greatest);
  }
}

TEST_F(GpuSmokeTest, PairsCancelOnTheGpuToo) {
  SmokeParticles particles = smoke_cloud(8000, 11);
  ASSERT_TRUE(gpu_->start(particles));
  gpu_->exchange(kSmokeSupport, smoke_viscosity(Laplacian::kPairwise));
  Vec3 sum = Vec3::Zero();
  double sizes = 0.0;
  for (const Float4& a : gpu_->read_accelerations()) {
    sum += a.xyz().cast<double>();
    sizes += a.xyz().cast<double>().norm();
  }
  EXPECT_GT(sizes, 0.0);
  EXPECT_LT(sum.norm(), 2e-7 * sizes);
}

// In double on both sides: what single precision rounds at the end, and what inverting moment
// matrices of condition up to 1e8 makes of the rest.
TEST_F(GpuSmokeTest, ThePapersViscosityMatchesTheCpu) {
  SmokeParticles particles = smoke_cloud(3000, 13);
  ViscosityParameters pass = smoke_viscosity(Laplacian::kPaper);
  pass.crowding = 0.0f;
  ASSERT_TRUE(gpu_->start(particles)) << gpu_->trouble();
  gpu_->exchange(kSmokeSupport, pass);
  const std::vector<Float4> found = gpu_->read_accelerations();
  SmokeBins bins;
  bin(particles, kSmokeSupport, bins);
  pass.particles = static_cast<std::uint32_t>(particles.size());
  ViscosityPass cpu;
  cpu.run(particles.positions, particles.velocities, bins, pass);
  double greatest = 0.0;
  for (const Float4& a : cpu.accelerations()) greatest = std::max<double>(greatest, a.xyz().norm());
  EXPECT_GT(greatest, 1e-3);
  for (std::size_t i = 0; i < particles.size(); ++i) {
    const Vec3 a = cpu.accelerations()[i].xyz().cast<double>(), b = found[i].xyz().cast<double>();
    ASSERT_LE((a - b).norm(), 4.0 * kUnit * a.norm() + 1e-8 * greatest) << "particle " << i;
  }
}

/// Gas with a shear, and with eddies that differ from place to place.
class ShearedGas final : public SurroundingGas {
 public:
  void velocity(std::span<const Float4> positions, std::span<Float4> velocities) override {
    for (std::size_t i = 0; i < positions.size(); ++i) {
      velocities[i] = {0.5f * positions[i].z, -0.1f, 0.2f * positions[i].x, positions[i].y};
    }
  }
  void excess(std::span<const Float4>, std::span<float> kelvin) override {
    std::ranges::fill(kelvin, 1.0f);
  }
};

TEST_F(GpuSmokeTest, IntegrationMatchesTheCpuWithAndWithoutGas) {
  const SwirlField swirl(3, std::sqrt(3.0), 20e-3, 0.6);
  const std::vector<SwirlWave> all_waves = swirl.waves(0.37);
  for (const bool with_gas : {false, true}) {
    for (const bool with_waves : {true, false}) {
      SCOPED_TRACE(std::string(with_gas ? "gas" : "no gas") + (with_waves ? ", waves" : ""));
      const std::span<const SwirlWave> waves =
          with_waves ? std::span<const SwirlWave>(all_waves) : std::span<const SwirlWave>();
      SmokeParticles particles = smoke_cloud(5000, 17);
      const IntegrateParameters pass = smoke_integration();
      CpuSmokePasses cpu;
      ShearedGas cpu_gas, gpu_gas;
      SmokeParticles expected = particles;
      const auto run = [&](SmokePasses& passes, SmokeParticles& moved, SurroundingGas& gas) {
        std::vector<SmokeFate> fates;
        ASSERT_TRUE(passes.start(moved));
        passes.exchange(kSmokeSupport, smoke_viscosity(Laplacian::kPairwise));
        passes.integrate(pass, waves, with_gas ? &gas : nullptr);
        ASSERT_TRUE(passes.finish(moved, fates));
      };
      run(cpu, expected, cpu_gas);
      run(*gpu_, particles, gpu_gas);
      // A velocity of order one is a sum of some ten terms as large as it, rounded some forty times
      // on the way, and differs by what viscosity (above) makes of it.
      const double scale = std::max(greatest_speed(expected), 1.0);
      const double bound = 100.0 * kUnit * scale;
      for (std::size_t i = 0; i < particles.size(); ++i) {
        ASSERT_EQ(particles.ids[i], expected.ids[i]);
        ASSERT_LE((particles.velocity(i) - expected.velocity(i)).cast<double>().norm(), bound);
        ASSERT_LE((particles.position(i) - expected.position(i)).cast<double>().norm(),
                  bound * pass.step + 8.0 * kUnit * pass.extent.xyz().norm());
        ASSERT_FLOAT_EQ(particles.temperature(i), expected.temperature(i));
        ASSERT_FLOAT_EQ(particles.age(i), expected.age(i));
        ASSERT_EQ(particles.masses[i], expected.masses[i]);
      }
    }
  }
}

/// Distance of a place from a capsule's surface [m].
double distance_to(const SmokeCapsule& capsule, const Vec3f& p) {
  const Vec3 from = capsule.from.xyz().cast<double>(), to = capsule.to.xyz().cast<double>();
  const Vec3 at = p.cast<double>(), way = to - from;
  const double t = std::clamp((at - from).dot(way) / way.squaredNorm(), 0.0, 1.0);
  return (at - from - t * way).norm() - capsule.from.w;
}

TEST_F(GpuSmokeTest, CollisionsWithAMovingBallCapsulesAndSidesMatchTheCpu) {
  const BallSurface ball;
  const SurfaceTopology topology(ball.triangles);
  const double radius = 12e-3;
  const Vec3 middle(0.03, 0.03, 0.028);
  std::vector<Vec3f> corners;
  const auto place = [&](SurfaceCells& cells, double size) {
    corners.clear();
    for (const Vec3& d : ball.directions) corners.push_back((size * d).cast<float>());
    const SmokeSurface surface = {1, &topology, corners, Pose{middle, Quaternion::Identity()}};
    cells.advance({&surface, 1}, Vec3::Zero());
  };
  std::vector<SmokeCapsule> capsules(2);
  capsules[0].from = {0.02f, 0.03f, 0.041f, 2e-3f};
  capsules[0].to = {0.05f, 0.035f, 0.05f, 0.0f};
  capsules[0].from_motion = {0.1f, 0.0f, 0.05f, 0.0f};
  capsules[1].from = {0.045f, 0.01f, 0.03f, 1e-3f};
  capsules[1].to = {0.045f, 0.05f, 0.03f, 0.0f};
  capsules[1].to_motion = {-0.2f, 0.1f, 0.0f, 0.0f};
  CollideParameters pass;
  pass.gap = 2e-4f;
  pass.friction = 0.3f;
  pass.touch = 7.5e-4f;
  pass.kept = 0.9f;
  pass.rounds = 6;
  pass.extent = {0.06f, 0.06f, 0.06f, 0.0f};
  // How far from a surface the direction of the way out is well determined [m].
  constexpr double kClear = 2e-5;
  SmokeParticles cloud = smoke_cloud(12000, 19), particles;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const double off = (cloud.position(i).cast<double>() - middle).norm();
    if (std::abs(off - radius) < 2e-4 + kClear) continue;  // the triangles cut the ball's edge
    if (std::abs(distance_to(capsules[0], cloud.position(i))) < kClear) continue;
    if (std::abs(distance_to(capsules[1], cloud.position(i))) < kClear) continue;
    particles.resize(particles.size() + 1);
    particles.copy(i, cloud, particles.size() - 1);
  }
  ASSERT_GT(particles.size(), 8000u);
  const auto run = [&](SmokePasses& passes, SmokeParticles& moved, std::vector<SmokeFate>& fates,
                       double& deposited) {
    SurfaceCells cells;
    place(cells, 0.95 * radius);
    place(cells, radius);
    EXPECT_TRUE(passes.start(moved));
    const CollideCounts counts =
        passes.collide(cells, {1.0, 1.0 / 60.0, 3e-3f, 8e-3f}, capsules, pass);
    deposited = passes.finish(moved, fates).value();
    return counts;
  };
  SmokeParticles expected = particles;
  const SmokeParticles before = particles;
  CpuSmokePasses cpu;
  std::vector<SmokeFate> fates, expected_fates;
  double deposited = 0.0, expected_deposited = 0.0;
  const CollideCounts counts = run(cpu, expected, expected_fates, expected_deposited);
  const CollideCounts found = run(*gpu_, particles, fates, deposited);
  EXPECT_GT(counts.touching, 500u);
  EXPECT_LT(counts.tested, particles.size());
  EXPECT_EQ(found.tested, counts.tested);
  EXPECT_EQ(found.touching, counts.touching);
  EXPECT_EQ(found.trapped, counts.trapped);
  EXPECT_EQ(fates, expected_fates);
  EXPECT_GT(expected_deposited, 0.0);
  EXPECT_NEAR(deposited, expected_deposited, 1e-12 * expected_deposited + 1e-18);
  // A nearest point is rounded some thirty times at 0.05 m; over kClear that turns the way out.
  const double place_error = 30.0 * kUnit * 0.06, turn = place_error / kClear;
  for (std::size_t i = 0; i < particles.size(); ++i) {
    ASSERT_EQ(particles.masses[i], expected.masses[i]) << i;
    ASSERT_LE((particles.position(i) - expected.position(i)).cast<double>().norm(),
              4.0 * (place_error + turn * pass.gap))
        << i;
    const double speed = before.velocity(i).cast<double>().norm() + 1.0;
    ASSERT_LE((particles.velocity(i) - expected.velocity(i)).cast<double>().norm(),
              8.0 * (turn + 8.0 * kUnit) * speed)
        << i;
  }
}

TEST_F(GpuSmokeTest, SplattedMassIsTheParticlesAndCellsMatchTheCpu) {
  const SmokeParticles particles = smoke_cloud(6000, 23);
  const double mass = [&] {
    double sum = 0.0;
    for (const float m : particles.masses) sum += m;
    return sum;
  }();
  for (const double voxel : {2e-3, 7e-4}) {
    SplatParameters pass =
        splat_parameters(Box(Vec3::Zero(), Vec3::Constant(0.06)), voxel, kSmokeSupport, 1.4e-5);
    SplatParameters cpu_pass = pass;
    SmokeGrid expected, found;
    splat(particles.positions, particles.velocities, particles.masses, cpu_pass, expected);
    ASSERT_TRUE(gpu_->splat(particles, pass, found)) << gpu_->trouble();
    EXPECT_EQ(std::memcmp(&pass, &cpu_pass, sizeof pass), 0);  // the scales too
    ASSERT_EQ(found.density.size(), expected.density.size());
    double sum = 0.0, greatest = 0.0;
    for (const float d : found.density) sum += d * std::pow(voxel, 3);
    EXPECT_NEAR(sum, mass, 1e-6 * mass);
    for (const float d : expected.density) greatest = std::max<double>(greatest, d);
    // Weights are rounded some ten times; a cell's sum is exact.
    for (std::size_t c = 0; c < expected.density.size(); ++c) {
      ASSERT_NEAR(found.density[c], expected.density[c], 1e-6 * greatest);
      // Means are of what little is there; below a thousandth nothing shows.
      if (expected.density[c] < 1e-3 * greatest) continue;
      ASSERT_NEAR(found.temperature[c], expected.temperature[c], 1e-4f * 60.0f);
      ASSERT_LT((found.velocity[c] - expected.velocity[c]).norm(), 1e-4f);
    }
  }
}

SmokeParameters cavity(Laplacian laplacian) {
  SmokeParameters parameters;
  parameters.domain = Box(Vec3(-0.03, -0.03, 0.3), Vec3(0.03, 0.03, 0.36));
  parameters.laplacian = laplacian;
  parameters.deposition_velocity = 1e-3;
  parameters.open_sides = kOpenHighZ;
  return parameters;
}

/// A ball that breathes and a moving tool in the cavity.
struct Surroundings {
  BallSurface ball;
  SurfaceTopology topology = SurfaceTopology(ball.triangles);
  std::vector<Vec3f> corners;
  SmokeSurface surface;
  SmokeObstacle tool;
  SmokeOutlet outlet = {.position = Vec3(0.02, 0.0, 0.33), .radius = 3e-3, .flow = 1e-4};

  SmokeSurroundings at(int frame) {
    const double radius = 10e-3 * (1.0 + 0.1 * std::sin(0.3 * frame));
    corners.clear();
    for (const Vec3& d : ball.directions) corners.push_back((radius * d).cast<float>());
    surface = {7, &topology, corners, Pose{Vec3(0.0, 0.0, 0.30), Quaternion::Identity()}};
    tool.from_before = frame > 0 ? tool.from : Vec3(0.0, 0.0, 0.325);
    tool.to_before = frame > 0 ? tool.to : Vec3(0.03, 0.0, 0.35);
    tool.from = Vec3(2e-4 * frame, 0.0, 0.325);
    tool.to = Vec3(0.03, 0.0, 0.35);
    tool.radius = 2e-3;
    return {.surfaces = {&surface, 1}, .obstacles = {&tool, 1}, .outlets = {&outlet, 1}};
  }
};

SmokeEmission plume(int particles) {
  return {.position = Vec3(0.012, 0.0, 0.312),
          .direction = Vec3(-0.1, 0.0, 1.0),
          .radius = 4e-3,
          .mass = 1e-8 * particles,
          .particles = particles,
          .duration = 1.0 / 60.0};
}

TEST_F(GpuSmokeTest, AWholeStepMatchesTheCpuWithSurfacesToolsAndOutlets) {
  for (const Laplacian laplacian : {Laplacian::kPairwise, Laplacian::kPaper}) {
    SmokeVolume cpu(cavity(laplacian));
    Surroundings around;
    const int each = laplacian == Laplacian::kPaper ? 200 : 1000;
    for (int frame = 0; frame < 10; ++frame) {
      cpu.emit(plume(each));
      SmokeVolume gpu = cpu;
      gpu.compute_on(gpu_);
      const SmokeSurroundings here = around.at(frame);
      cpu.step(1.0 / 60.0, here);
      gpu.step(1.0 / 60.0, here);
      ASSERT_EQ(gpu.device_failure(), "");
      EXPECT_NEAR(gpu.airborne(), gpu.book().owed_airborne(), 1e-12 * gpu.book().emitted);
      ASSERT_EQ(gpu.particles().size(), cpu.particles().size());
      EXPECT_EQ(gpu.counters().isolated, cpu.counters().isolated);
      EXPECT_EQ(gpu.counters().tested, cpu.counters().tested);
      EXPECT_EQ(gpu.counters().touching, cpu.counters().touching);
      const SmokeParticles a = sorted_by_id(cpu.particles()), b = sorted_by_id(gpu.particles());
      ASSERT_EQ(a.ids, b.ids);
      for (std::size_t i = 0; i < a.size(); ++i) {
        ASSERT_LE((a.position(i) - b.position(i)).norm(), 2e-6f) << "frame " << frame;
        ASSERT_LE((a.velocity(i) - b.velocity(i)).norm(), 1e-3f) << "frame " << frame;
        ASSERT_FLOAT_EQ(a.masses[i], b.masses[i]);
      }
    }
    EXPECT_GT(cpu.counters().tested, 100u);
  }
}

TEST_F(GpuSmokeTest, TheSameRunGivesTheSameBits) {
  const auto run = [&](std::shared_ptr<GpuSmoke> device, SmokeGrid& grid) {
    SmokeVolume smoke(cavity(Laplacian::kPairwise));
    smoke.compute_on(device);
    Surroundings around;
    RestingGas gas;
    for (int frame = 0; frame < 20; ++frame) {
      smoke.emit(plume(150));
      SmokeSurroundings here = around.at(frame);
      here.gas = &gas;
      smoke.step(1.0 / 60.0, here);
    }
    splat(smoke, 1e-3, grid);
    EXPECT_EQ(smoke.device_failure(), "");
    return smoke.particles();
  };
  SmokeGrid first, second;
  const SmokeParticles a = run(gpu_, first), b = run(create(), second);
  EXPECT_GT(a.size(), 2000u);
  EXPECT_TRUE(same(a, b));
  EXPECT_EQ(first.density, second.density);
  EXPECT_EQ(first.temperature, second.temperature);
  EXPECT_EQ(first.velocity, second.velocity);
}

TEST_F(GpuSmokeTest, SeveralVolumesShareADevice) {
  std::vector<SmokeVolume> apart, shared;
  for (int v = 0; v < 2; ++v) {
    SmokeParameters parameters = cavity(Laplacian::kPairwise);
    parameters.seed = 5 + v;
    apart.emplace_back(parameters);
    shared.emplace_back(parameters);
    apart.back().compute_on(create());
    shared.back().compute_on(gpu_);
  }
  for (int frame = 0; frame < 5; ++frame) {
    for (int v = 0; v < 2; ++v) {
      for (SmokeVolume* smoke : {&apart[v], &shared[v]}) {
        smoke->emit(plume(300 + 500 * v));
        smoke->step(1.0 / 60.0);
      }
    }
  }
  for (int v = 0; v < 2; ++v) EXPECT_TRUE(same(apart[v].particles(), shared[v].particles()));
}

TEST_F(GpuSmokeTest, WhatIsTooLargeForTheDeviceRunsOnTheCpuAndSaysWhy) {
  GpuLimits limits = GpuLimits::of_device();
  limits.block_bytes = 500 * sizeof(Float4);
  SmokeVolume cpu(cavity(Laplacian::kPairwise)), gpu(cavity(Laplacian::kPairwise));
  gpu.compute_on(create(limits));
  for (SmokeVolume* smoke : {&cpu, &gpu}) {
    smoke->emit(plume(600));
    smoke->step(1.0 / 60.0);
  }
  EXPECT_EQ(gpu.device(), nullptr);
  EXPECT_NE(gpu.device_failure().find("positions would make a storage buffer of"),
            std::string::npos)
      << gpu.device_failure();
  EXPECT_TRUE(same(cpu.particles(), gpu.particles()));

  // A grid that doesn't fit is splatted by the CPU.
  gpu.compute_on(create(limits));
  SmokeGrid grid, expected;
  splat(gpu, 5e-4, grid);
  splat(cpu, 5e-4, expected);
  EXPECT_EQ(grid.density, expected.density);
}

TEST_F(GpuSmokeTest, EveryInstrumentIsMetHoweverManyThereAre) {
  // All but the last of forty are too far away; on the CPU that one alone is told of.
  std::vector<SmokeObstacle> tools(40);
  for (SmokeObstacle& tool : tools) {
    tool.from = tool.from_before = Vec3(0.2, 0.2, 0.3);
    tool.to = tool.to_before = Vec3(0.3, 0.2, 0.3);
    tool.radius = 1e-3;
  }
  tools.back() = {.from = Vec3(0.01, -0.02, 0.315),
                  .to = Vec3(0.01, 0.02, 0.315),
                  .from_before = Vec3(0.01, -0.02, 0.315),
                  .to_before = Vec3(0.01, 0.02, 0.315),
                  .radius = 2e-3};
  SmokeVolume cpu(cavity(Laplacian::kPairwise)), gpu(cavity(Laplacian::kPairwise));
  gpu.compute_on(gpu_);
  for (int frame = 0; frame < 5; ++frame) {
    for (SmokeVolume* smoke : {&cpu, &gpu}) smoke->emit(plume(500));
    cpu.step(1.0 / 60.0, {.obstacles = {&tools.back(), 1}});
    gpu.step(1.0 / 60.0, {.obstacles = tools});
    ASSERT_EQ(gpu.device_failure(), "");
    ASSERT_EQ(gpu.counters().touching, cpu.counters().touching) << "frame " << frame;
  }
  EXPECT_GT(cpu.counters().touching, 10u);
}

/// Gas at rest, in whose presence a context is lost.
class FatefulGas final : public SurroundingGas {
 public:
  explicit FatefulGas(EglContext& context) : context_(context) {}
  void velocity(std::span<const Float4>, std::span<Float4> velocities) override {
    context_.declare_lost();
    std::ranges::fill(velocities, Float4{0.0f, 0.0f, 0.0f, 0.0f});
  }
  void excess(std::span<const Float4>, std::span<float> kelvin) override {
    std::ranges::fill(kelvin, 0.0f);
  }

 private:
  EglContext& context_;
};

TEST_F(GpuSmokeTest, AfterALostContextTheSmokeGoesOnOnTheCpuAndSaysWhy) {
  const std::shared_ptr<EglContext> own = *EglContext::create();
  SmokeVolume cpu(cavity(Laplacian::kPairwise)), gpu(cavity(Laplacian::kPairwise));
  gpu.compute_on(create(GpuLimits::of_device(), own));
  const auto both = [&] {
    for (SmokeVolume* smoke : {&cpu, &gpu}) {
      smoke->emit(plume(600));
      smoke->step(1.0 / 60.0);
    }
  };
  own->declare_lost();
  both();
  EXPECT_EQ(gpu.device(), nullptr);
  EXPECT_EQ(gpu.device_failure(), "smoke on the GPU: its context was lost");
  both();
  EXPECT_TRUE(same(cpu.particles(), gpu.particles()));
  context_->make_current();
}

TEST_F(GpuSmokeTest, AContextThatIsLostInAStepCostsThatStepAlone) {
  const std::shared_ptr<EglContext> own = *EglContext::create();
  SmokeVolume smoke(cavity(Laplacian::kPairwise));
  smoke.emit(plume(600));
  smoke.compute_on(create(GpuLimits::of_device(), own));
  const SmokeParticles before = smoke.particles();
  FatefulGas gas(*own);
  smoke.step(1.0 / 60.0, {.gas = &gas});
  EXPECT_EQ(smoke.device(), nullptr);
  EXPECT_NE(smoke.device_failure().find("its context was lost"), std::string::npos);
  // They are where they were, and as warm as the gas.
  for (std::size_t i = 0; i < before.size(); ++i) {
    EXPECT_EQ(smoke.particles().position(i), before.position(i));
    EXPECT_EQ(smoke.particles().temperature(i), 0.0f);
  }
  smoke.step(1.0 / 60.0, {.gas = &gas});
  EXPECT_FALSE(same(smoke.particles(), before)) << "goes on";
  EXPECT_NEAR(smoke.airborne(), smoke.book().owed_airborne(), 1e-12 * smoke.book().emitted);
  context_->make_current();
}

TEST_F(GpuSmokeTest, NoParticlesAreNoTrouble) {
  SmokeParticles none;
  std::vector<SmokeFate> fates;
  ASSERT_TRUE(gpu_->start(none)) << gpu_->trouble();
  gpu_->exchange(kSmokeSupport, smoke_viscosity(Laplacian::kPairwise));
  gpu_->integrate(smoke_integration(), {}, nullptr);
  EXPECT_EQ(gpu_->greatest_speed(), 0.0f);
  EXPECT_EQ(gpu_->finish(none, fates), 0.0);
  SplatParameters pass =
      splat_parameters(Box(Vec3::Zero(), Vec3::Constant(0.01)), 1e-3, kSmokeSupport, 1.4e-5);
  SmokeGrid grid;
  ASSERT_TRUE(gpu_->splat(none, pass, grid));
  EXPECT_EQ(grid.density, std::vector<float>(1000, 0.0f));
}

}  // namespace
}  // namespace viscera
