// The checks of the stress run themselves: each finds what it is for in a made-up history.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "tools/stress/refusals.h"
#include "tools/stress/stress_checks.h"

namespace viscera {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// One pressed cell on a spring of 100 N/m.
ContactMoment pressed(double depth) {
  ContactMoment moment;
  ContactCell cell;
  cell.area = 1e-6;
  cell.depth = depth;
  const double push = 100.0 * std::max(0.0, depth);
  moment.cells = {cell};
  moment.forces = {push * cell.direction};
  moment.displacements = {0.01 * push * cell.direction};
  moment.softness = {0.01};
  moment.converged = true;
  moment.smallest_eigenvalue = 1.0;
  return moment;
}

/// One held cell on springs of 100, 200 and 300 N/m with a coupling of `turn` between x and y that
/// has no energy: a force that turns with the displacement.
ContactMoment held(const Vec3& displacement, double turn = 0.0) {
  ContactMoment moment;
  ContactCell cell;
  cell.area = 1e-6;
  cell.held = true;
  cell.displacement = displacement;
  moment.cells = {cell};
  moment.forces = {Vec3(100.0 * displacement.x() - turn * displacement.y(),
                        200.0 * displacement.y() + turn * displacement.x(),
                        300.0 * displacement.z())};
  moment.displacements = {displacement};
  moment.softness = {0.01};
  moment.converged = true;
  moment.smallest_eigenvalue = 1.0 / 3.0;
  return moment;
}

/// Compliance of `count` nodes, all touchable, with this value on the diagonal.
SurfaceCompliance diagonal(int count, float value) {
  SurfaceCompliance compliance;
  compliance.places = static_cast<std::size_t>(count);
  for (int i = 0; i < count; ++i) compliance.touchable.push_back(i);
  compliance.columns.assign(compliance.rows() * compliance.rows(), 0.0f);
  for (std::size_t i = 0; i < compliance.rows(); ++i)
    compliance.columns[i * compliance.rows() + i] = value;
  return compliance;
}

TEST(StressChecks, SoundSpringPasses) {
  const std::vector<ContactMoment> history = {pressed(-1e-3), pressed(1e-3), pressed(3e-3),
                                              pressed(2e-3), pressed(-1e-3)};
  for (const ContactMoment& moment : history) EXPECT_TRUE(check_conditions(moment).sound());
  EXPECT_TRUE(check_energy(history).sound());
  const std::vector<ContactMoment> path = {held({0, 0, 0}), held({1e-3, 0, 0}),
                                           held({1e-3, 1e-3, 0}), held({0, 1e-3, 1e-3})};
  EXPECT_TRUE(check_energy(path).sound());
  EXPECT_TRUE(check_closed_path(path).sound());
}

TEST(StressChecks, PullingCellIsFound) {
  ContactMoment moment = pressed(1e-3);
  moment.forces[0] = -moment.forces[0];
  EXPECT_FALSE(check_conditions(moment).sound());
}

TEST(StressChecks, ForceOffItsDirectionIsFound) {
  ContactMoment moment = pressed(1e-3);
  moment.forces[0] += 1e-6 * moment.forces[0].norm() * Vec3::UnitX();
  EXPECT_FALSE(check_conditions(moment).sound());
}

TEST(StressChecks, PenetrationIsFound) {
  ContactMoment moment = pressed(1e-3);
  moment.displacements[0] *= 0.999;
  EXPECT_FALSE(check_conditions(moment).sound());
}

TEST(StressChecks, ForceWithoutTouchIsFound) {
  ContactMoment moment = pressed(1e-3);
  moment.displacements[0] *= 1.001;
  EXPECT_FALSE(check_conditions(moment).sound());
}

TEST(StressChecks, HeldCellThatSlippedIsFound) {
  ContactMoment moment = held({1e-3, 0, 0});
  moment.displacements[0].y() += 1e-6;
  EXPECT_FALSE(check_conditions(moment).sound());
}

TEST(StressChecks, NumbersThatAreNoneAreFound) {
  ContactMoment moment = pressed(1e-3);
  moment.forces[0].x() = kNaN;
  EXPECT_FALSE(check_conditions(moment).sound());
  moment = pressed(1e-3);
  moment.displacements[0].z() = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(check_conditions(moment).sound());
  moment = pressed(1e-3);
  moment.converged = false;
  EXPECT_FALSE(check_conditions(moment).sound());
  EXPECT_FALSE((StressFigure{"", kNaN, 1.0, ""}).sound());
}

TEST(StressChecks, ForceThatFallsWithDepthIsFound) {
  // 0.2 N at 2 mm, but only 0.15 N at 3 mm: out by the soft way, in by the stiff one, pays.
  ContactMoment weak = pressed(3e-3);
  weak.forces[0] *= 0.5;
  const std::vector<ContactMoment> history = {pressed(2e-3), weak};
  EXPECT_FALSE(check_energy(history).sound());
}

TEST(StressChecks, ForceThatRemembersTheWayIsFound) {
  // Harder on the way out than on the way in: each round gains the difference.
  ContactMoment out = pressed(1e-3);
  out.forces[0] *= 1.0 + 1e-6;
  const std::vector<ContactMoment> history = {pressed(1e-3), out};
  EXPECT_FALSE(check_same_force(history[0], history[1], "").sound());
  EXPECT_FALSE(check_energy(std::vector{pressed(0.0), pressed(1e-3), out, pressed(2e-3)}).sound());
}

TEST(StressChecks, TurningForceIsFound) {
  // f = K d with an unsymmetric K: a circle in one sense gives energy, in the other takes it.
  std::vector<ContactMoment> path, sound;
  for (int i = 0; i < 12; ++i) {
    const Vec3 at(1e-3 * std::cos(0.5236 * i), 1e-3 * std::sin(0.5236 * i), 0.0);
    path.push_back(held(at, 1e-3));
    sound.push_back(held(at));
  }
  EXPECT_TRUE(check_closed_path(sound).sound());
  EXPECT_FALSE(check_closed_path(path).sound());
}

/// One cell on springs of 100 N/m each way, under a tool with friction 0.5 that goes this way;
/// below z = 0 it presses. What passes Coulomb's cone slips back to it.
std::vector<ContactMoment> dragged(std::span<const Vec3> way) {
  constexpr double kFriction = 0.5;
  std::vector<ContactMoment> path;
  Vec3 drawn = Vec3::Zero();  // of the tissue, across
  for (std::size_t i = 0; i < way.size(); ++i) {
    ContactMoment moment = pressed(-way[i].z());
    const double push = moment.forces[0].norm();
    Vec3 wanted = Vec3::Zero();
    if (push > 0.0 && i > 0) wanted = drawn + way[i] - way[i - 1];
    wanted.z() = 0.0;
    const double most = 0.01 * kFriction * push;
    drawn = wanted.norm() > most ? Vec3(most * wanted.normalized()) : wanted;
    moment.cells[0].friction = kFriction;
    moment.cells[0].displacement = wanted;
    moment.forces[0] += 100.0 * drawn;
    moment.displacements[0] += drawn;
    moment.slips = {drawn - wanted};
    path.push_back(std::move(moment));
  }
  return path;
}

/// Down, aside far enough to slip, back, up: from clear of the tissue to clear of it.
std::vector<Vec3> there_and_back() {
  std::vector<Vec3> way;
  for (int i = -1; i <= 20; ++i) way.emplace_back(0.0, 0.0, -1e-4 * i);
  for (int i = 1; i <= 40; ++i) way.emplace_back(1e-4 * i, 0.0, -2e-3);
  for (int i = 39; i >= 0; --i) way.emplace_back(1e-4 * i, 0.0, -2e-3);
  for (int i = 19; i >= -1; --i) way.emplace_back(0.0, 0.0, -1e-4 * i);
  return way;
}

TEST(StressChecks, SoundDragPasses) {
  const std::vector<Vec3> way = there_and_back();
  const std::vector<ContactMoment> path = dragged(way);
  for (const ContactMoment& moment : path) EXPECT_TRUE(check_conditions(moment).sound());
  const auto slipped = [](const ContactMoment& moment) { return !moment.slips[0].isZero(); };
  EXPECT_GT(std::count_if(path.begin(), path.end(), slipped), 20);
  EXPECT_TRUE(check_friction(path, way).sound());
}

TEST(StressChecks, ToolThatNeverTouchedGainsNothing) {
  const std::vector<Vec3> way = {Vec3(0, 0, 1e-3), Vec3(1e-3, 0, 1e-3), Vec3(0, 0, 1e-3)};
  const StressFigure figure = check_friction(dragged(way), way);
  EXPECT_EQ(figure.figure, 0.0);
  EXPECT_TRUE(figure.sound());
}

TEST(StressChecks, SlipLongerThanTheWayThatDroveItIsFound) {
  // Friction would take more than the tool gave.
  const std::vector<Vec3> way = there_and_back();
  std::vector<ContactMoment> path = dragged(way);
  for (ContactMoment& moment : path) moment.slips[0] *= 2.0;
  EXPECT_FALSE(check_friction(path, way).sound());
}

TEST(StressChecks, PushThatGrowsOnTheWayOutIsFound) {
  const std::vector<Vec3> way = there_and_back();
  std::vector<ContactMoment> path = dragged(way);
  for (std::size_t i = path.size() - 20; i < path.size(); ++i) path[i].forces[0] *= 1.5;
  EXPECT_FALSE(check_friction(path, way).sound());
}

TEST(StressChecks, DragThatLeavesTheConeOnTheWayBackIsFound) {
  // Tissue that shoves the tool on as it returns, with three times what drew it.
  const std::vector<Vec3> way = there_and_back();
  std::vector<ContactMoment> path = dragged(way);
  for (std::size_t i = 1; i < path.size(); ++i) {
    Vec3& force = path[i].forces[0];
    if (way[i].x() < way[i - 1].x() && force.x() > 0.0) force.x() *= 3.0;
  }
  EXPECT_FALSE(check_friction(path, way).sound());
  EXPECT_TRUE(std::any_of(path.begin(), path.end(), [](const ContactMoment& moment) {
    return !check_conditions(moment).sound();
  }));
}

TEST(StressChecks, ForceThatIsNoNumberIsFoundInADrag) {
  const std::vector<Vec3> way = there_and_back();
  std::vector<ContactMoment> path = dragged(way);
  path[30].forces[0].y() = kNaN;
  EXPECT_FALSE(check_friction(path, way).sound());
}

TEST(StressChecks, ContactThatSaysItFoundNoForceAndGivesNoneIsHonest) {
  EXPECT_TRUE(check_honest(pressed(1e-3)).sound());
  ContactMoment failed = pressed(1e-3);
  failed.converged = false;
  failed.forces = {Vec3::Zero()};
  EXPECT_TRUE(check_honest(failed).sound());
}

TEST(StressChecks, ForceOfAContactThatSaysItFoundNoneIsCounted) {
  ContactMoment moment = pressed(1e-3);
  moment.converged = false;
  moment.cells.push_back(moment.cells[0]);
  moment.forces.push_back(Vec3::Zero());
  moment.displacements.push_back(Vec3::Zero());
  EXPECT_EQ(check_honest(moment).figure, 1.0);
  EXPECT_FALSE(check_honest(moment).sound());
}

TEST(StressChecks, NumbersThatAreNoneAreNeverHonest) {
  ContactMoment moment = pressed(1e-3);
  moment.displacements[0].y() = kNaN;
  EXPECT_FALSE(check_honest(moment).sound());
  moment = pressed(1e-3);
  moment.forces[0].x() = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(check_honest(moment).sound());
}

TEST(StressChecks, NegativeComplianceIsFound) {
  SurfaceCompliance compliance = diagonal(4, 1e-3f);
  EXPECT_TRUE(check_positive(compliance).sound());
  EXPECT_TRUE(check_finite(compliance).sound());
  // One entry of twelve, and a thousandth of the others in size.
  compliance.columns[5 * compliance.rows() + 5] = -1e-6f;
  EXPECT_FALSE(check_positive(compliance).sound());
}

TEST(StressChecks, LeastEigenvalueOfAComplianceIsTold) {
  SurfaceCompliance compliance = diagonal(3, 1.0f);
  compliance.columns[4 * compliance.rows() + 4] = -0.5f;
  EXPECT_NEAR(check_positive(compliance).figure, 0.5 / std::sqrt(8.25), 1e-7);
}

TEST(StressChecks, TurningPartOfAComplianceDoesNoWork) {
  SurfaceCompliance compliance = diagonal(3, 1.0f);
  compliance.symmetric = false;
  const std::size_t n = compliance.rows();
  for (std::size_t j = 0; j < n; ++j)
    for (std::size_t i = 0; i < n; ++i)
      if (i != j) compliance.columns[j * n + i] = i < j ? 0.3f : -0.3f;
  EXPECT_TRUE(check_positive(compliance).sound());
}

TEST(StressChecks, ComplianceOfRankOneIsNotTakenForNegative) {
  // Rounded entries of v v^T: its zero eigenvalues come out as round-off of either sign.
  SurfaceCompliance compliance = diagonal(20, 0.0f);
  const std::size_t n = compliance.rows();
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j)
      compliance.columns[i * n + j] =
          static_cast<float>(std::sin(1.0 + 0.37 * static_cast<double>(i)) *
                             std::sin(1.0 + 0.37 * static_cast<double>(j)));
  EXPECT_TRUE(check_positive(compliance).sound());
}

TEST(StressChecks, UnsymmetricSquareIsFound) {
  SurfaceCompliance compliance = diagonal(4, 1e-3f);
  compliance.columns[1] = 1e-9f;
  EXPECT_FALSE(check_positive(compliance).sound());
  compliance.symmetric = false;
  EXPECT_TRUE(check_positive(compliance).sound());
}

TEST(StressChecks, EntryThatIsNoNumberIsFound) {
  SurfaceCompliance compliance = diagonal(4, 1e-3f);
  compliance.columns[17] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(check_finite(compliance).sound());
  EXPECT_FALSE(check_positive(compliance).sound());
}

TEST(StressChecks, RefusalMustSayWhatToChange) {
  EXPECT_EQ(unclear_refusal("nodes: found 3, expected 4: use a smaller node spacing"), "");
  EXPECT_NE(unclear_refusal(""), "");
  EXPECT_NE(unclear_refusal("failed"), "");
}

/// Of a body whose places are springs of 100 N/m.
StressFigure least_of(const ContactMoment& moment) {
  StressBody body = make_stress_body(1, 0);
  body.material = {1e9, 0.3};  // its near field is nothing beside the springs
  return EnergyBound(body, {}, diagonal(3, 0.01f)).least(moment);
}

TEST(StressChecks, ForceAndEnergyTooSmallForTheSoftestPlaceAreFound) {
  EXPECT_TRUE(least_of(pressed(1e-3)).sound());
  EXPECT_NEAR(least_of(pressed(1e-3)).figure, 1.0, 1e-3);
  EXPECT_TRUE(least_of(pressed(-1e-3)).sound());
  ContactMoment weak = pressed(1e-3);
  weak.forces[0] *= 0.4;
  EXPECT_FALSE(least_of(weak).sound());
  weak.forces[0].setZero();
  EXPECT_FALSE(least_of(weak).sound());
  EXPECT_TRUE(least_of(held({1e-3, 0, 0})).sound());
}

TEST(StressRefusals, AreOfTheKindThatTheirWordsSay) {
  EXPECT_EQ(
      refusal_kind("nodes: 2 and 55 at (1 2 3) mm are 5.9 mm apart, with a spacing of 122 mm"),
      RefusalKind::kNodesTooNear);
  EXPECT_EQ(refusal_kind("compliance: its smallest eigenvalue is -0.1 of its largest"),
            RefusalKind::kNotPositive);
  EXPECT_EQ(refusal_kind("nodes: 3 nodes reach (1 2 3) mm and carry no linear field there"),
            RefusalKind::kTooFewNodes);
  EXPECT_EQ(
      refusal_kind("fixed region: of the body's 2 separate pieces 1 isn't held, with 42 nodes"),
      RefusalKind::kPieceNotHeld);
  EXPECT_EQ(refusal_kind("something nobody has thought of"), RefusalKind::kOther);
}

TEST(StressRefusals, MoreOfAKindThanItsCeilingAreTold) {
  Refusals refusals;
  refusals.cases = 10000;
  const auto positive = static_cast<std::size_t>(RefusalKind::kNotPositive);
  refusals.of_kind[positive] = refusals.ceiling(RefusalKind::kNotPositive, false);
  EXPECT_TRUE(refusals.over(false).empty());
  ++refusals.of_kind[positive];
  ASSERT_EQ(refusals.over(false).size(), 1u);
  EXPECT_NE(refusals.over(false)[0].find("\"not positive\": 1095 of 10000"), std::string::npos)
      << refusals.over(false)[0];
  // By galerkin there may be none at all.
  refusals.of_kind[positive] = 1;
  EXPECT_TRUE(refusals.over(false).empty());
  EXPECT_EQ(refusals.over(true).size(), 1u);
}

}  // namespace
}  // namespace viscera
