// Energy, determinism and what bricks exist.
#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/kernels/heat/heated_liver.h"

namespace viscera {
namespace {

TEST(HeatBook, EveryJouleIsFoundAgain) {
  for (const HeatScheme scheme : {HeatScheme::kExplicit, HeatScheme::kSuper}) {
    BioheatOptions options;
    options.scheme = scheme;
    Bioheat heat(ThermalTissue{}, options, half_space());
    burn(heat, 20.0, 2.0);
    wait(heat, 5.0);
    const HeatBook book = heat.book();
    EXPECT_GT(book.delivered, 30.0);
    EXPECT_LT(book.delivered, 40.0);  // some of the ball lies outside
    EXPECT_GT(book.latent, 0.1 * book.delivered);
    EXPECT_GT(book.vapour, 0.0);
    EXPECT_GT(book.pyrolysis, 0.0);
    EXPECT_GT(book.perfused, 0.0);
    EXPECT_GT(book.metabolic, 0.0);
    EXPECT_GT(book.gas, 0.0);
    EXPECT_GT(book.stored, 0.05 * book.delivered);
    EXPECT_LT(std::abs(book.residual()), 1e-4 * book.delivered) << book.residual();
  }
}

TEST(HeatBook, ClosesWhenTheTissueIsColdAgain) {
  BioheatOptions options;
  options.followed = 0.005;
  Bioheat heat(ThermalTissue{}, options, half_space());
  burn(heat, 3.0, 0.5);
  wait(heat, 900.0, 0.25);
  EXPECT_EQ(heat.warm_bricks(), 0u);
  const HeatBook book = heat.book();
  EXPECT_EQ(book.stored, 0.0);
  EXPECT_LT(std::abs(book.residual()), 1e-3 * book.delivered);
  EXPECT_GT(book.perfused, 0.5 * book.delivered);
  EXPECT_LT(book.boundary, 0.1 * book.delivered);
}

TEST(HeatBook, HeatDrawnFromAVoxelIsTheInstruments) {
  Bioheat heat(ThermalTissue{}, BioheatOptions{});
  set_excess(heat, Box(Vec3::Zero(), Vec3::Constant(1e-3)), [](const Vec3&) { return 20.0; });
  heat.begin_book();
  const double capacity = heat.voxel_capacity(heat.bricks().brick(0), 100);
  heat.draw_from_voxel(heat.bricks().brick(0), 100, 5.0 * capacity);
  EXPECT_NEAR(heat.bricks().brick(0).warm->excess[100], 15.0, 1e-4);
  EXPECT_NEAR(heat.book().instrument, 5.0 * capacity, 1e-12);
  EXPECT_NEAR(heat.book().residual(), 0.0, 1e-6 * capacity * 5.0);
}

/// Bricks about the burn of an organ from which a plate across x is gone, between 1 and 1.6 mm.
std::vector<ShapedBrick> less_a_plate(double voxel) {
  const SignedDistance left = [](const Vec3& p) {
    return std::max(half_space()(p), 0.3e-3 - std::abs(p.x() - 1.3e-3));
  };
  std::vector<ShapedBrick> shapes;
  for (int x = -3; x < 3; ++x)
    for (int y = -3; y < 3; ++y)
      for (int z = -3; z < 1; ++z) {
        const BrickIndex index(x, y, z);
        shapes.push_back({index, make_geometry(index, voxel, left)});
      }
  return shapes;
}

/// The greatest excess where x is over `from`, either sign [K].
double excess_beyond(const Bioheat& heat, double from) {
  double most = 0.0;
  for (std::size_t b = 0; b < heat.bricks().count(); ++b) {
    const HeatBrick& brick = heat.bricks().brick(b);
    for (int v = 0; brick.warm && v < BrickField::kVoxels; ++v)
      if (heat.bricks().centre(brick, v).x() > from)
        most = std::max(most, std::abs(static_cast<double>(brick.warm->excess[v])));
  }
  return most;
}

TEST(HeatBook, TissueThatIsTakenAwayTakesItsWarmthAlong) {
  BioheatOptions options;
  Bioheat heat(ThermalTissue{}, options, half_space());
  burn(heat, 20.0, 1.0);
  const double before = heat.book().stored;
  heat.take_shapes(less_a_plate(options.voxel));
  const HeatBook book = heat.book();
  EXPECT_GT(book.removed, 0.02 * before);
  EXPECT_NEAR(book.stored + book.removed, before, 1e-12 * before);
  wait(heat, 2.0);
  EXPECT_LT(std::abs(heat.book().residual()), 1e-4 * heat.book().delivered);
}

TEST(HeatBook, HeatDoesNotCrossWhereTissueIsGone) {
  BioheatOptions options;
  Bioheat whole(ThermalTissue{}, options, half_space()),
      cut(ThermalTissue{}, options, half_space());
  cut.take_shapes(less_a_plate(options.voxel));
  for (Bioheat* heat : {&whole, &cut}) {
    set_excess(*heat, Box(Vec3(-2e-3, -2e-3, -3e-3), Vec3(0.9e-3, 2e-3, -0.2e-3)),
               [](const Vec3& at) { return at.x() < 0.9e-3 ? 30.0 : 0.0; });
    wait(*heat, 4.0);
  }
  EXPECT_GT(excess_beyond(whole, 1.7e-3), 5.0);
  EXPECT_EQ(excess_beyond(cut, 1.7e-3), 0.0);
}

TEST(HeatBook, AnOrganThatIsWholeAgainIsAsItWasBefore) {
  BioheatOptions options;
  Bioheat heat(ThermalTissue{}, options, half_space());
  burn(heat, 5.0, 0.3);
  const double before = tissue_volume(heat);
  heat.take_shapes(less_a_plate(options.voxel));
  EXPECT_LT(tissue_volume(heat), 0.95 * before);
  heat.take_shapes({});
  EXPECT_EQ(tissue_volume(heat), before);
}

TEST(HeatBook, AnyNumberOfThreadsGivesTheSameBits) {
  const auto run = [](int threads) {
    const oneapi::tbb::global_control limit(oneapi::tbb::global_control::max_allowed_parallelism,
                                            threads);
    Bioheat heat(ThermalTissue{}, BioheatOptions{}, half_space());
    burn(heat, 20.0, 0.7);
    wait(heat, 0.5);
    return state_of(heat);
  };
  const std::string one = run(1);
  EXPECT_EQ(run(2), one);
  EXPECT_EQ(run(5), one);
}

TEST(HeatBook, AnOrganThatNobodyHeatsCostsNothing) {
  int asked = 0;
  Bioheat heat(ThermalTissue{}, BioheatOptions{}, [&](const Vec3& p) {
    ++asked;
    return p.norm() - 0.1;
  });
  wait(heat, 10.0);
  EXPECT_EQ(heat.bricks().count(), 0u);
  EXPECT_EQ(asked, 0);
  EXPECT_EQ(heat.passes_of_last_step(), 0);
}

TEST(HeatBook, WarmTissueIsForgottenAndHarmedTissueKept) {
  Bioheat warm(ThermalTissue{}, BioheatOptions{}, half_space());
  burn(warm, 0.02, 0.5);
  EXPECT_GT(warm.bricks().count(), 0u);
  wait(warm, 600.0, 0.25);
  EXPECT_EQ(warm.bricks().count(), 0u);

  Bioheat burnt(ThermalTissue{}, BioheatOptions{}, half_space());
  burn(burnt, 20.0, 0.5);
  const double coagulation = burnt.bricks().coagulation_at({0, 0, -1});
  EXPECT_GT(coagulation, 1.0);
  wait(burnt, 900.0, 0.25);
  EXPECT_EQ(burnt.warm_bricks(), 0u);
  EXPECT_GT(burnt.bricks().count(), 0u);
  EXPECT_GE(burnt.bricks().coagulation_at({0, 0, -1}), coagulation);
  EXPECT_GT(burnt.coagulated_volume(), 1e-9);
  EXPECT_GT(burnt.dead_volume(), burnt.coagulated_volume());
}

TEST(HeatBook, HeatIsFollowedAcrossBricks) {
  Bioheat heat(plain_tissue(), BioheatOptions{});
  burn(heat, 2.0, 0.5);
  const std::size_t at_first = heat.warm_bricks();
  wait(heat, 20.0, 0.1);
  EXPECT_GT(heat.warm_bricks(), at_first);
  EXPECT_LT(heat.book().boundary, 0.01 * heat.book().delivered);
}

TEST(HeatBook, ManyBricksAtOnceAreThoseOneByOne) {
  HeatBricks many(0.5e-3, half_space(), 100), single(0.5e-3, half_space(), 100);
  std::vector<BrickIndex> indices;
  for (int z = -1; z <= 1; ++z)
    for (int x = -2; x <= 2; ++x) indices.emplace_back(x, 0, z);
  const std::vector<HeatBrick*> made = many.warm_up(indices);
  for (const BrickIndex& index : indices) single.warm_up(index);
  ASSERT_EQ(many.count(), 10u);  // above the surface nothing
  ASSERT_EQ(made.size(), many.count());
  ASSERT_EQ(single.count(), many.count());
  for (std::size_t b = 0; b < many.count(); ++b) {
    EXPECT_EQ(made[b], &many.brick(b));
    EXPECT_EQ(many.brick(b).index, single.brick(b).index);
    EXPECT_EQ(many.brick(b).geometry->fraction, single.brick(b).geometry->fraction);
  }
  HeatBricks few(0.5e-3, half_space(), 3);
  EXPECT_EQ(few.warm_up(indices).size(), 3u);
  EXPECT_TRUE(few.overflowed());
}

TEST(HeatBook, BeyondItsBricksItSaysSoAndGoesOn) {
  BioheatOptions options;
  options.most_bricks = 3;
  Bioheat heat(plain_tissue(), options);
  burn(heat, 2.0, 0.5);
  wait(heat, 5.0);
  EXPECT_EQ(heat.bricks().count(), 3u);
  EXPECT_TRUE(heat.bricks().overflowed());
  EXPECT_GT(heat.book().boundary, 0.0);
  EXPECT_LT(std::abs(heat.book().residual()), 1e-4 * heat.book().delivered);
}

TEST(HeatBook, MemoryIsToldBeforehand) {
  const double box = 40e-3;
  const std::size_t coarse = HeatBricks::bytes_for(Vec3::Constant(box), 0.5e-3);
  const std::size_t fine = HeatBricks::bytes_for(Vec3::Constant(box), 0.05e-3);
  EXPECT_EQ(fine, 1000 * coarse);
  Bioheat heat(plain_tissue(), BioheatOptions{}, half_space());
  burn(heat, 2.0, 0.1);
  EXPECT_GT(heat.bricks().memory_bytes(), heat.bricks().count() * 8 * 2048);
}

}  // namespace
}  // namespace viscera
