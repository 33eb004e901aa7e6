// Pieces that a grasper takes out through its trocar.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include "engine/features/parting/parting_flags.h"
#include "engine/features/parting/remove_pieces.h"
#include "engine/simulator/build.h"
#include "kernels/finite/finite_solver.h"
#include "kernels/paff/continued_nodes.h"
#include "kernels/points/closed_pieces.h"
#include "kernels/points/surface_checks.h"
#include "tests/support/cutting.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

constexpr double kCutAt = 6e-3;  // the blade's way along x [m]
// Off the block by the first; at the trocar at the second; gone by the third [s].
constexpr double kPieceOff = 1.6, kCarriedBy = 2.6, kTakenOut = 4.2;
/// Wide enough for the piece, whose section is 16 mm square [m].
constexpr double kWideBore = 17e-3;

/// A grasper holds the end that a blade cuts off, and carries it straight up to its trocar.
SceneDescription end_to_take_out(double bore) {
  SceneDescription scene = bar_to_sever(Vec3::UnitZ(), Vec3(kCutAt, 0, 0));
  const Vec3 above(12e-3, 0, 14e-3), on(12e-3, 0, 9.8e-3), out(12e-3, 0, 52e-3);
  InstrumentDescription grasper = straight_tool("grasper", InstrumentKind::kGrasper, 1.5e-3,
                                                {{0.0, above, 0.0, 1.0},
                                                 {0.05, on, 0.0, 1.0},
                                                 {0.1, on, 0.0, 0.0},
                                                 {kPieceOff, on, 0.0, 0.0},
                                                 {kCarriedBy - 0.1, out, 0.0, 0.0}});
  grasper.trocar = Vec3(12e-3, 0, 60e-3);
  grasper.extras.set(BoreDescription{bore});
  scene.instruments.push_back(grasper);
  return scene;
}

const OrganCut& cut_in(const World& world) {
  return world.all<OrganCut>()[0];
}
const TriangleSurface& surface_in(const World& world) {
  return world.all<OrganBody>()[0].model->surface;
}
bool holds_tissue(const World& world) {
  return world.find<InstrumentContact>(world.model().instruments()[1])->grasp.has_value();
}
/// Of the part that is held: the greatest displacement of its vertices [m].
double held_part_moved(const World& world) {
  double greatest = 0.0;
  const std::vector<Vec3>& rest = surface_in(world).vertices;
  for (std::size_t v = 0; v < rest.size(); ++v)
    if (rest[v].x() < kCutAt)
      greatest = std::max(
          greatest, (world.all<OrganState>()[0].positions[v].cast<double>() - rest[v]).norm());
  return greatest;
}

TEST(Removed, APieceThatIsCarriedToTheTrocarLeavesTheScene) {
  const auto world = build(end_to_take_out(kWideBore));
  ASSERT_TRUE(world);
  step_until(*world, kPieceOff);
  std::vector<TriangleSurface> pieces = closed_pieces(surface_in(*world));
  ASSERT_EQ(pieces.size(), 2u);
  ASSERT_TRUE(holds_tissue(*world));
  EXPECT_TRUE(cut_in(*world).removed.empty());
  const double both = volume(surface_in(*world));
  const double off = std::min(volume(pieces[0]), volume(pieces[1]));
  const std::size_t nodes = world->all<OrganBody>()[0].model->cloud.size();

  step_until(*world, kCarriedBy);
  ASSERT_EQ(cut_in(*world).removed.size(), 1u) << "at its trocar with a piece that fits";
  EXPECT_EQ(step_until(*world, kTakenOut), FlagSet());
  EXPECT_EQ(cut_in(*world).refused, 0u) << world->all<OrganLeft>()[0].refusal;
  ASSERT_EQ(cut_in(*world).removed_used, 1u);
  EXPECT_EQ(closed_pieces(surface_in(*world)).size(), 1u);
  EXPECT_EQ(surface_defects(surface_in(*world)), std::vector<std::string>());
  // By the same shares of tissue, of which slivers may be gone since.
  EXPECT_NEAR(volume(surface_in(*world)), both - off, 1e-3 * off);
  EXPECT_NEAR(world->all<OrganLeft>()[0].removed, off, 0.02 * off);
  EXPECT_TRUE(world->all<OrganBody>()[0].model->finite->loose().empty());
  EXPECT_LT(world->all<OrganBody>()[0].model->cloud.size(), nodes);
  EXPECT_FALSE(holds_tissue(*world));
  EXPECT_FALSE(world->all<OrganState>()[0].frozen);
}

TEST(Removed, WhatIsHeldStaysWhereItIsAsAPieceLeaves) {
  const auto world = build(end_to_take_out(kWideBore));
  ASSERT_TRUE(world);
  step_until(*world, kCarriedBy);
  Trace trace(stage_names());
  double greatest = held_part_moved(*world);
  // Were nodes beside the cut to go on as the piece did, they would be 42 mm away.
  while (world->time() < kTakenOut) {
    step_frame(*world, trace);
    greatest = std::max(greatest, held_part_moved(*world));
  }
  ASSERT_EQ(cut_in(*world).removed_used, 1u);
  EXPECT_LT(greatest, 0.5e-3);
}

TEST(Removed, TheReportTellsWhatWasTakenOutApartFromWhatBladesTook) {
  const auto world = build(end_to_take_out(kWideBore));
  ASSERT_TRUE(world);
  step_until(*world, kPieceOff);
  const auto told = [&] { return nlohmann::json::parse(parting_report(*world)[0].json); };
  const double taken = told()["organs"][0]["taken_m3"];
  EXPECT_EQ(told()["removed_pieces"], 0);
  step_until(*world, kTakenOut);
  const nlohmann::json one = told()["organs"][0];
  EXPECT_EQ(told()["removed_pieces"], 1);
  EXPECT_EQ(one["removed_pieces"], 1);
  EXPECT_EQ(one["pieces"], 1);
  const double volume = one["removed_m3"], mass = one["removed_kg"];
  // From the kerf's wall to the block's end.
  EXPECT_NEAR(volume, (0.5 * kBarToSever.x() - kCutAt - 0.4e-3) * kBarToSever.y() * kBarToSever.z(),
              0.1 * volume);
  EXPECT_NEAR(mass, 1060.0 * volume, 0.02 * mass);
  EXPECT_NEAR(one["taken_m3"].get<double>(), taken, 0.01 * taken);
}

TEST(Removed, APieceThatIsTooWideStaysInTheJawsAndIsToldOnce) {
  const auto world = build(end_to_take_out(12e-3));
  ASSERT_TRUE(world);
  Trace trace(stage_names());
  int told = 0;
  while (world->time() < 3.2) told += step_frame(*world, trace).flags.has(kPieceStuck) ? 1 : 0;
  EXPECT_EQ(told, 1);
  EXPECT_TRUE(cut_in(*world).removed.empty());
  EXPECT_EQ(closed_pieces(surface_in(*world)).size(), 2u);
  EXPECT_TRUE(holds_tissue(*world));
}

TEST(Removed, ASnapshotBeforeAndAfterMakesTheSameBodyAgain) {
  const Model model = build_shared(end_to_take_out(kWideBore));
  auto one = Simulation::create(model);
  ASSERT_TRUE(one);
  std::vector<Snapshot> snapshots;
  std::vector<std::string> hashes;
  for (const double time : {kPieceOff, kCarriedBy, kTakenOut}) {
    while (one->time() < time) one->step();
    snapshots.push_back(*one->snapshot());
    hashes.push_back(one->hash());
  }
  ASSERT_EQ(cut_in(one->world()).removed_used, 1u);
  const std::vector<Vec3> vertices = surface_in(one->world()).vertices;
  constexpr double kEnd = kTakenOut + 0.2;
  while (one->time() < kEnd) one->step();
  auto other = Simulation::create(model);
  ASSERT_TRUE(other);
  for (const std::size_t i : {2, 0, 1}) {
    const auto restored = other->restore(snapshots[i]);
    ASSERT_TRUE(restored) << restored.error().text();
    EXPECT_EQ(other->hash(), hashes[i]) << i;
    if (i == 2) {
      EXPECT_EQ(surface_in(other->world()).vertices, vertices);
    }
    while (other->time() < kEnd) other->step();
    EXPECT_EQ(other->hash(), one->hash())
        << "from " << i << ": " << other->world().state_difference(one->world());
  }
}

TEST(Removed, NodesGoOnAsWhatIsHeldThoughAThinPieceTakesNoneAlong) {
  const auto world = build(end_to_take_out(kWideBore));
  ASSERT_TRUE(world);
  const CuttableOrgan& organ = *world->all<Cuttable>()[0].organ;
  // The last 2 mm of the block, half a spacing, are cut off.
  constexpr double kSlice = 2e-3, kKerf = 1e-3;
  const double cut_at = 0.5 * kBarToSever.x() - kSlice - kKerf;
  TissueShare tissue(0.4e-3);
  tissue.take_out(
      Box(Vec3(cut_at, -1e-2, -1e-2), Vec3(cut_at + kKerf, 1e-2, 1e-2)),
      [&](const Vec3& place) { return std::abs(place.x() - cut_at - 0.5 * kKerf) - 0.5 * kKerf; });
  const auto off = cut_organ(organ, tissue, {}, *organ.whole, *organ.fields);
  ASSERT_TRUE(off) << off.error().text();
  ASSERT_EQ(off->loose.size(), 2u);
  const std::vector<Vec3> place = {Vec3(0.5 * (kBarToSever.x() - kSlice), 0, 0)};
  const auto left = cut_organ(organ, tissue, place, *off->model, *off->fields);
  ASSERT_TRUE(left) << left.error().text();
  EXPECT_EQ(own_nodes(*left->fields), own_nodes(*off->fields)) << "this test is of such a piece";
  const LoosePieces& loose = off->model->finite->loose();
  for (const int node : left->continuation.nodes)
    EXPECT_FALSE(loose.has(static_cast<std::size_t>(node))) << node;
}

TEST(Removed, AStateThatTellsOfPiecesThatCannotBeIsRefused) {
  const Box bounds(Vec3::Constant(-1e-2), Vec3::Constant(1e-2));
  OrganCut cut;
  EXPECT_TRUE(check_removed(cut, bounds));
  cut.removed_asked = cut.removed_used = 1;
  EXPECT_FALSE(check_removed(cut, bounds));
  cut.removed.push_back({Vec3::Zero(), 1e-3});
  EXPECT_TRUE(check_removed(cut, bounds));
  cut.removed_used = 2;
  EXPECT_FALSE(check_removed(cut, bounds));
  cut.removed_used = 1;
  for (const Vec3& nowhere : {Vec3(1e200, 0, 0), Vec3(0, NAN, 0), Vec3(0, 0, 2e-2)}) {
    cut.removed[0].within = nowhere;
    EXPECT_FALSE(check_removed(cut, bounds)) << nowhere.transpose();
  }
}

TEST(Removed, AStateOfBladesAndGraspsThatCannotBeIsTakenWithoutThem) {
  const auto world = build(end_to_take_out(kWideBore));
  ASSERT_TRUE(world);
  step_until(*world, kPieceOff);
  ASSERT_TRUE(holds_tissue(*world));
  OrganCut& cut = world->all<OrganCut>()[0];
  const Entity scalpel = world->model().instruments()[0];
  cut.blades = {{.instrument = scalpel, .blade = 0, .edge = std::vector<Vec3>(9, Vec3::Zero())},
                {.instrument = scalpel,
                 .blade = 7,
                 .edge = {Vec3::Constant(NAN)},
                 .above = {-1.0},
                 .pieces = {99}},
                {.instrument = {}, .edge = {Vec3::Zero()}}};
  world->find<InstrumentContact>(world->model().instruments()[1])->grasp->points[0].triangle =
      1 << 30;
  const auto bytes = world->save_state();
  auto other = start_world(world->shared_model());
  ASSERT_TRUE(other);
  ASSERT_TRUE((*other)->load_state(bytes));
  ASSERT_EQ(cut_in(**other).blades.size(), 1u);
  EXPECT_TRUE(cut_in(**other).blades[0].edge.empty());
  EXPECT_FALSE(holds_tissue(**other));
  step_until(**other, kPieceOff + 0.1);
}

/// A box of this size, turned.
TriangleSurface turned_box(const Vec3& size) {
  const Eigen::AngleAxisd turned(0.7, Vec3(1, 2, 3).normalized());
  TriangleSurface box;
  for (const double x : {-0.5, 0.5})
    for (const double y : {-0.5, 0.5})
      for (const double z : {-0.5, 0.5})
        box.vertices.push_back(turned * Vec3(x, y, z).cwiseProduct(size));
  box.triangles = {{0, 1, 3}, {0, 3, 2}, {4, 6, 7}, {4, 7, 5}, {0, 4, 5}, {0, 5, 1},
                   {2, 3, 7}, {2, 7, 6}, {0, 2, 6}, {0, 6, 4}, {1, 5, 7}, {1, 7, 3}};
  return box;
}

TEST(Removed, APieceIsAsWideForAHoleAsTheSecondOfItsExtentsHoweverItLies) {
  EXPECT_NEAR(width_through_hole(turned_box({30e-3, 10e-3, 20e-3})), 20e-3, 1e-3);
  EXPECT_NEAR(width_through_hole(turned_box({30e-3, 11.5e-3, 11.5e-3})), 11.5e-3, 0.6e-3);
  EXPECT_NEAR(width_through_hole(turned_box({12e-3, 16e-3, 16e-3})), 16e-3, 0.8e-3);
}

}  // namespace
}  // namespace viscera::test
