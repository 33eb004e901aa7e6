#include "kernels/contact/passivity.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace viscera {
namespace {

/// All of `count` nodes touchable; entry (row, column) from a function.
template <class Entry>
SurfaceCompliance compliance_of(int count, const Entry& entry) {
  SurfaceCompliance compliance;
  for (int i = 0; i < count; ++i) compliance.visible.push_back(i);
  compliance.touchable = compliance.visible;
  for (int column = 0; column < 3 * count; ++column)
    for (int row = 0; row < 3 * count; ++row)
      compliance.columns.push_back(static_cast<float>(entry(row, column)));
  return compliance;
}

TEST(Passivity, PositiveComplianceIsAccepted) {
  const auto springs = compliance_of(5, [](int i, int j) { return i == j ? 1e-3 : 0.0; });
  EXPECT_EQ(negative_compliance(springs), 0.0);
}

TEST(Passivity, RoundedZeroEigenvaluesAreAccepted) {
  const auto wave = [](int i) { return std::sin(1.0 + 0.37 * i); };
  const auto rank_one = compliance_of(20, [&](int i, int j) { return wave(i) * wave(j); });
  EXPECT_EQ(negative_compliance(rank_one), 0.0);
}

TEST(Passivity, LeastEigenvalueIsTold) {
  const auto broken =
      compliance_of(3, [](int i, int j) { return i != j ? 0.0 : (i == 4 ? -0.5 : 1.0); });
  EXPECT_NEAR(negative_compliance(broken), -0.5 / std::sqrt(8.25), 1e-7);
}

TEST(Passivity, TurningPartDoesNoWorkAndIsIgnored) {
  const auto turning =
      compliance_of(3, [](int i, int j) { return i == j ? 1.0 : (i < j ? 0.3 : -0.3); });
  EXPECT_EQ(negative_compliance(turning), 0.0);
}

TEST(Passivity, EntriesThatAreNoNumbersAreTold) {
  auto broken = compliance_of(3, [](int i, int j) { return i == j ? 1.0 : 0.0; });
  broken.columns[7] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_TRUE(std::isnan(negative_compliance(broken)));
}

}  // namespace
}  // namespace viscera
