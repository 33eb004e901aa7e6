#include "kernels/contact/patch_contact.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>

#include "tests/kernels/contact/bodies.h"

namespace viscera {
namespace {

using test::block, test::kTissue, test::kTop;

class OnABlock : public ::testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(block().ready); }
  ContactSolution solve(const std::vector<ContactCell>& cells) {
    ContactSolution solution;
    contact.solve(cells, solution, response);
    return solution;
  }
  PatchContact contact{block().compliance, block().touch, kTissue};
  ContactResponse response;
};

TEST_F(OnABlock, NoCellPullsAndNoFreeCellIsPenetrated) {
  // Depths with gaps and a ridge, so that touching and free cells alternate.
  auto cells = test::plane_cells(Vec3(1e-3, 0, kTop), 0.4e-3, 5, 0.0, 0.3e-3);
  for (std::size_t k = 0; k < cells.size(); ++k) {
    cells[k].depth = 0.3e-3 * std::sin(3e3 * cells[k].position.x()) - 0.02e-3 * (k % 5);
  }
  const ContactSolution solution = solve(cells);
  ASSERT_TRUE(solution.converged);
  EXPECT_GT(solution.smallest_eigenvalue, 1e-4);
  EXPECT_LT(solution.violation, 1e-8);
  EXPECT_GT(solution.touching, 5);
  EXPECT_LT(solution.touching, static_cast<int>(cells.size()));
  for (std::size_t k = 0; k < cells.size(); ++k) {
    const double push = solution.forces[k].dot(cells[k].direction);
    const double moved = contact.cell_displacements()[k].dot(cells[k].direction);
    EXPECT_GE(push, 0.0);
    EXPECT_NEAR((solution.forces[k] - push * cells[k].direction).norm(), 0.0, 1e-15);
    EXPECT_GE(moved, cells[k].depth - 1e-8);
    EXPECT_LT(std::min(push, moved - cells[k].depth), 1e-9);
  }
}

TEST_F(OnABlock, CellsAboveTheSurfaceFeelNothing) {
  const ContactSolution solution =
      solve(test::plane_cells(Vec3(0, 0, kTop), 0.26e-3, 3, 1e-3, -0.1e-3));
  EXPECT_TRUE(solution.converged);
  EXPECT_EQ(solution.touching, 0);
  EXPECT_EQ(test::total_force(solution), Vec3::Zero());
  EXPECT_TRUE(response.touched.empty());
}

TEST_F(OnABlock, NoCellsMeanNoForces) {
  const ContactSolution solution = solve({});
  EXPECT_TRUE(solution.converged);
  EXPECT_TRUE(solution.forces.empty());
}

TEST_F(OnABlock, HeldCellsReachTheirDisplacement) {
  auto cells = test::plane_cells(Vec3(0.5e-3, -1e-3, kTop), 0.5e-3, 2, 0.0, 0.0);
  const Vec3 lift(0.4e-3, -0.2e-3, 1e-3);
  for (ContactCell& cell : cells) {
    cell.held = true;
    cell.displacement = lift;
  }
  const ContactSolution solution = solve(cells);
  ASSERT_TRUE(solution.converged);
  for (const Vec3& moved : contact.cell_displacements()) {
    EXPECT_LT((moved - lift).norm(), 1e-5 * lift.norm());
  }
  EXPECT_GT(test::total_force(solution).dot(lift), 0.0);
}

TEST_F(OnABlock, LoadsOnNodesAddUpToTheForces) {
  const ContactSolution solution =
      solve(test::plane_cells(Vec3(2e-3, 1e-3, kTop), 0.26e-3, 3, 1e-3, 0.5e-3));
  Vec3 sum = Vec3::Zero();
  for (const Vec3& load : response.loads) sum += load;
  EXPECT_LT((sum - test::total_force(solution)).norm(), 1e-5 * sum.norm());
}

TEST_F(OnABlock, ForceAndDisplacementAreReciprocal) {
  // Two held cells: the force that cell 1 needs to stay when cell 0 moves along a is the force that
  // cell 0 needs along a when cell 1 moves (Betti).
  std::vector<ContactCell> cells(2);
  cells[0].position = Vec3(-2e-3, 0, kTop);
  cells[1].position = Vec3(3e-3, 1e-3, kTop);
  for (ContactCell& cell : cells) {
    cell.area = 1e-6;
    cell.held = true;
  }
  MatrixX stiffness(6, 6);
  for (int j = 0; j < 6; ++j) {
    for (ContactCell& cell : cells) cell.displacement.setZero();
    cells[static_cast<std::size_t>(j / 3)].displacement[j % 3] = 1e-3;
    const ContactSolution solution = solve(cells);
    for (int i = 0; i < 6; ++i) {
      stiffness(i, j) = solution.forces[static_cast<std::size_t>(i / 3)][i % 3];
    }
  }
  EXPECT_LT((stiffness - stiffness.transpose()).norm(), 1e-10 * stiffness.norm());
}

TEST_F(OnABlock, WhatYieldsBehindHeldCellsTakesItsShareOfTheirDisplacement) {
  auto cells = test::plane_cells(Vec3(0.5e-3, -1e-3, kTop), 0.5e-3, 1, 0.0, 0.0);
  const auto n = static_cast<Eigen::Index>(3 * cells.size());
  for (ContactCell& cell : cells) {
    cell.held = true;
    cell.displacement = Vec3(0.4e-3, -0.2e-3, 1e-3);
  }
  const ContactSolution held = solve(cells);
  // Nothing yields: as without. Springs: u + f / k = displacement. The body itself behind it: half.
  ContactSolution stiff, soft, twin;
  contact.solve(cells, stiff, response, MatrixX::Zero(n, n));
  for (std::size_t k = 0; k < cells.size(); ++k) EXPECT_EQ(stiff.forces[k], held.forces[k]);
  contact.solve(cells, soft, response, 0.01 * MatrixX::Identity(n, n));
  ASSERT_TRUE(soft.converged);
  for (std::size_t k = 0; k < cells.size(); ++k)
    EXPECT_LT(
        (contact.cell_displacements()[k] + 0.01 * soft.forces[k] - cells[k].displacement).norm(),
        1e-5 * cells[k].displacement.norm());
  EXPECT_LT(test::total_force(soft).norm(), test::total_force(held).norm());
  const MatrixX same = contact.cell_response();
  contact.solve(cells, twin, response, 0.5 * (same + same.transpose()));
  for (const Vec3& moved : contact.cell_displacements())
    EXPECT_LT((moved - 0.5 * cells[0].displacement).norm(), 1e-4 * moved.norm());
}

TEST_F(OnABlock, ALoadMovesWhatASolveWithTheSameForcesMoves) {
  auto cells = test::plane_cells(Vec3(2e-3, 1e-3, kTop), 0.26e-3, 3, 1e-3, 0.5e-3);
  const ContactSolution solution = solve(cells);
  const auto moved = contact.cell_displacements();
  std::vector<float> places, again;
  contact.place_displacements(places);
  for (const bool after : {true, false}) {
    // Right after the solve, and by a solver that has met no conditions.
    PatchContact fresh{block().compliance, block().touch, kTissue};
    PatchContact& one = after ? contact : fresh;
    ContactSolution loaded;
    one.load(cells, solution.forces, loaded, response);
    EXPECT_EQ(loaded.touching, solution.touching);
    for (std::size_t k = 0; k < cells.size(); ++k)
      EXPECT_LT((one.cell_displacements()[k] - moved[k]).norm(), 1e-12);
    one.place_displacements(again);
    EXPECT_EQ(again, places);
  }
}

TEST_F(OnABlock, ClosedPathOfAHeldPatchGivesNoEnergyBack) {
  auto cells = test::plane_cells(Vec3(1e-3, 1e-3, kTop), 0.5e-3, 1, 0.0, 0.0);
  for (ContactCell& cell : cells) cell.held = true;
  constexpr int kSteps = 40;
  double work = 0.0, exchanged = 0.0;
  Vec3 before = Vec3::Zero(), force_before = Vec3::Zero();
  for (int i = 0; i <= kSteps; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kSteps;
    const Vec3 at(1e-3 * std::sin(angle), 0.6e-3 * std::sin(2.0 * angle),
                  0.8e-3 * (1.0 - std::cos(angle)));
    for (ContactCell& cell : cells) cell.displacement = at;
    const Vec3 force = test::total_force(solve(cells));
    const double step = 0.5 * (force + force_before).dot(at - before);
    work += step;
    exchanged += std::abs(step);
    before = at;
    force_before = force;
  }
  EXPECT_LT(std::abs(work), 1e-9 * exchanged);
}

TEST_F(OnABlock, PressingAndReleasingATipGivesNoEnergyBack) {
  // Cells join on the way down and leave on the way up; the force depends on the depth alone.
  constexpr int kSteps = 20;
  std::vector<double> down, up;
  for (int i = 0; i <= kSteps; ++i) {
    const double depth = 0.6e-3 * i / kSteps;
    down.push_back(
        test::total_force(solve(test::plane_cells(Vec3(0, 0, kTop), 0.26e-3, 3, 1e-3, depth))).z());
  }
  for (int i = kSteps; i >= 0; --i) {
    const double depth = 0.6e-3 * i / kSteps;
    up.push_back(
        test::total_force(solve(test::plane_cells(Vec3(0, 0, kTop), 0.26e-3, 3, 1e-3, depth))).z());
  }
  for (int i = 0; i <= kSteps; ++i) {
    EXPECT_NEAR(down[static_cast<std::size_t>(i)], up[static_cast<std::size_t>(kSteps - i)],
                1e-9 * std::abs(down.back()));
  }
}

TEST_F(OnABlock, ForceOfAHeldPatchIsTheGradientOfItsEnergy) {
  // The energy 1/2 f.u of a held patch, differenced centrally, against the force.
  auto cells = test::plane_cells(Vec3(0, 2e-3, kTop), 0.5e-3, 1, 0.0, 0.0);
  const auto energy_at = [&](const Vec3& displacement, Vec3& force) {
    for (ContactCell& cell : cells) {
      cell.held = true;
      cell.displacement = displacement;
    }
    force = test::total_force(solve(cells));
    return 0.5 * force.dot(displacement);
  };
  const Vec3 at(0.3e-3, -0.4e-3, -0.8e-3);
  Vec3 force, ignored;
  energy_at(at, force);
  for (int a = 0; a < 3; ++a) {
    const Vec3 step = 1e-5 * Vec3::Unit(a);
    const double slope = (energy_at(at + step, ignored) - energy_at(at - step, ignored)) / 2e-5;
    EXPECT_NEAR(slope, force[a], 1e-8 * force.norm());
  }
}

TEST_F(OnABlock, TwoToolsAtOneSpotStaySolvable) {
  auto cells = test::plane_cells(Vec3(0, 0, kTop), 0.26e-3, 3, 1e-3, 0.5e-3);
  const Vec3 one = test::total_force(solve(cells));
  const auto copy = cells;
  cells.insert(cells.end(), copy.begin(), copy.end());
  const ContactSolution both = solve(cells);
  ASSERT_TRUE(both.converged);
  EXPECT_LT((test::total_force(both) - one).norm(), 1e-3 * one.norm());
}

TEST(PatchContact, ToolsOfSeveralSizesAtOneSpotOfAThinPadGiveNoEnergyAway) {
  // A pad of 3 mm bonded to its base is stiffer than a half-space; there the sum of near and far
  // field is indefinite for cells of several sizes at one spot.
  const double top = 1.5e-3;
  const test::PressedBody pad =
      test::prepare_block(Vec3(0.03, 0.03, 2.0 * top), 2.5e-3, 0.01, kTissue);
  ASSERT_TRUE(pad.ready);
  PatchContact contact(pad.compliance, pad.touch, kTissue);
  std::vector<ContactCell> cells;
  for (const double pitch : {0.1e-3, 0.3e-3, 0.6e-3, 1.1e-3, 1.7e-3}) {
    const auto more = test::plane_cells(Vec3(0, 0, top), pitch, 2, 0.0, 0.0);
    cells.insert(cells.end(), more.begin(), more.end());
  }
  ContactSolution solution;
  ContactResponse response;
  const auto press = [&](double shift) {
    for (std::size_t k = 0; k < cells.size(); ++k)
      cells[k].depth = 0.1e-3 * std::sin(1.0 + shift + 0.7 * static_cast<double>(k));
    contact.solve(cells, solution, response);
    EXPECT_TRUE(solution.converged);
    double energy = 0.0;
    for (std::size_t k = 0; k < cells.size(); ++k) {
      EXPECT_GE(solution.forces[k].dot(cells[k].direction), 0.0);
      energy += 0.5 * solution.forces[k].dot(contact.cell_displacements()[k]);
    }
    EXPECT_GT(energy, 0.0);
    EXPECT_LT(solution.violation, 1e-8);
  };
  bool lifted = false;
  for (const double shift : {0.0, 0.9, 2.1, 4.0}) {
    press(shift);
    lifted = lifted || solution.lifted > 0.0;
    EXPECT_LT(solution.lifted, 0.1);
  }
  EXPECT_TRUE(lifted);
}

TEST(WideCell, OnFineNodesOverAStiffBaseAnswersPositively) {
  // A pad of 2 mm, bonded: far stiffer than a half-space under a cell that is 6 mm across. A bell
  // as narrow as the nodes are near each other would take more off its response than there is.
  const double top = 1e-3;
  const test::PressedBody pad = test::prepare_block(Vec3(24e-3, 24e-3, 2e-3), 1e-3, 10e-3, kTissue);
  ASSERT_TRUE(pad.ready);
  PatchContact contact(pad.compliance, pad.touch, kTissue);
  for (const double radius : {0.5e-3, 3e-3, 5e-3}) {
    std::vector<ContactCell> cells = test::plane_cells(Vec3(0, 0, top), 1e-3, 0, 0.0, 0.1e-3);
    cells[0].area = std::numbers::pi * radius * radius;
    ContactSolution solution;
    ContactResponse response;
    contact.solve(cells, solution, response);
    EXPECT_TRUE(solution.converged) << radius;
    EXPECT_GT(solution.smallest_eigenvalue, 0.0) << radius;
    EXPECT_EQ(solution.lifted, 0.0) << radius;
    EXPECT_GT(contact.cell_response().diagonal().minCoeff(), 0.0) << radius;
  }
}

TEST_F(OnABlock, ASingleToolNeedsNoLift) {
  EXPECT_EQ(solve(test::plane_cells(Vec3(0, 0, kTop), 0.26e-3, 3, 1e-3, 0.5e-3)).lifted, 0.0);
}

TEST_F(OnABlock, ToolsFeelEachOtherTheMoreTheNearerTheyAre) {
  const auto lone = test::plane_cells(Vec3(-6e-3, 0, kTop), 0.26e-3, 3, 1e-3, 0.5e-3);
  const double alone = -test::total_force(solve(lone)).z();
  const auto force_beside = [&](double distance) {
    auto cells = lone;
    const auto other = test::plane_cells(Vec3(-6e-3 + distance, 0, kTop), 0.26e-3, 3, 1e-3, 0.5e-3);
    cells.insert(cells.end(), other.begin(), other.end());
    const ContactSolution solution = solve(cells);
    double force = 0.0;
    for (std::size_t k = 0; k < lone.size(); ++k) force -= solution.forces[k].z();
    return force;
  };
  // The neighbour takes the surface down with it, so less force is needed.
  const double near = force_beside(3e-3), far = force_beside(12e-3);
  EXPECT_LT(near, 0.97 * far);
  EXPECT_LT(far, alone);
}

TEST_F(OnABlock, HeldAndPressedCellsTogetherMeetTheirConditions) {
  auto cells = test::plane_cells(Vec3(-4e-3, 0, kTop), 0.4e-3, 2, 0.0, 0.0);
  for (ContactCell& cell : cells) {
    cell.held = true;
    cell.displacement = Vec3(0, 0, 2e-3);
  }
  const auto pressed = test::plane_cells(Vec3(5e-3, 0, kTop), 0.26e-3, 3, 1e-3, 0.4e-3);
  cells.insert(cells.end(), pressed.begin(), pressed.end());
  const ContactSolution solution = solve(cells);
  ASSERT_TRUE(solution.converged);
  EXPECT_LT(solution.violation, 1e-8);
  for (std::size_t k = 0; k < cells.size(); ++k) {
    if (cells[k].held) {
      EXPECT_LT((contact.cell_displacements()[k] - cells[k].displacement).norm(), 1e-8);
    } else {
      EXPECT_LE(solution.forces[k].z(), 0.0);
    }
  }
}

TEST_F(OnABlock, CellBeyondTheTouchableRegionIsCounted) {
  auto cells = test::plane_cells(Vec3(0, 0, kTop), 0.26e-3, 1, 1e-3, 0.3e-3);
  cells.push_back(cells[0]);
  cells.back().position = Vec3(0, 0, -kTop);
  cells.back().normal = -Vec3::UnitZ();
  const ContactSolution solution = solve(cells);
  EXPECT_TRUE(solution.converged);
  EXPECT_EQ(solution.beyond_touchable, 1);
}

TEST_F(OnABlock, NonFiniteDepthGivesNoForces) {
  auto cells = test::plane_cells(Vec3(0, 0, kTop), 0.26e-3, 1, 1e-3, 0.3e-3);
  cells[2].depth = std::nan("");
  const ContactSolution solution = solve(cells);
  EXPECT_FALSE(solution.converged);
  EXPECT_EQ(test::total_force(solution), Vec3::Zero());
  cells[2].depth = 0.3e-3;
  EXPECT_TRUE(solve(cells).converged);
  cells[1].position.x() = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(solve(cells).converged);
}

TEST_F(OnABlock, CellWithoutAreaGivesNoForces) {
  auto cells = test::plane_cells(Vec3(0, 0, kTop), 0.26e-3, 1, 1e-3, 0.3e-3);
  cells[3].area = 0.0;
  EXPECT_FALSE(solve(cells).converged);
}

TEST_F(OnABlock, FrictionLiesBetweenSlidingAndSticking) {
  // Sideways on a flat punch: nothing without friction, the bonded force with much.
  const auto dragged = [&](double friction, bool held) {
    auto cells = test::plane_cells(Vec3(1e-3, 0, kTop), 0.4e-3, 2, 0.0, 0.3e-3);
    for (ContactCell& cell : cells) {
      cell.friction = friction;
      cell.held = held;
      cell.displacement = Vec3(0.1e-3, 0, -0.3e-3);
    }
    const ContactSolution solution = solve(cells);
    EXPECT_TRUE(solution.converged);
    EXPECT_GT(solution.smallest_eigenvalue, 0.0);
    return test::total_force(solution);
  };
  const Vec3 slid = dragged(0.0, false), stuck = dragged(0.0, true);
  EXPECT_LT((dragged(1e-9, false) - slid).norm(), 1e-7 * slid.norm());
  EXPECT_LT((dragged(1e3, false) - stuck).norm(), 1e-7 * stuck.norm());
  const Vec3 rubbed = dragged(0.1, false);
  EXPECT_GT(rubbed.x(), 0.05 * -rubbed.z());
  EXPECT_LE(rubbed.x(), 0.1 * -rubbed.z());
  EXPECT_LT(rubbed.x(), stuck.x());
}

TEST_F(OnABlock, SlipIsHowFarACellIsFromWhereItClung) {
  auto cells = test::plane_cells(Vec3(1e-3, 0, kTop), 0.4e-3, 2, 0.0, 0.3e-3);
  for (ContactCell& cell : cells) {
    cell.friction = 0.1;
    cell.displacement = Vec3(0.4e-3, 0, 0);
  }
  const ContactSolution solution = solve(cells);
  ASSERT_TRUE(solution.converged);
  for (std::size_t k = 0; k < cells.size(); ++k) {
    const Vec3& slip = solution.slips[k];
    const Vec3 off = contact.cell_displacements()[k] - cells[k].displacement;
    EXPECT_LT((slip - Vec3(off.x(), off.y(), 0)).norm(), 1e-9);
    const Vec3 drag(solution.forces[k].x(), solution.forces[k].y(), 0);
    EXPECT_NEAR(drag.norm(), 0.1 * -solution.forces[k].z(), 1e-8 * solution.forces[k].norm());
    EXPECT_NEAR(drag.dot(slip), -drag.norm() * slip.norm(), 1e-7 * drag.norm() * slip.norm());
    // From there it clings, so nothing slips any more and the force stays.
    cells[k].displacement += slip;
  }
  const ContactSolution again = solve(cells);
  ASSERT_TRUE(again.converged);
  EXPECT_LT((test::total_force(again) - test::total_force(solution)).norm(),
            1e-6 * test::total_force(solution).norm());
  for (const Vec3& slip : again.slips) EXPECT_LT(slip.norm(), 1e-6 * 0.4e-3);
}

TEST_F(OnABlock, NegativeFrictionGivesNoForces) {
  auto cells = test::plane_cells(Vec3(0, 0, kTop), 0.26e-3, 1, 1e-3, 0.3e-3);
  cells[1].friction = -0.1;
  EXPECT_FALSE(solve(cells).converged);
}

TEST_F(OnABlock, PatchThatStaysAnswersAsOneThatHasJustCome) {
  auto cells = test::plane_cells(Vec3(1e-3, 0, kTop), 0.4e-3, 2, 0.0, 0.3e-3);
  std::vector<float> displacements, expected;
  for (int step = 0; step < 20; ++step) {
    for (std::size_t k = 0; k < cells.size(); ++k) {
      cells[k].depth = 0.2e-3 + 1e-5 * step - 1e-5 * static_cast<double>(k);
      cells[k].held = step >= 15 && k % 2 == 0;  // the places stay, the conditions change
      cells[k].displacement = Vec3(0, 1e-5 * step, -cells[k].depth);
    }
    const ContactSolution solution = solve(cells);
    contact.place_displacements(displacements);
    PatchContact fresh(block().compliance, block().touch, kTissue);
    ContactSolution anew;
    ContactResponse loads;
    fresh.solve(cells, anew, loads);
    ASSERT_TRUE(solution.converged);
    EXPECT_EQ(solution.forces, anew.forces);
    EXPECT_EQ(solution.smallest_eigenvalue, anew.smallest_eigenvalue);
    fresh.place_displacements(expected);
    ASSERT_EQ(displacements.size(), expected.size());
    float greatest = 0.0f, apart = 0.0f;
    for (std::size_t i = 0; i < expected.size(); ++i) {
      greatest = std::max(greatest, std::abs(expected[i]));
      apart = std::max(apart, std::abs(expected[i] - displacements[i]));
    }
    EXPECT_LT(apart, 2e-6f * greatest) << "step " << step;
  }
}

TEST_F(OnABlock, AnchoredCellsAnswerAsOthersDo) {
  std::vector<ContactCell> anchors(3);
  for (std::size_t k = 0; k < anchors.size(); ++k) {
    anchors[k].position = Vec3(6e-3 * static_cast<double>(k) - 7e-3, 4e-3, kTop);
    anchors[k].area = 9e-6;
    anchors[k].held = true;
  }
  contact.anchor(anchors);
  PatchContact plain(block().compliance, block().touch, kTissue);
  const MatrixX backing = MatrixX::Identity(9, 9) * 2e-3;
  std::vector<float> displacements, expected;
  const auto greatest_of = [](const std::vector<float>& values) {
    float greatest = 0.0f;
    for (const float u : values) greatest = std::max(greatest, std::abs(u));
    return greatest;
  };
  for (int step = 0; step < 8; ++step) {
    // A tip that comes near the anchors, stays there, and is gone at the end.
    std::vector<ContactCell> cells;
    if (step < 7)
      cells = test::plane_cells(Vec3(1e-3 * std::min(step, 3) - 2e-3, 1e-3, kTop), 0.4e-3, 2, 0.0,
                                0.3e-3);
    cells.insert(cells.end(), anchors.begin(), anchors.end());
    cells.back().displacement = Vec3(0.1e-3, 0, 0.2e-3 * step);
    ContactSolution solution, wanted;
    ContactResponse loads, wanted_loads;
    contact.solve(cells, solution, loads, backing);
    plain.solve(cells, wanted, wanted_loads, backing);
    ASSERT_TRUE(solution.converged && wanted.converged);
    EXPECT_EQ(solution.near_fields.size(), cells.size());
    double force = 0.0, apart = 0.0, moved = 0.0, off = 0.0;
    for (std::size_t k = 0; k < cells.size(); ++k) {
      force = std::max(force, wanted.forces[k].norm());
      apart = std::max(apart, (solution.forces[k] - wanted.forces[k]).norm());
      moved = std::max(moved, plain.cell_displacements()[k].norm());
      off = std::max(off, (contact.cell_displacements()[k] - plain.cell_displacements()[k]).norm());
    }
    EXPECT_LT(apart, 2e-3 * force) << step;
    EXPECT_LT(off, 1e-3 * moved) << step;
    contact.place_displacements(displacements);
    plain.place_displacements(expected);
    ASSERT_EQ(displacements.size(), expected.size());
    std::vector<float> misses;
    for (std::size_t i = 0; i < expected.size(); ++i)
      misses.push_back(displacements[i] - expected[i]);
    EXPECT_LT(greatest_of(misses), 2e-3f * greatest_of(expected)) << step;
    // What others make of the response is the same body.
    place_displacements(block().compliance, loads, expected);
    for (std::size_t i = 0; i < expected.size(); ++i) misses[i] = displacements[i] - expected[i];
    EXPECT_LT(greatest_of(misses), 1e-3f * greatest_of(expected)) << step;
  }
}

TEST_F(OnABlock, DisplacementsAreThoseOfTheResponse) {
  solve(test::plane_cells(Vec3(1e-3, 0, kTop), 0.4e-3, 2, 1e-3, 0.3e-3));
  std::vector<float> displacements, expected;
  contact.place_displacements(displacements);
  place_displacements(block().compliance, response, expected);
  EXPECT_EQ(displacements, expected);
  solve({});
  contact.place_displacements(displacements);
  EXPECT_EQ(displacements, std::vector<float>(block().compliance.rows(), 0.0f));
}

TEST(UnsymmetricCompliance, BothTrianglesAreReadAndNeitherIsMirrored) {
  // The block's compliance with a twist that a mirror would cancel or double.
  SurfaceCompliance twisted = block().compliance;
  twisted.symmetric = false;
  const std::size_t rows = twisted.rows();
  const std::vector<int>& row_of = twisted.touchable;
  for (std::size_t j = 0; j < row_of.size(); ++j) {
    for (std::size_t i = 0; i < row_of.size(); ++i) {
      for (std::size_t a = 0; a < 3; ++a) {
        for (std::size_t b = 0; b < 3; ++b) {
          // Skew in (i a, j b): x of one place against y of the other.
          const double sign = a == 0 && b == 1 ? 1.0 : a == 1 && b == 0 ? -1.0 : 0.0;
          twisted.columns[(3 * j + b) * rows + 3 * static_cast<std::size_t>(row_of[i]) + a] +=
              static_cast<float>(0.05 * sign);
        }
      }
    }
  }
  std::vector<ContactCell> cells(2);
  cells[0].position = Vec3(-2e-3, 0, kTop);
  cells[1].position = Vec3(3e-3, 1e-3, kTop);
  for (ContactCell& cell : cells) {
    cell.area = 1e-6;
    cell.held = true;
  }
  const auto stiffness_of = [&](const SurfaceCompliance& compliance) {
    PatchContact contact(compliance, block().touch, kTissue);
    ContactSolution solution;
    ContactResponse response;
    MatrixX stiffness(6, 6);
    for (int j = 0; j < 6; ++j) {
      for (ContactCell& cell : cells) cell.displacement.setZero();
      cells[static_cast<std::size_t>(j / 3)].displacement[j % 3] = 1e-3;
      contact.solve(cells, solution, response);
      EXPECT_TRUE(solution.converged);
      for (int i = 0; i < 6; ++i) {
        stiffness(i, j) = 1e3 * solution.forces[static_cast<std::size_t>(i / 3)][i % 3];
      }
    }
    return stiffness;
  };
  // Weights add up to one, so a constant twist of places is the same twist of cells.
  MatrixX twist = MatrixX::Zero(6, 6);
  for (int i = 0; i < 6; i += 3) {
    for (int j = 0; j < 6; j += 3) {
      twist(i, j + 1) = 0.05;
      twist(i + 1, j) = -0.05;
    }
  }
  const MatrixX plain = stiffness_of(block().compliance).inverse();
  const MatrixX turned = stiffness_of(twisted).inverse();
  EXPECT_LT((turned - plain - twist).norm(), 1e-4 * plain.norm());
  EXPECT_GT(twist.norm(), 1e-2 * plain.norm());
}

TEST(PatchContact, HertzForceOnADeepBlock) {
  // F = (4/3) E* sqrt(R) d^(3/2), contact radius a = sqrt(R d) [Hertz1882], [Johnson1985]
  // ch. 4: 1.1 mm here, on nodes 7 mm apart. The block is bonded below and finite: about 2 %
  // stiffer than a half-space; cells of constant pressure lose about 1 % at the edge.
  const test::PressedBody body = test::prepare_block(Vec3(0.08, 0.08, 0.06), 7e-3, 0.025, kTissue);
  ASSERT_TRUE(body.ready);
  PatchContact contact(body.compliance, body.touch, kTissue);
  ContactSolution solution;
  ContactResponse response;
  const double radius = 5e-3, depth = 0.25e-3;
  contact.solve(test::plane_cells(Vec3(0.8e-3, 0.3e-3, 0.03), 0.2e-3, 7, radius, depth), solution,
                response);
  const double hertz =
      4.0 / 3.0 * kTissue.contact_modulus() * std::sqrt(radius) * std::pow(depth, 1.5);
  const double error = -test::total_force(solution).z() / hertz - 1.0;
  std::printf("Hertz: force %+.2f %% of the half-space's\n", 100.0 * error);
  EXPECT_NEAR(error, 0.01, 0.02);
}

}  // namespace
}  // namespace viscera
