#include "kernels/contact/touched_compliance.h"

#include <gtest/gtest.h>

namespace viscera {
namespace {

/// Eight places of which all but the first two are touchable, with entries that all differ.
SurfaceCompliance compliance_of_eight(bool symmetric) {
  SurfaceCompliance compliance;
  compliance.places = 8;
  compliance.touchable = {2, 3, 4, 5, 6, 7};
  compliance.symmetric = symmetric;
  const std::size_t rows = compliance.rows(), columns = 3 * compliance.touchable.size();
  compliance.columns.resize(rows * columns);
  for (std::size_t j = 0; j < columns; ++j)
    for (std::size_t i = 0; i < rows; ++i) {
      const std::size_t row = i, column = j + 6;  // of the touchable square's unknowns
      compliance.columns[j * rows + i] =
          static_cast<float>(symmetric && row > column ? 100 * column + row : 100 * row + column);
    }
  return compliance;
}

class TouchedComplianceKinds : public testing::TestWithParam<bool> {};

TEST_P(TouchedComplianceKinds, HoldsTheEntriesOfTouchedPlaces) {
  const SurfaceCompliance compliance = compliance_of_eight(GetParam());
  const std::vector<int> touched = {0, 3, 4};
  TouchedCompliance block;
  EXPECT_TRUE(block.gather(compliance, touched));
  EXPECT_FALSE(block.gather(compliance, touched));
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t b = GetParam() ? a : 0; b < 3; ++b)
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j) {
          const auto place = static_cast<std::size_t>(touched[i] + 2);
          const auto column = 3 * static_cast<std::size_t>(touched[j]) + b;
          EXPECT_EQ(
              block.parts()[3 * a + b](static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)),
              compliance.columns[column * compliance.rows() + 3 * place + a]);
        }
}

TEST_P(TouchedComplianceKinds, DependsOnThePlacesOfNowAlone) {
  const SurfaceCompliance compliance = compliance_of_eight(GetParam());
  TouchedCompliance followed, fresh;
  followed.gather(compliance, {0, 2, 3});
  followed.gather(compliance, {1, 2, 3, 5});
  fresh.gather(compliance, {1, 2, 3, 5});
  for (std::size_t part = 0; part < 9; ++part)
    EXPECT_EQ(followed.parts()[part], fresh.parts()[part]) << part;
}

INSTANTIATE_TEST_SUITE_P(Kinds, TouchedComplianceKinds, testing::Bool());

}  // namespace
}  // namespace viscera
