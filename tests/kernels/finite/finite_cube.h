// A cube at finite strain, and vectors to move it by.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "engine/verification/bodies.h"
#include "kernels/finite/finite_body.h"
#include "kernels/paff/galerkin.h"
#include "tests/kernels/paff/elastic_bodies.h"

namespace viscera {

/// What rounding gradients to single precision changes, of a few numbers.
inline constexpr double kSingle = 0x1p-23;

/// A jittered cube of 10 kPa that is held where x (or another axis) is -1/2, or nowhere.
struct Cube {
  NodedBody body = jittered_cube(4, 0.2);
  GalerkinSystem system;
  FiniteBody finite;

  static Cube make(double poisson_ratio, bool held = true,
                   std::function<double(const Vec3&, double)> relative_modulus = {},
                   std::function<Fibres(const Vec3&, double)> fibres = {}, int held_axis = 0) {
    NodedBody body = jittered_cube(4, 0.2);
    ElasticProblem problem = body.problem(
        {10e3, poisson_ratio}, [held_axis](const Vec3& x) { return x[held_axis] < -0.499; });
    problem.relative_modulus = std::move(relative_modulus);
    problem.fibres = std::move(fibres);
    auto system = GalerkinSystem::assemble(problem, 1.8, no_progress());
    EXPECT_TRUE(system.has_value());
    auto region = system->region([](const Vec3&) { return true; });
    auto hold = system->hold();
    EXPECT_TRUE(region.has_value() && hold.has_value());
    if (!held) std::fill(hold->blocks.begin(), hold->blocks.end(), 0.0);
    auto finite = FiniteBody::create(*region, *hold);
    EXPECT_TRUE(finite.has_value());
    return {std::move(body), std::move(*system), std::move(*finite)};
  }

  static Progress no_progress() {
    return [](double, std::string_view) { return true; };
  }

  /// Nodal unknowns of x -> place(x): linear fields come out exactly.
  std::vector<double> moved(const auto& place) const {
    std::vector<double> all;
    for (const Vec3& x : body.cloud.positions) {
      const Vec3 u = place(x) - x;
      all.insert(all.end(), u.data(), u.data() + 3);
    }
    return all;
  }

  std::vector<double> gradient(std::span<const double> u) const {
    std::vector<double> all(u.size(), 0.0);
    FiniteBody::Workspace workspace;
    finite.energy(u, all, workspace);
    return all;
  }
  double energy(std::span<const double> u) const {
    FiniteBody::Workspace workspace;
    return finite.energy(u, {}, workspace);
  }
};

inline std::vector<double> random_vector(std::size_t size, double scale, unsigned seed) {
  std::mt19937 draw(seed);
  std::vector<double> all(size);
  for (double& value : all)
    value = scale * (2.0 * static_cast<double>(draw()) / 4294967295.0 - 1.0);
  return all;
}

inline double norm(std::span<const double> x) {
  return Eigen::Map<const VectorX>(x.data(), static_cast<Eigen::Index>(x.size())).norm();
}

inline double distance(std::span<const double> x, std::span<const double> y) {
  double sum = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) sum += (x[i] - y[i]) * (x[i] - y[i]);
  return std::sqrt(sum);
}

}  // namespace viscera
