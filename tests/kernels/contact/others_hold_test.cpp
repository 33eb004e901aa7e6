// What one tool meets of a body that others hold.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>

#include "kernels/contact/patch_contact.h"
#include "tests/kernels/contact/bodies.h"

namespace viscera {
namespace {

using test::block, test::kTissue, test::kTop;

const MatrixX kEach = MatrixX::Identity(19, 19);

/// A flat punch of 19 cells, then what else touches the block.
std::vector<ContactCell> punch(double depth, const std::vector<ContactCell>& others) {
  auto cells = test::plane_cells(Vec3(-2e-3, 0, kTop), 0.5e-3, 2, 0.0, depth);
  cells.insert(cells.end(), others.begin(), others.end());
  return cells;
}

/// A jaw beside the punch that holds its patch, moved by `lift`.
std::vector<ContactCell> jaw(const Vec3& lift) {
  auto cells = test::plane_cells(Vec3(4e-3, 1e-3, kTop), 0.8e-3, 1, 0.0, 0.0);
  for (ContactCell& cell : cells) {
    cell.held = true;
    cell.displacement = lift;
  }
  return cells;
}

class OthersHoldOf : public testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(block().ready); }

  ContactSolution& solve(const std::vector<ContactCell>& cells) {
    contact.solve(cells, solution, response);
    EXPECT_TRUE(solution.converged);
    return solution;
  }
  static double push(const ContactSolution& solution) {
    double sum = 0.0;
    for (std::size_t k = 0; k < 19; ++k) sum -= solution.forces[k].z();
    return sum;
  }
  /// Of a punch that every cell touches, from what it meets and the body's own response.
  double foretold(const OthersHold& hold, const MatrixX& body, double depth) const {
    MatrixX along(19, 19);
    VectorX wanted(19);
    for (Eigen::Index i = 0; i < 19; ++i) {
      wanted[i] = depth + hold.free[static_cast<std::size_t>(i)].z();
      for (Eigen::Index j = 0; j < 19; ++j) {
        along(i, j) = body(3 * i + 2, 3 * j + 2);
        if (hold.taken.size() > 0) along(i, j) -= hold.taken(3 * i + 2, 3 * j + 2);
      }
    }
    return along.llt().solve(wanted).sum();
  }

  PatchContact contact{block().compliance, block().touch, kTissue};
  ContactSolution solution;
  ContactResponse response;
};

TEST_F(OthersHoldOf, AloneAToolMeetsTheBodyItself) {
  const auto cells = punch(0.4e-3, {});
  solve(cells);
  const auto hold = contact.hold_of_others(cells, 0, 19, kEach);
  ASSERT_TRUE(hold);
  EXPECT_EQ(hold->taken.size(), 0);
  for (const Vec3& free : hold->free) EXPECT_LT(free.norm(), 1e-12);
}

TEST_F(OthersHoldOf, ToldWhereTheTissueGoesWithoutTheToolAndHowStiffAJawMakesIt) {
  const auto others = jaw(Vec3(0, 0.2e-3, 0.8e-3));
  const auto cells = punch(0.4e-3, others);
  solve(cells);
  const auto hold = contact.hold_of_others(cells, 0, 19, kEach);
  ASSERT_TRUE(hold);
  const MatrixX body = contact.cell_response().topLeftCorner(57, 57);
  // Other depths are solved as foretold from this one.
  for (const double depth : {0.3e-3, 0.6e-3}) {
    const double force = push(solve(punch(depth, others)));
    EXPECT_NEAR(foretold(*hold, body, depth), force, 1e-4 * force);
  }
  // The jaw's hold counts: without it the tool would meet less.
  OthersHold slack = *hold;
  slack.taken.resize(0, 0);
  const double held = push(solve(punch(0.6e-3, others)));
  EXPECT_LT(foretold(slack, body, 0.6e-3), 0.995 * held);
  // The tool lifted off.
  solve(punch(-5e-3, others));
  for (std::size_t k = 0; k < 19; ++k)
    EXPECT_LT((contact.cell_displacements()[k] - hold->free[k]).norm(), 1e-8);
  EXPECT_GT(hold->free[0].z(), 0.05e-3);
}

TEST_F(OthersHoldOf, AToolThatPressesHoldsOnlyWhereItTouches) {
  auto others = test::plane_cells(Vec3(4e-3, 0, kTop), 0.5e-3, 2, 0.0, 0.5e-3);
  const auto cells = punch(0.4e-3, others);
  solve(cells);
  const auto hold = contact.hold_of_others(cells, 0, 19, kEach);
  ASSERT_TRUE(hold);
  const MatrixX body = contact.cell_response().topLeftCorner(57, 57);
  const double force = push(solve(punch(0.41e-3, others)));
  EXPECT_NEAR(foretold(*hold, body, 0.41e-3), force, 1e-4 * force);
  // It has pressed the tissue away from under this one.
  EXPECT_LT(hold->free[0].z(), -0.02e-3);
  for (ContactCell& cell : others) cell.depth = -1e-3;
  const auto apart = punch(0.4e-3, others);
  solve(apart);
  const auto none = contact.hold_of_others(apart, 0, 19, kEach);
  ASSERT_TRUE(none);
  EXPECT_EQ(none->taken.size(), 0);
}

TEST_F(OthersHoldOf, AskedForNoSumsItTellsWhereTheTissueGoesAlone) {
  const auto cells = punch(0.4e-3, jaw(Vec3(0, 0.2e-3, 0.8e-3)));
  solve(cells);
  const auto all = contact.hold_of_others(cells, 0, 19, kEach);
  const auto none = contact.hold_of_others(cells, 0, 19, MatrixX(0, 19));
  ASSERT_TRUE(all && none);
  EXPECT_EQ(none->taken.size(), 0);
  EXPECT_EQ(none->free, all->free);
}

// Only of a response that a hand shall have something is left, whatever holds.
TEST_F(OthersHoldOf, ToldWhereTissueGoesAloneThatAJawHoldsRightUnderTheTool) {
  auto others = test::plane_cells(Vec3(-1.9e-3, 0.1e-3, kTop), 0.5e-3, 2, 0.0, 0.0);
  const Vec3 lift(0, 0, 0.2e-3);
  for (ContactCell& cell : others) {
    cell.held = true;
    cell.displacement = lift;
  }
  const auto cells = punch(0.1e-3, others);
  solve(cells);
  const auto alone = contact.hold_of_others(cells, 0, 19, MatrixX(0, 19));
  const auto for_hand = contact.hold_of_others(cells, 0, 19, kEach);
  ASSERT_TRUE(alone && for_hand);
  solve(punch(-5e-3, others));
  double hand_errs = 0.0;
  for (std::size_t k = 0; k < 19; ++k) {
    const Vec3& is = contact.cell_displacements()[k];
    EXPECT_LT((is - alone->free[k]).norm(), 1e-8) << k;
    hand_errs = std::max(hand_errs, (is - for_hand->free[k]).norm());
  }
  EXPECT_GT(hand_errs, 0.02e-3) << "nothing was left out: this tests nothing";
}

TEST_F(OthersHoldOf, WithoutASolveThereIsNothingToTell) {
  const auto cells = punch(0.4e-3, {});
  EXPECT_FALSE(contact.hold_of_others(cells, 0, 19, kEach));
  solve(cells);
  EXPECT_FALSE(contact.hold_of_others(cells, 5, 5, kEach));
  EXPECT_FALSE(contact.hold_of_others(cells, 0, 20, MatrixX::Identity(20, 20)));
}

}  // namespace
}  // namespace viscera
