#include "kernels/contact/half_columns.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "engine/verification/bodies.h"
#include "kernels/base/random.h"
#include "kernels/contact/deformation.h"
#include "tests/kernels/contact/bodies.h"

namespace viscera {
namespace {

TEST(HalfPrecision, EveryHalfComesBackAsItself) {
  for (std::uint32_t bits = 0; bits < 0x10000u; ++bits) {
    const auto half = static_cast<std::uint16_t>(bits);
    const float value = from_half(half);
    if (std::isnan(value)) {
      EXPECT_TRUE(std::isnan(from_half(to_half(value))));
    } else {
      ASSERT_EQ(to_half(value), half);
    }
  }
}

TEST(HalfPrecision, ValuesGoToTheNearestHalfAndToEvenAtTies) {
  EXPECT_EQ(from_half(to_half(1.0f)), 1.0f);
  EXPECT_EQ(to_half(1.0f), 0x3c00);
  EXPECT_EQ(to_half(-2.0f), 0xc000);
  EXPECT_EQ(from_half(to_half(1.0f + 0x1p-11f)), 1.0f);            // a tie, down to even
  EXPECT_EQ(from_half(to_half(1.0f + 0x3p-11f)), 1.0f + 0x1p-9f);  // a tie, up to even
  EXPECT_EQ(from_half(to_half(0x1p-24f)), 0x1p-24f);               // the smallest
  EXPECT_EQ(from_half(to_half(0x1p-25f)), 0.0f);
  EXPECT_EQ(from_half(to_half(65504.0f)), 65504.0f);  // the greatest
  EXPECT_TRUE(std::isinf(from_half(to_half(65520.0f))));
  const Random random(3, 1);
  for (std::uint64_t i = 0; i < 20000; ++i) {
    const float value = std::ldexp(static_cast<float>(2.0 * random.uniform(2 * i) - 1.0),
                                   static_cast<int>(random.uniform(2 * i + 1) * 28.0) - 13);
    const float near = from_half(to_half(value));
    const float spacing = std::max(0x1p-24f, std::ldexp(1.0f, std::ilogb(value) - 10));
    ASSERT_LE(std::abs(near - value), 0.5f * spacing);
  }
}

/// A compliance of smooth columns that fall off, and loads on some of its nodes.
struct Example {
  SurfaceCompliance compliance;
  ContactResponse response;

  Example(std::size_t places, std::size_t touchable) {
    const Random random(17, 2);
    std::uint64_t draw = 0;
    compliance.places = places;
    for (std::size_t j = 0; j < touchable; ++j) {
      compliance.touchable.push_back(static_cast<int>(j));
      if (j % 2 == 0) {
        response.touched.push_back(static_cast<int>(j));
        response.loads.emplace_back(random.normal(draw), random.normal(draw + 1),
                                    random.normal(draw + 2));
        draw += 3;
      }
    }
    for (std::size_t j = 0; j < 3 * touchable; ++j) {
      for (std::size_t i = 0; i < 3 * places; ++i) {
        const double apart = std::abs(static_cast<double>(i) - static_cast<double>(j));
        compliance.columns.push_back(
            static_cast<float>(0.07 / (1.0 + 0.1 * apart) * (1.0 + 0.2 * random.normal(draw++))));
      }
    }
  }
};

TEST(HalfPrecision, UnknownsStayWithinTheErrorItReports) {
  const Example example(333, 20);
  const HalfColumns half = half_precision(example.compliance);
  EXPECT_LE(half.error, 0x1p-11);
  EXPECT_GT(half.error, 0x1p-14);
  std::vector<float> single, displacements;
  place_displacements(example.compliance, example.response, single);
  place_displacements(half, example.response, displacements);
  ASSERT_EQ(displacements.size(), single.size());
  double loads = 0.0, greatest = 0.0;
  for (const Vec3& load : example.response.loads) loads += load.cwiseAbs().sum();
  for (const float c : example.compliance.columns) greatest = std::max<double>(greatest, c);
  for (std::size_t i = 0; i < single.size(); ++i) {
    // Against double: what rounding the entries did, and the sums in single precision.
    double exact = 0.0;
    for (std::size_t j = 0; j < example.response.touched.size(); ++j) {
      for (std::size_t a = 0; a < 3; ++a) {
        const auto column = 3 * static_cast<std::size_t>(example.response.touched[j]) + a;
        exact += static_cast<double>(example.compliance.columns[column * single.size() + i]) *
                 example.response.loads[j][static_cast<Eigen::Index>(a)];
      }
    }
    ASSERT_NEAR(single[i], exact, 1e-5 * loads * greatest);
    ASSERT_NEAR(displacements[i], exact, (half.error + 1e-5) * loads * greatest);
  }
}

TEST(HalfPrecision, FastPathHasTheDigitsOfThePortableOne) {
  const Example example(101, 7);
  const HalfColumns half = half_precision(example.compliance);
  std::vector<float> displacements;
  place_displacements(half, example.response, displacements);
  std::vector<float> expected(half.rows, 0.0f);
  for (std::size_t j = 0; j < example.response.touched.size(); ++j) {
    const Vec3f load = (example.response.loads[j] * half.scale).cast<float>();
    const std::uint16_t* x =
        half.entries.data() + 3 * static_cast<std::size_t>(example.response.touched[j]) * half.rows;
    for (std::size_t i = 0; i < half.rows; ++i) {
      expected[i] += from_half(x[i]) * load.x() + from_half(x[half.rows + i]) * load.y() +
                     from_half(x[2 * half.rows + i]) * load.z();
    }
  }
  EXPECT_EQ(displacements, expected);
}

TEST(HalfPrecision, ForcePartGivesTheSameForces) {
  const double top = 0.01;
  const IsotropicMaterial tissue{1e4, 0.45};
  const test::PressedBody body = test::prepare_body(
      ringed_hemisphere(0.02, 10), tissue, [](const Vec3&) { return 4e-3; },
      [](const Vec3& x) { return x.z() < 1e-9; }, [=](const Vec3& x) { return x.z() > top; }, true);
  ASSERT_TRUE(body.ready);
  ASSERT_GT(body.compliance.places, body.compliance.touchable.size());
  auto cells = cap_cells(0.02, ringed_disc(2e-3, 2));
  for (ContactCell& cell : cells) cell.depth = 0.4e-3;
  const SurfaceCompliance part = force_part(body.compliance);
  ContactSolution whole_solution, part_solution;
  ContactResponse response;
  PatchContact(body.compliance, body.touch, tissue).solve(cells, whole_solution, response);
  PatchContact(part, body.touch, tissue).solve(cells, part_solution, response);
  ASSERT_TRUE(part_solution.converged);
  EXPECT_EQ(part_solution.forces, whole_solution.forces);
}

TEST(HalfPrecision, NothingToStoreIsNoError) {
  EXPECT_EQ(half_precision(SurfaceCompliance{}).error, 0.0);
  Example example(3, 2);
  example.compliance.columns[4] = std::numeric_limits<float>::infinity();
  EXPECT_TRUE(std::isinf(half_precision(example.compliance).error));
}

}  // namespace
}  // namespace viscera
