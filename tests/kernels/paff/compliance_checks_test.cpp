#include "kernels/paff/compliance_checks.h"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <limits>
#include <numeric>

#include "kernels/base/random.h"
#include "tests/support/baselines.h"

namespace viscera {
namespace {

/// A square whose symmetric part has these eigenvalues, with a skew part that must not matter
/// unless it is to be symmetric, in a compliance with two more places than touchable ones.
SurfaceCompliance with_eigenvalues(const VectorX& values, bool symmetric = false) {
  const Eigen::Index n = values.size();
  const Random random(5, 0);
  MatrixX noise(n, n);
  for (Eigen::Index i = 0; i < n * n; ++i) {
    noise(i / n, i % n) = random.normal(static_cast<std::uint64_t>(i));
  }
  const MatrixX q = Eigen::HouseholderQR<MatrixX>(noise).householderQ();
  const MatrixX skew = (symmetric ? 0.0 : 0.1) * (noise - noise.transpose());
  const MatrixX square = q * values.asDiagonal() * q.transpose() + skew;

  SurfaceCompliance compliance;
  compliance.symmetric = symmetric;
  compliance.places = static_cast<std::size_t>(n) / 3 + 2;
  for (int place = 0; place < static_cast<int>(compliance.places); ++place) {
    if (place != 0 && place != 3) compliance.touchable.push_back(place);
  }
  compliance.columns.assign(compliance.rows() * static_cast<std::size_t>(n), 7.0f);
  const std::vector<std::size_t> row_of = compliance.touchable_rows();
  for (std::size_t c = 0; c < row_of.size(); ++c) {
    for (std::size_t r = 0; r < row_of.size(); ++r) {
      compliance.columns[c * compliance.rows() + row_of[r]] =
          static_cast<float>(square(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c)));
    }
  }
  return compliance;
}

VectorX spread(double smallest) {
  VectorX values = VectorX::LinSpaced(60, 0.2, 1.0);
  values[0] = smallest;
  values[59] = 3.0;
  return values;
}

TEST(ComplianceChecks, FindTheSmallestEigenvalueOfTheSymmetricPart) {
  for (const double smallest : {0.1, 1e-3, 1e-5}) {
    const double found = smallest_compliance_eigenvalue(with_eigenvalues(spread(smallest)));
    EXPECT_NEAR(found, smallest / 3.0, 0.1 * smallest / 3.0 + 1e-7);
    EXPECT_TRUE(expect_positive_compliance(found));
  }
}

TEST(ComplianceChecks, FindNegativeEigenvaluesAndRefuseThem) {
  for (const double smallest : {-1e-2, -0.5, -2.9}) {
    const double found = smallest_compliance_eigenvalue(with_eigenvalues(spread(smallest)));
    EXPECT_LT(found, 0.0);
    EXPECT_NEAR(found, smallest / 3.0, 0.3 * std::abs(smallest / 3.0));
    const auto refused = expect_positive_compliance(found);
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().text().find("galerkin"), std::string::npos);
  }
  EXPECT_LT(smallest_compliance_eigenvalue(with_eigenvalues(-spread(0.1))), 0.0);
}

TEST(ComplianceChecks, RefuseAnUnsymmetricOneThatIsNegativeByMoreThanItsStorage) {
  // Here storing explains 2.3e-7 of the largest, and what a factor in single precision leaves 1e-6.
  const double slightly = -5e-7;
  const double found = smallest_compliance_eigenvalue(with_eigenvalues(spread(3.0 * slightly)));
  EXPECT_NEAR(found, slightly, 0.3 * std::abs(slightly));
  EXPECT_FALSE(expect_positive_compliance(found));
  const double of_symmetric =
      smallest_compliance_eigenvalue(with_eigenvalues(spread(3.0 * slightly), true));
  EXPECT_EQ(of_symmetric, 0.0);
  EXPECT_TRUE(expect_positive_compliance(of_symmetric));
  EXPECT_LT(smallest_compliance_eigenvalue(with_eigenvalues(spread(-1e-5), true)), 0.0);
  const double stored = smallest_compliance_eigenvalue(with_eigenvalues(spread(-3e-8)));
  EXPECT_TRUE(expect_positive_compliance(stored)) << stored;
}

TEST(ComplianceChecks, LeaveOutUnknownsThatDontRespond) {
  SurfaceCompliance compliance = with_eigenvalues(spread(0.1));
  const std::vector<std::size_t> row_of = compliance.touchable_rows();
  const double whole = smallest_compliance_eigenvalue(compliance);
  for (std::size_t i = 0; i < row_of.size(); ++i) {
    compliance.columns[4 * compliance.rows() + row_of[i]] = 0.0f;
    compliance.columns[i * compliance.rows() + row_of[4]] = 0.0f;
  }
  // Without one unknown, eigenvalues interlace: the smallest can't sink.
  EXPECT_GE(smallest_compliance_eigenvalue(compliance), 0.99 * whole);
  EXPECT_EQ(smallest_compliance_eigenvalue(SurfaceCompliance()), 1.0);
}

TEST(ComplianceChecks, FindASlightlyNegativeEigenvalueAmongManySmallOnes) {
  // Iteration towards it is slow here: its neighbours are as good but for a per cent.
  VectorX values = VectorX::LinSpaced(120, 1e-4, 0.05);
  values[0] = -0.01;
  values[119] = 1.0;
  const double found = smallest_compliance_eigenvalue(with_eigenvalues(values));
  EXPECT_NEAR(found, -0.01, 0.05 * 0.01);
}

TEST(ComplianceChecks, OnlyAFormulationThatWarnsMayGiveEnergyAway) {
  if (!test::strong_forms_built_in()) GTEST_SKIP() << test::kNoStrongForms;
  const Formulation &paper = *find_formulation("paper"), &gfdm = *find_formulation("gfdm");
  const auto told = accept_compliance(paper, -0.04);
  ASSERT_TRUE(told);
  EXPECT_NE(told->find("-0.04 of the largest"), std::string::npos) << *told;
  EXPECT_NE(told->find("energy"), std::string::npos) << *told;
  EXPECT_NE(told->find("haptic"), std::string::npos) << *told;
  EXPECT_FALSE(accept_compliance(gfdm, -0.04));
  EXPECT_FALSE(accept_compliance(*find_formulation("galerkin"), -0.04));
  for (const Formulation* formulation : {&paper, &gfdm}) {
    const auto positive = accept_compliance(*formulation, 1e-4);
    ASSERT_TRUE(positive);
    EXPECT_EQ(*positive, "");
    EXPECT_FALSE(accept_compliance(*formulation, std::numeric_limits<double>::quiet_NaN()));
  }
}

TEST(ComplianceChecks, RefuseWhatIsNotFinite) {
  SurfaceCompliance compliance = with_eigenvalues(spread(0.1));
  compliance.columns[compliance.touchable_rows()[0]] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(expect_positive_compliance(smallest_compliance_eigenvalue(compliance)));
}

}  // namespace
}  // namespace viscera
