// What contact must keep whatever the discretisation: energy, reciprocity, positivity.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <ranges>

#include "tests/accuracy/half_space_block.h"

namespace viscera {
namespace {

/// C among the touchable places, in double precision.
MatrixX touchable_square(const SurfaceCompliance& compliance) {
  const std::vector<std::size_t> rows = compliance.touchable_rows();
  const auto n = static_cast<Eigen::Index>(rows.size());
  MatrixX square(n, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    for (Eigen::Index i = 0; i < n; ++i) {
      square(i, j) = compliance.columns[static_cast<std::size_t>(j) * compliance.rows() +
                                        rows[static_cast<std::size_t>(i)]];
    }
  }
  return square;
}

TEST(Energy, ComplianceIsSymmetricAndPositive) {
  ASSERT_TRUE(test::half_space_block().ready);
  const MatrixX square = touchable_square(test::half_space_block().compliance);
  // Single precision rounds every entry to 6e-8 of itself; the factor adds some of its own.
  EXPECT_LT((square - square.transpose()).norm(), 1e-6 * square.norm());
  const MatrixX half = 0.5 * (square + square.transpose());
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<MatrixX>(half, Eigen::EigenvaluesOnly).eigenvalues()[0],
            0.0);
}

TEST(Energy, WorkOfAPressedBallIsTheStrainEnergy) {
  // Simpson's rule along the path, whose error for F ~ d^1.5 in 24 steps is below 1e-3: cells join
  // one after another, so the force isn't smooth.
  ASSERT_TRUE(test::half_space_block().ready);
  constexpr int kSteps = 24;
  const double deepest = 0.6e-3;
  double work = 0.0, stored = 0.0;
  for (int i = 1; i <= kSteps; ++i) {
    const auto cells = test::plane_cells(Vec3(2e-3, -1e-3, test::kBlockTop), 0.35e-3, 5, 4e-3,
                                         deepest * i / kSteps);
    const test::Answer answer = test::press_block(cells);
    work += answer.force * (i == kSteps ? 1.0 : i % 2 == 1 ? 4.0 : 2.0);
    stored = 0.0;
    for (std::size_t k = 0; k < cells.size(); ++k) {
      stored += 0.5 * answer.solution.forces[k].dot(answer.displacements[k]);
    }
  }
  work *= deepest / (3.0 * kSteps);
  EXPECT_GT(stored, 0.0);
  EXPECT_NEAR(work / stored, 1.0, 2e-3);
}

TEST(Energy, WorkOfACarriedJawIsTheStrainEnergy) {
  // Linear, so one step says it: W = F.u / 2, summed over the nodes' loads and the cells.
  ASSERT_TRUE(test::half_space_block().ready);
  auto cells = test::plane_cells(Vec3(1e-3, 0, test::kBlockTop), 0.6e-3, 2, 0.0, 0.0);
  const Vec3 carried(0.4e-3, -0.2e-3, 1e-3);
  for (ContactCell& cell : cells) {
    cell.held = true;
    cell.displacement = carried;
  }
  const test::Answer answer = test::press_block(cells);
  double stored = 0.0;
  for (std::size_t k = 0; k < cells.size(); ++k) {
    stored += 0.5 * answer.solution.forces[k].dot(answer.displacements[k]);
  }
  const double work = 0.5 * test::total_force(answer.solution).dot(carried);
  EXPECT_GT(work, 0.0);
  EXPECT_NEAR(stored / work, 1.0, 1e-5);  // cells reach their place to the ridge of 1e-6
}

TEST(Energy, ToolsAreReciprocal) {
  // Betti: the work of one ball-like load on the other's displacements is the other's on its own.
  ASSERT_TRUE(test::half_space_block().ready);
  auto cells = test::plane_cells(Vec3(-5e-3, 0, test::kBlockTop), 0.5e-3, 1, 0.0, 0.0);
  const std::size_t half = cells.size();
  const auto other = test::plane_cells(Vec3(6e-3, 2e-3, test::kBlockTop), 0.7e-3, 1, 0.0, 0.0);
  cells.insert(cells.end(), other.begin(), other.end());
  const auto answer_to = [&](const Vec3& first, const Vec3& second) {
    for (std::size_t k = 0; k < cells.size(); ++k) {
      cells[k].held = true;
      cells[k].displacement = k < half ? first : second;
    }
    return test::press_block(cells);
  };
  const test::Answer one = answer_to(Vec3(1e-3, 0, -1e-3), Vec3(0, 0.3e-3, 0));
  const test::Answer two = answer_to(Vec3(0, 0.2e-3, 0.4e-3), Vec3(-1e-3, 0, 1e-3));
  double forth = 0.0, back = 0.0;
  for (std::size_t k = 0; k < cells.size(); ++k) {
    forth += one.solution.forces[k].dot(two.displacements[k]);
    back += two.solution.forces[k].dot(one.displacements[k]);
  }
  EXPECT_NEAR(forth / back, 1.0, 1e-9);
}

TEST(Energy, StiffnessOfAPressedBallIsThatOfItsContact) {
  // dF/dd by differences against 1^T A^-1 1 of the cells in contact: 2 E* a on a half-space.
  ASSERT_TRUE(test::half_space_block().ready);
  const auto force_at = [](double depth) {
    return test::press_block(
        test::plane_cells(Vec3(0, 0, test::kBlockTop), 0.35e-3, 5, 4e-3, depth));
  };
  const double depth = 0.5e-3, step = 1e-7;
  const test::Answer at = force_at(depth);
  const double slope = (force_at(depth + step).force - force_at(depth - step).force) / (2.0 * step);
  // The cells in contact, moved down together as one punch.
  auto cells = test::plane_cells(Vec3(0, 0, test::kBlockTop), 0.35e-3, 5, 0.0, 1.0);
  std::vector<ContactCell> touching;
  for (std::size_t k = 0; k < cells.size(); ++k) {
    if (at.solution.forces[k].z() < 0.0) touching.push_back(cells[k]);
  }
  ASSERT_LT(touching.size(), cells.size());
  EXPECT_NEAR(slope / test::press_block(touching).force, 1.0, 1e-6);
}

TEST(Energy, SinglePrecisionComplianceGivesTheForcesOfDouble) {
  // The stored columns against columns solved for in double precision, as forces of a punch.
  ASSERT_TRUE(test::half_space_block().ready);
  const test::PressedBody& body = test::half_space_block();
  const ElasticProblem problem{&body.surface, &body.cloud, body.material,
                               [](const Vec3& x) { return x.z() < -test::kBlockTop + 1e-9; }};
  auto solver = find_formulation("galerkin")->prepare(problem, no_progress());
  ASSERT_TRUE(solver) << solver.error().text();
  const SparseWeights& fields = body.places.fields;
  const auto entries_of = [&](int place) {
    return std::views::iota(fields.row_begin[static_cast<std::size_t>(place)],
                            fields.row_begin[static_cast<std::size_t>(place) + 1]);
  };
  std::vector<double> loads(3 * body.cloud.size(), 0.0);
  for (const int e : entries_of(body.compliance.touchable[3])) {
    const auto entry = static_cast<std::size_t>(e);
    loads[3 * static_cast<std::size_t>(fields.nodes[entry]) + 2] = fields.values[entry];
  }
  ASSERT_TRUE((*solver)->solve(loads, 1));
  double error = 0.0, size = 0.0;
  const float* column = body.compliance.columns.data() + (3 * 3 + 2) * body.compliance.rows();
  for (int place = 0; place < static_cast<int>(body.places.size()); ++place) {
    Vec3 exact = Vec3::Zero();
    for (const int e : entries_of(place)) {
      const auto entry = static_cast<std::size_t>(e);
      exact += fields.values[entry] * Vec3::Map(loads.data() + 3 * fields.nodes[entry]);
    }
    error += (Vec3f::Map(column + 3 * place).cast<double>() - exact).squaredNorm();
    size += exact.squaredNorm();
  }
  EXPECT_LT(std::sqrt(error / size), 1e-5);
}

}  // namespace
}  // namespace viscera
