#include <gtest/gtest.h>

#include <cmath>

#include "engine/verification/ball_and_hive.h"
#include "engine/verification/hemisphere_body.h"
#include "kernels/base/archive.h"
#include "kernels/base/random.h"
#include "kernels/hive/prony.h"

namespace viscera {
namespace {

constexpr double kRadius = kHemisphereRadius;
constexpr int kMostCells = 64;

struct Ground {
  std::unique_ptr<HemisphereBody> body;
  std::unique_ptr<WalkableSurface> surface;
  HiveBody on() const { return {surface.get(), &body->compliance(), &body->touchable()}; }
};

const Ground& ground() {
  static const Ground one = [] {
    HemisphereOptions options;
    options.nodes = 300;
    options.touchable_zone = 0.9;
    Ground made;
    made.body = HemisphereBody::prepare(options, no_progress()).value();
    made.surface =
        std::make_unique<WalkableSurface>(WalkableSurface::make(made.body->surface()).value());
    return made;
  }();
  return one;
}

struct Kind {
  HiveFormulation formulation = HiveFormulation::kSubtracted;
  HivePeriphery periphery = HivePeriphery::kBoussinesq;
  int nodes = 120;
};
const Kind kKinds[] = {{HiveFormulation::kSubtracted, HivePeriphery::kCoupled, 120},
                       {HiveFormulation::kSubtracted, HivePeriphery::kBoussinesq, 120},
                       {HiveFormulation::kSubtracted, HivePeriphery::kFixed, 120},
                       {HiveFormulation::kPaper, HivePeriphery::kBoussinesq, 28}};

HiveSettings settings_of(const Kind& kind) {
  HiveSettings settings;
  settings.material = ground().body->material();
  settings.formulation = kind.formulation;
  settings.periphery = kind.periphery;
  settings.radius = 0.4 * kRadius;
  settings.nodes = kind.nodes;
  return settings;
}

Hive hive_of(const Kind& kind) {
  return Hive::create(ground().on(), settings_of(kind), kMostCells).value();
}

SurfaceSpot spot_at(double tilt) {
  return ground().surface->nearest(kRadius * Vec3(std::sin(tilt), 0.03, std::cos(tilt)));
}

std::vector<ContactCell> cells_at(double tilt) {
  return HemisphereBody::cells(HemisphereContact::kFrictionless, 0.45, 0.1, 2, tilt);
}

// Everything that a hive answers.
void add(Hasher& hash, const HiveForce& force) {
  hash.value(force.verdict).value(force.energy).value(force.touching).value(force.factorisations);
  hash.bytes(force.force.data(), sizeof force.force);
  hash.bytes(force.moment.data(), sizeof force.moment);
}

// A tool that goes aside, and up and down unevenly; every few steps it is seated anew.
std::string live(Hive& hive, int from, int to, std::uint64_t stream = 1) {
  const Random random(7, stream);
  Hasher hash;
  for (int i = from; i < to; ++i) {
    const auto cells = cells_at(1e-3 * i);
    if (i % 3 == 0) hash.value(hive.seat(cells));
    std::vector<double> depths;
    for (std::size_t k = 0; k < cells.size(); ++k)
      depths.push_back(2e-4 * random.normal(static_cast<std::uint64_t>(i) * 100 + k));
    add(hash, hive.press(depths));
    hash.array(hive.cell_forces());
    const Vec3 moved = hive.displacement(spot_at(0.05 * i));
    hash.bytes(moved.data(), sizeof moved);
  }
  hash.value(hive.figures().lifted).value(hive.figures().smallest_pivot);
  return hash.hex();
}

TEST(HiveState, ARestoredHiveAnswersOnBitForBitWhateverItsPeriphery) {
  for (const Kind& kind : kKinds) {
    for (const int moment : {1, 4, 12, 20}) {  // seated just now, and some presses ago
      Hive first = hive_of(kind);
      ASSERT_EQ(first.build(spot_at(0.02)), HiveVerdict::kSound);
      live(first, 0, moment);
      const std::vector<std::byte> bytes = saved(first);
      const std::string whole = live(first, moment, 40);

      Hive fresh = hive_of(kind), lived = hive_of(kind);
      lived.build(spot_at(-0.2));
      live(lived, 0, 9, 2);
      for (Hive* other : {&fresh, &lived, &first}) {
        ByteReader reader(bytes);
        Hive::State state;
        read(reader, state);
        ASSERT_FALSE(reader.failed());
        ASSERT_TRUE(other->fits(state));
        other->restore(state);
        EXPECT_EQ(first_difference(other->state(), state), "") << name_of(kind.periphery);
        EXPECT_EQ(live(*other, moment, 40), whole) << name_of(kind.periphery) << ' ' << moment;
      }
    }
  }
}

TEST(HiveState, AHiveThatWasBuiltInVainIsRestoredAsOneThatIsNot) {
  const Kind kind;
  Hive hive = hive_of(kind);
  ASSERT_EQ(hive.build(spot_at(0.0)), HiveVerdict::kSound);
  live(hive, 0, 3);
  ASSERT_NE(hive.build(SurfaceSpot{}), HiveVerdict::kSound);
  Hive other = hive_of(kind);
  other.build(spot_at(0.0));
  other.restore(hive.state());
  EXPECT_EQ(other.seat(cells_at(0.0)), HiveVerdict::kNotBuilt);
}

TEST(HiveState, OneThatIsBuiltAnewKeepsNothingButWhereItsSearchStarts) {
  for (const Kind& kind : kKinds) {
    Hive used = hive_of(kind), fresh = hive_of(kind);
    const SurfaceSpot first = ground().surface->nearest(Vec3(0.0, 0.0, kRadius)),
                      second = ground().surface->nearest(Vec3(2e-3, 0.0, kRadius));
    ASSERT_EQ(used.build(first), HiveVerdict::kSound);
    ContactCell cell;
    cell.position = first.position;
    cell.normal = Vec3::UnitZ();
    cell.direction = -Vec3::UnitZ();
    cell.area = 1e-6;
    ASSERT_EQ(used.seat(std::vector<ContactCell>{cell}, {}), HiveVerdict::kSound);
    ASSERT_EQ(used.build(second), HiveVerdict::kSound);
    ASSERT_EQ(fresh.build(second), HiveVerdict::kSound);
    Hive::State anew = used.state();
    anew.pressed.active = fresh.state().pressed.active;
    EXPECT_EQ(first_difference(anew, fresh.state()), "");
  }
}

TEST(HiveState, HivesThatShareTheirMemoryOfBuildingAnswerAsOthersDo) {
  for (const Kind& kind : kKinds) {
    auto some = Hive::create_some(ground().on(), settings_of(kind), kMostCells, 3).value();
    // Built one after the other, then all in use.
    for (int i = 0; i < 3; ++i)
      ASSERT_EQ(some[static_cast<std::size_t>(i)].build(spot_at(0.01 * i)), HiveVerdict::kSound);
    for (int i = 0; i < 3; ++i) {
      Hive alone = hive_of(kind);
      alone.build(spot_at(0.01 * i));
      EXPECT_EQ(live(some[static_cast<std::size_t>(i)], 0, 12), live(alone, 0, 12))
          << name_of(kind.periphery);
    }
  }
}

TEST(HiveState, StatesOfOtherBodiesAndSizesDoNotFit) {
  Hive hive = hive_of({});
  hive.build(spot_at(0.0));
  live(hive, 0, 5);
  const Hive::State good = hive.state();
  ASSERT_TRUE(hive.fits(good));
  const auto fits = [&](auto&& spoil) {
    Hive::State state = good;
    spoil(state);
    return hive.fits(state);
  };
  EXPECT_FALSE(fits([](Hive::State& s) { s.centre.triangle = 1 << 28; }));
  EXPECT_FALSE(fits([](Hive::State& s) { s.centre.triangle = -1; }));
  EXPECT_FALSE(fits([](Hive::State& s) { s.centre.weights.x() = std::nan(""); }));
  EXPECT_FALSE(fits([](Hive::State& s) { s.built = false; }));
  EXPECT_FALSE(fits([](Hive::State& s) { s.cells.resize(kMostCells + 1); }));
  EXPECT_FALSE(fits([](Hive::State& s) { s.cells.pop_back(); }));
  EXPECT_FALSE(fits([](Hive::State& s) { s.cell_forces.clear(); }));
  EXPECT_FALSE(fits([](Hive::State& s) { s.node_forces.push_back(0.0); }));
  EXPECT_FALSE(fits([](Hive::State& s) { s.pressed.active.front() = 2; }));
  EXPECT_FALSE(fits([](Hive::State& s) { s.pressed.factored.pop_back(); }));
  EXPECT_FALSE(fits([](Hive::State& s) { s.seated = false; }));
  const Kind larger{HiveFormulation::kSubtracted, HivePeriphery::kBoussinesq, 300};
  EXPECT_FALSE(hive_of(larger).fits(good));
}

MatrixX positive_matrix(int n) {
  const Random random(11, static_cast<std::uint64_t>(n));
  MatrixX root(n, n);
  for (int i = 0; i < n * n; ++i) root.data()[i] = random.normal(static_cast<std::uint64_t>(i));
  return root * root.transpose() + 0.3 * MatrixX::Identity(n, n);
}

TEST(PressedCellsState, TheSearchGoesOnWhereItStoodWithTheFactorAtHand) {
  constexpr int kCells = 19;
  const MatrixX matrix = positive_matrix(kCells);
  const Random random(3, 4);
  const auto depths = [&](std::uint64_t tick) {
    std::vector<double> all;
    for (std::uint64_t k = 0; k < kCells; ++k)
      all.push_back(std::sin(0.1 * static_cast<double>(tick)) + 0.3 * random.normal(tick * 50 + k));
    return all;
  };
  PressedCells first(40);
  first.begin(kCells) = matrix;
  ASSERT_TRUE(first.check());
  for (std::uint64_t tick = 0; tick < 30; ++tick) {
    PressedCells second(40);
    second.begin(kCells) = matrix;
    ASSERT_TRUE(second.check());
    ASSERT_TRUE(second.fits(first.state()));
    second.restore(first.state());
    EXPECT_EQ(first_difference(first.state(), second.state()), "");
    const auto a = first.solve(depths(tick)), b = second.solve(depths(tick));
    EXPECT_EQ(a.factorisations, b.factorisations);
    EXPECT_EQ(a.touching, b.touching);
    for (std::size_t k = 0; k < kCells; ++k) EXPECT_EQ(first.forces()[k], second.forces()[k]);
  }
}

TEST(PronyState, ARelaxingForceGoesOnBitForBit) {
  const std::vector<PronyTerm> terms{{0.4, 0.05}, {0.2, 0.5}};
  PronyForce first(terms), second(terms);
  for (int tick = 0; tick < 200; ++tick) first.update(std::max(0.0, std::sin(0.1 * tick)), 1e-3);
  second.update(3.0, 1e-3);
  second.restore(first.state());
  for (int tick = 200; tick < 400; ++tick) {
    const double elastic = std::max(0.0, std::sin(0.1 * tick));
    EXPECT_EQ(first.update(elastic, 1e-3), second.update(elastic, 1e-3));
  }
  EXPECT_TRUE(second.fits(first.state()));
  EXPECT_FALSE(PronyForce(std::span(terms).first(1)).fits(first.state()));
}

constexpr double kBall = 5e-3;  // [m]

BallAndHive ball(HyperelasticModel model, int rings = 3) {
  return {{model, {5e3, 0.45}, rings, 80}, kBall};
}

// In and out with steps that are too long for some ticks to settle; from deep on, StVK tissue gives
// way. `late`: every fifth tick has no time.
std::string live(BallAndHive& tool, int from, int to, bool late) {
  Hasher hash;
  for (int i = from; i < to; ++i) {
    TimeIsUp time;
    if (late && i % 5 == 4) time.asked = [](void*) { return true; };
    if (i % 60 == 59) tool.nonlinear().release();
    const NonlinearForce force =
        tool.press(kBall * std::max(0.0, 0.3 * std::sin(0.11 * i) + 0.02 * (i % 3)), time);
    add(hash, force.hive);
    hash.value(force.stiffness).value(force.steps).value(force.by_tangent).value(force.out_of_time);
    hash.array(tool.hive().cell_forces());
  }
  return hash.hex();
}

TEST(NonlinearHiveState, GoesOnBitForBitFromAnyTickEvenWhereTheTissueGivesWay) {
  const Random random(21, 0);
  for (const HyperelasticModel model : {HyperelasticModel::kNeoHookean, HyperelasticModel::kStvk}) {
    for (const bool late : {false, true}) {
      int astray = 0;
      for (std::uint64_t draw = 0; draw < 6; ++draw) {
        const int moment = 2 + static_cast<int>(120 * random.uniform(draw));
        BallAndHive first = ball(model);
        live(first, 0, moment, late);
        const std::vector<std::byte> bytes = saved(first.nonlinear());
        const Hive::State linear = first.hive().state();
        astray += first.nonlinear().state().astray;
        const std::string whole = live(first, moment, moment + 40, late);
        BallAndHive fresh = ball(model), lived = ball(model);
        live(lived, 0, 31, !late);
        for (BallAndHive* other : {&fresh, &lived}) {
          ByteReader reader(bytes);
          NonlinearHive::State state;
          read(reader, state);
          ASSERT_TRUE(!reader.failed() && reader.at_end());
          ASSERT_TRUE(other->nonlinear().fits(state));
          other->nonlinear().restore(state);
          other->hive().restore(linear);
          EXPECT_EQ(live(*other, moment, moment + 40, late), whole)
              << name_of(model) << ' ' << late << ' ' << moment;
        }
      }
      EXPECT_TRUE(model != HyperelasticModel::kStvk || astray > 0);
    }
  }
}

TEST(NonlinearHiveState, StatesOfOtherSizesDoNotFit) {
  BallAndHive tool = ball(HyperelasticModel::kNeoHookean);
  live(tool, 0, 12, false);
  const NonlinearHive::State good = tool.nonlinear().state();
  ASSERT_TRUE(good.has_good && good.has_tangent);
  ASSERT_TRUE(tool.nonlinear().fits(good));
  EXPECT_FALSE(ball(HyperelasticModel::kNeoHookean, 2).nonlinear().fits(good));
  const auto fits = [&](auto&& spoil) {
    NonlinearHive::State state = good;
    spoil(state);
    return tool.nonlinear().fits(state);
  };
  using State = NonlinearHive::State;
  EXPECT_FALSE(fits([](State& s) { s.now.displacements.pop_back(); }));
  EXPECT_FALSE(fits([](State& s) { s.now.force_sums.resize(1); }));
  EXPECT_FALSE(fits([](State& s) { s.tangent.grid.stiffness.resize(1, 1); }));
  EXPECT_FALSE(fits([](State& s) { s.has_good = false; }));
  EXPECT_FALSE(fits([](State& s) { s.pressed[0].active.push_back(1); }));
  State astray = good;
  astray.has_good = false;
  astray.good = {};
  astray.good_place = {};
  EXPECT_TRUE(tool.nonlinear().fits(astray));
  astray.astray = true;
  EXPECT_FALSE(tool.nonlinear().fits(astray));
}

}  // namespace
}  // namespace viscera
