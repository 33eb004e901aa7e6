#include "kernels/contact/cell_answers.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace viscera {
namespace {

constexpr std::size_t kRows = 4, kPlaces = 5;

std::vector<float> columns_of_places() {
  std::vector<float> values(kRows * 3 * kPlaces);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>(i * i % 97);
  return values;
}

/// The column triple of one of the cells that an object follows.
std::vector<float> triple_of(const CellAnswers& answers, std::size_t cell) {
  const ColumnTriples columns = answers.columns();
  const float* first =
      columns.values + 3 * columns.stride * static_cast<std::size_t>(answers.number(cell));
  return {first, first + 3 * columns.rows};
}

const CellShares kOne{{0, 2}, {0.25, 0.75}}, kTwo{{1, 2, 4}, {0.5, 0.25, 0.25}}, kThree{{3}, {1.0}};

TEST(CellAnswers, AreSumsOfThePlacesColumnsByShares) {
  const std::vector<float> values = columns_of_places();
  CellAnswers answers;
  answers.follow({kOne, kTwo});
  answers.need(std::vector<std::size_t>{1}, {values.data(), kRows, kRows});
  std::vector<float> expected(3 * kRows);
  sum_weighted_triples({values.data(), kRows, kRows}, kTwo.places, kTwo.shares, expected.data());
  EXPECT_EQ(triple_of(answers, 1), expected);
}

TEST(CellAnswers, AreMadeForCellsThatAreNeededAlone) {
  const std::vector<float> values = columns_of_places();
  CellAnswers answers;
  answers.follow({kOne, kTwo, kThree});
  answers.need(std::vector<std::size_t>{2}, {values.data(), kRows, kRows});
  EXPECT_LT(answers.number(0), 0);
  EXPECT_LT(answers.number(1), 0);
  EXPECT_GE(answers.number(2), 0);
}

TEST(CellAnswers, StayWithTheirCellsAsOthersComeAndGo) {
  const std::vector<float> values = columns_of_places();
  const ColumnTriples places{values.data(), kRows, kRows};
  CellAnswers followed, fresh;
  followed.follow({kOne, kTwo});
  followed.need(std::vector<std::size_t>{0, 1}, places);
  const int kept = followed.number(1);
  followed.follow({kThree, kTwo});
  EXPECT_EQ(followed.number(1), kept);
  fresh.follow({kThree, kTwo});
  const std::vector<std::size_t> both = {0, 1};
  followed.need(both, places);
  fresh.need(both, places);
  for (const std::size_t cell : both) EXPECT_EQ(triple_of(followed, cell), triple_of(fresh, cell));
}

/// Two tools may press the very same place.
TEST(CellAnswers, AreMadeForEachOfTwoCellsThatAreAlike) {
  const std::vector<float> values = columns_of_places();
  const ColumnTriples places{values.data(), kRows, kRows};
  CellAnswers answers;
  answers.follow({kOne});
  answers.need(std::vector<std::size_t>{0}, places);
  answers.follow({kOne, kOne});
  answers.need(std::vector<std::size_t>{0, 1}, places);
  EXPECT_NE(answers.number(0), answers.number(1));
  EXPECT_EQ(triple_of(answers, 0), triple_of(answers, 1));
}

}  // namespace
}  // namespace viscera
