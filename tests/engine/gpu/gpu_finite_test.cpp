#include "engine/gpu/gpu_finite.h"

#include <gtest/gtest.h>

#include "engine/gpu/egl_context.h"
#include "tests/kernels/finite/finite_cube.h"

namespace viscera {
namespace {

class GpuFiniteTest : public testing::Test {
 protected:
  void SetUp() override {
    auto made = EglContext::create();
    if (!made) GTEST_SKIP() << made.error().text();
    context_ = *std::move(made);
    RecordProperty("device", context_->device());
  }

  struct Answer {
    double energy = 0.0;
    std::vector<double> gradient;
  };
  static Answer on_cpu(const FiniteBody& body, std::span<const double> u,
                       const Viscosity& viscosity = {}, const ChangedTissue& changed = {}) {
    Answer found{0.0, std::vector<double>(u.size(), 0.0)};
    FiniteBody::Workspace workspace;
    found.energy = body.energy(u, found.gradient, workspace, viscosity, changed);
    return found;
  }
  static Answer on_gpu(const FiniteBody& body, GpuFiniteBody& gpu, std::span<const double> u) {
    Answer found{0.0, std::vector<double>(u.size(), 0.0)};
    const auto energy = gpu.energy(u, found.gradient);
    EXPECT_TRUE(energy) << energy.error().text();
    found.energy = energy.value_or(0.0) + body.hold_energy(u, found.gradient);
    return found;
  }
  static void expect_same(const Answer& cpu, const Answer& gpu) {
    EXPECT_NEAR(gpu.energy, cpu.energy, 1e-12 * cpu.energy);
    EXPECT_LT(distance(gpu.gradient, cpu.gradient), 1e-11 * norm(cpu.gradient));
  }

  std::shared_ptr<EglContext> context_;
};

/// A tenth of what turns elements inside out, and far as a whole.
std::vector<double> strained(const Cube& cube) {
  std::vector<double> u = cube.moved([](const Vec3& x) {
    return Vec3(1.2 * x.x() + 0.3 * x.y() * x.y() + 2.0, 0.9 * x.y() + 0.2 * x.z(),
                x.z() - 0.3 * x.x() - 1.0);
  });
  const std::vector<double> noise = random_vector(u.size(), 0.01, 4);
  for (std::size_t i = 0; i < u.size(); ++i) u[i] += noise[i];
  return u;
}

TEST_F(GpuFiniteTest, EnergyAndForcesAreTheCpus) {
  for (const double poisson : {0.3, 0.45, 0.49}) {
    const Cube cube = Cube::make(poisson, false);
    auto gpu = GpuFiniteBody::create(cube.finite, GpuLimits::of_device());
    ASSERT_TRUE(gpu) << gpu.error().text();
    const std::vector<double> u = strained(cube);
    expect_same(on_cpu(cube.finite, u), on_gpu(cube.finite, **gpu, u));
    EXPECT_EQ((*gpu)->energy(u, {}).value(), (*gpu)->energy(u, {}).value());
  }
}

TEST_F(GpuFiniteTest, StiffenedShrunkAndViscousTissueToo) {
  for (const double poisson : {0.3, 0.45}) {
    const Cube cube =
        Cube::make(poisson, false, [](const Vec3& x, double) { return x.x() > 0.0 ? 3.0 : 1.0; });
    auto gpu = GpuFiniteBody::create(cube.finite, GpuLimits::of_device());
    ASSERT_TRUE(gpu) << gpu.error().text();
    TissueChange change;
    for (std::size_t q = 0; q < cube.finite.points(); ++q) {
      change.stiffness.push_back(1.0 + static_cast<double>(q % 7));
      change.shrinkage.push_back(0.03 * static_cast<double>(q % 5));
    }
    const ChangedTissue changed = cube.finite.changed(change);
    const std::vector<double> u = strained(cube), last = random_vector(u.size(), 0.02, 9);
    const Strains strains = cube.finite.strains(last);
    const Viscosity viscosity{1.2, strains};
    for (const bool viscous : {false, true})
      for (const bool burnt : {false, true}) {
        const Viscosity& slow = viscous ? viscosity : Viscosity{};
        const ChangedTissue& tissue = burnt ? changed : ChangedTissue{};
        (*gpu)->set(tissue, slow);
        SCOPED_TRACE(testing::Message()
                     << poisson << ", viscous " << viscous << ", burnt " << burnt);
        expect_same(on_cpu(cube.finite, u, slow, tissue), on_gpu(cube.finite, **gpu, u));
      }
  }
}

TEST_F(GpuFiniteTest, TheSameBitsEveryTime) {
  const Cube cube = Cube::make(0.45, false);
  auto gpu = GpuFiniteBody::create(cube.finite, GpuLimits::of_device()),
       other = GpuFiniteBody::create(cube.finite, GpuLimits::of_device());
  ASSERT_TRUE(gpu && other);
  const std::vector<double> u = strained(cube), v = random_vector(u.size(), 0.01, 7);
  const Answer first = on_gpu(cube.finite, **gpu, u);
  for (int i = 0; i < 5; ++i) {
    on_gpu(cube.finite, **gpu, v);
    EXPECT_EQ(on_gpu(cube.finite, **gpu, u).gradient, first.gradient);
  }
  EXPECT_EQ(on_gpu(cube.finite, **other, u).gradient, first.gradient);
}

TEST_F(GpuFiniteTest, ABodyWithFibresIsRefused) {
  const Cube cube = Cube::make(0.45, true, {}, [](const Vec3&, double) {
    return Fibres{Vec3::UnitX(), 5e3};
  });
  const auto gpu = GpuFiniteBody::create(cube.finite, GpuLimits::of_device());
  ASSERT_FALSE(gpu);
  EXPECT_NE(gpu.error().text().find("fibres"), std::string::npos);
}

TEST_F(GpuFiniteTest, ADenseInverseIsMultipliedToHalfPrecision) {
  for (const std::size_t n : {5u, 64u, 301u}) {
    const std::vector<double> entries = random_vector(n * n, 1.0, 3), x = random_vector(n, 1.0, 5);
    std::vector<float> columns(n * n);
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = 0; j < n; ++j)
        columns[i * n + j] = static_cast<float>(0.5 * (entries[i * n + j] + entries[j * n + i]));
    auto gpu = GpuInverse::create(columns, n, GpuLimits::of_device());
    ASSERT_TRUE(gpu) << gpu.error().text();
    std::vector<double> found(n), wanted(n, 0.0);
    ASSERT_TRUE((*gpu)->apply(x, found));
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = 0; j < n; ++j)
        wanted[i] += static_cast<double>(columns[i * n + j]) * x[j];
    EXPECT_LT(distance(found, wanted), 1e-3 * norm(wanted)) << n;
    EXPECT_GT(distance(found, wanted), 0.0) << n;
  }
}

}  // namespace
}  // namespace viscera
