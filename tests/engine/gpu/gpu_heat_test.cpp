#include "engine/gpu/gpu_heat.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <stdexcept>

#include "engine/gpu/egl_context.h"
#include "engine/verification/heat_case.h"
#include "engine/verification/standard_burn.h"
#include "tests/kernels/heat/heated_liver.h"

namespace viscera {
namespace {

HeatDifference compare(const Bioheat& a, const Bioheat& b) {
  const HeatDifference difference = heat_difference(a, b);
  EXPECT_TRUE(difference.same_bricks);
  return difference;
}

/// Entries [J] over what was delivered.
double book_difference(const HeatBook& a, const HeatBook& b) {
  double most = 0.0;
  for (const auto entry :
       {&HeatBook::delivered, &HeatBook::metabolic, &HeatBook::stored, &HeatBook::latent,
        &HeatBook::vapour, &HeatBook::pyrolysis, &HeatBook::perfused, &HeatBook::gas,
        &HeatBook::instrument, &HeatBook::boundary, &HeatBook::removed})
    most = std::max(most, std::abs(a.*entry - b.*entry));
  return most / std::max(a.delivered, 1e-12);
}

class GpuHeatTest : public testing::Test {
 protected:
  void SetUp() override {
    auto made = EglContext::create();
    if (!made) GTEST_SKIP() << made.error().text();
    context_ = *std::move(made);
    RecordProperty("device", context_->device());
    first_ = create();
  }
  static std::shared_ptr<GpuHeat> create(GpuLimits limits = GpuLimits::of_device(),
                                         std::shared_ptr<EglContext> context = nullptr) {
    auto made = GpuHeat::create(limits, std::move(context));
    if (!made) throw std::runtime_error(made.error().text());
    return *std::move(made);
  }
  /// A device for one organ; compiling once is enough.
  std::shared_ptr<GpuHeat> device() { return first_->another(); }

  /// The same done to an organ on the CPU and to one on the GPU.
  struct Twins {
    Bioheat cpu, gpu;
    HeatDifference difference() const { return compare(cpu, gpu); }
  };
  Twins twins(const ThermalTissue& tissue, const BioheatOptions& options,
              const SignedDistance& distance, const std::function<void(Bioheat&)>& what) {
    Twins made{Bioheat(tissue, options, distance), Bioheat(tissue, options, distance)};
    made.gpu.compute_on(device());
    what(made.cpu);
    what(made.gpu);
    EXPECT_EQ(made.gpu.device_failure(), "");
    EXPECT_NE(made.gpu.device(), nullptr);
    return made;
  }
  void record(const char* name, double value) {
    RecordProperty(name, std::to_string(1e6 * value) + "e-6");
  }

  std::unique_ptr<EglContext> context_;
  std::shared_ptr<GpuHeat> first_;
};

TEST_F(GpuHeatTest, ConductionMatchesTheCpuInExplicitAndInSuperSteps) {
  for (const HeatScheme scheme : {HeatScheme::kExplicit, HeatScheme::kSuper}) {
    SCOPED_TRACE(scheme == HeatScheme::kExplicit ? "explicit" : "super");
    BioheatOptions options;
    options.scheme = scheme;
    options.cooling.coefficient = 0.0;
    options.voxel = 0.25e-3;
    const Twins pair = twins(plain_tissue(), options, half_space(), [](Bioheat& heat) {
      set_excess(heat, Box(Vec3::Constant(-2e-3), Vec3::Constant(2e-3)), [](const Vec3& p) {
        return 30.0 * std::exp(-p.squaredNorm() / 1e-6) + 3.0 * std::sin(4e3 * p.x());
      });
      for (int step = 0; step < 20; ++step) heat.step(6.0 * kPictureTime);
    });
    EXPECT_GT(pair.cpu.passes_of_last_step(), 1);
    EXPECT_EQ(pair.gpu.passes_of_last_step(), pair.cpu.passes_of_last_step());
    EXPECT_GT(pair.cpu.warm_bricks(), 40u);
    record(scheme == HeatScheme::kExplicit ? "excess" : "super_excess", pair.difference().excess);
    EXPECT_LT(pair.difference().excess, 2e-6);
    EXPECT_EQ(pair.difference().water, 0.0);
  }
}

TEST_F(GpuHeatTest, BloodAndMetabolismMatchTheCpuAndStopAsTissueDies) {
  BioheatOptions options;
  options.cooling.coefficient = 0.0;
  const Twins pair = twins(ThermalTissue{}, options, half_space(), [](Bioheat& heat) {
    burn(heat, 1.5, 1.5);
    wait(heat, 4.0);
  });
  const HeatBook cpu = pair.cpu.book(), gpu = pair.gpu.book();
  EXPECT_GT(cpu.perfused, 0.01 * cpu.delivered);
  EXPECT_NEAR(gpu.perfused, cpu.perfused, 1e-5 * cpu.perfused);
  EXPECT_NEAR(gpu.metabolic, cpu.metabolic, 1e-5 * cpu.metabolic);
  EXPECT_GT(pair.cpu.coagulated_volume(), 0.0);
  EXPECT_LT(pair.difference().excess, 5e-6);
  EXPECT_LT(pair.difference().damage, 2e-4);
}

TEST_F(GpuHeatTest, SurfacesCoolAndDryAsOnTheCpu) {
  for (const bool evaporates : {false, true}) {
    BioheatOptions options;
    options.cooling.evaporates = evaporates;
    options.cooling.coefficient = 25.0;
    // A slanting surface, cut voxels of every kind.
    const Vec3 normal = Vec3(0.3, -0.2, 1.0).normalized();
    const Twins pair = twins(
        plain_tissue(), options, [normal](const Vec3& p) { return p.dot(normal) - 0.3e-3; },
        [](Bioheat& heat) {
          set_excess(heat, Box(Vec3::Constant(-3e-3), Vec3::Constant(3e-3)),
                     [](const Vec3&) { return 55.0; });
          heat.begin_book();
          wait(heat, 1.0);
        });
    const HeatBook cpu = pair.cpu.book(), gpu = pair.gpu.book();
    EXPECT_GT(cpu.gas, 0.0);
    EXPECT_EQ(cpu.latent > cpu.gas, evaporates);
    EXPECT_NEAR(gpu.gas, cpu.gas, 1e-5 * cpu.gas);
    EXPECT_NEAR(gpu.latent, cpu.latent, 1e-5 * cpu.latent);
    const HeatDifference difference = pair.difference();
    record(evaporates ? "excess_wet" : "excess_dry", difference.excess);
    EXPECT_LT(difference.excess, 1e-5);
    EXPECT_LT(difference.water, 2e-5);
  }
}

TEST_F(GpuHeatTest, ABoilingFrontIsWhereTheCpuAndStefanHaveIt) {
  const ThermalTissue tissue = plain_tissue();
  const double h = 0.1e-3, wall = 363.0, dt = 4e-3, seconds = 3.0, edge = HeatBricks::kEdge * h;
  BioheatOptions options;
  options.voxel = h;
  options.cooling.coefficient = 0.0;
  options.followed = 0.01;
  const Twins pair = twins(
      tissue, options,
      [edge](const Vec3& p) {
        return std::max({-p.x(), -p.y(), p.y() - edge, -p.z(), p.z() - edge});
      },
      [&](Bioheat& heat) {
        HeatBrick* first = heat.bricks().warm_up({0, 0, 0});
        for (int i = 0; i < BrickField::kVoxels; i += 8) first->water[i] = 0.0f;
        for (int step = 0; step < std::lround(seconds / dt); ++step) {
          hold_layer(heat, 0, 0, wall);
          heat.step(dt);
        }
      });
  const BoilingFront exact(tissue, wall, options.body);
  double front = 0.5 * h;
  for (int x = 1; x < 60; ++x) front += (1.0 - pair.gpu.bricks().water_at({x, 3, 3})) * h;
  EXPECT_NEAR(front, exact.position(seconds), 0.02 * exact.position(seconds));
  const HeatDifference difference = pair.difference();
  record("excess", difference.excess);
  record("water", difference.water);
  // A voxel's drying goes with what is left of two fluxes that almost cancel.
  EXPECT_LT(difference.excess, 1e-4);
  EXPECT_LT(difference.water, 1e-3);
}

TEST_F(GpuHeatTest, DryTissueCharsAsOnTheCpu) {
  ThermalTissue tissue = plain_tissue();
  tissue.pyrolysis = ThermalTissue{}.pyrolysis;
  const Twins pair = twins(tissue, BioheatOptions{}, half_space(), [](Bioheat& heat) {
    HeatBrick* brick = heat.bricks().warm_up({0, 0, -1});
    brick->water.fill(0.0f);
    for (int i = 0; i < BrickField::kVoxels; ++i)
      brick->warm->excess[i] = 150.0f + 0.3f * static_cast<float>(i);
    wait(heat, 1.0);
  });
  EXPECT_GT(pair.cpu.vaporised_tissue(), 0.0);
  EXPECT_NEAR(pair.gpu.vaporised_tissue(), pair.cpu.vaporised_tissue(),
              1e-4 * pair.cpu.vaporised_tissue());
  EXPECT_NEAR(pair.gpu.book().pyrolysis, pair.cpu.book().pyrolysis,
              1e-4 * pair.cpu.book().pyrolysis);
  const HeatDifference difference = pair.difference();
  record("charred", difference.charred);
  EXPECT_LT(difference.charred, 1e-4);
  EXPECT_LT(difference.excess, 1e-4);
}

TEST_F(GpuHeatTest, DamageMatchesTheCpuFromSlowToInstant) {
  ThermalTissue tissue;
  tissue.perfusion = 0.0;
  const Twins pair = twins(tissue, BioheatOptions{}, {}, [](Bioheat& heat) {
    // 40 to 95 C, from brick to brick.
    set_excess(heat, Box(Vec3::Zero(), Vec3(15e-3, 3e-3, 3e-3)),
               [](const Vec3& p) { return 3.0 + 58.0 * p.x() / 16e-3; });
    wait(heat, 0.5);
  });
  const double slow = pair.cpu.bricks().dose_at({2, 2, 2});
  EXPECT_GT(slow, 0.0);
  EXPECT_LT(slow, 1e-2);
  EXPECT_GT(pair.cpu.bricks().coagulation_at({30, 2, 2}), 100.0);
  record("damage", pair.difference().damage);
  EXPECT_LT(pair.difference().damage, 1e-4);
}

TEST_F(GpuHeatTest, AWholeBurnMatchesTheCpuInFieldsBookAndVapour) {
  for (const HeatScheme scheme : {HeatScheme::kFewest, HeatScheme::kSuper}) {
    SCOPED_TRACE(scheme == HeatScheme::kFewest ? "fewest" : "super");
    BioheatOptions options;
    options.scheme = scheme;
    const Twins pair =
        twins(ThermalTissue{}, options, half_space(), [](Bioheat& heat) { burn(heat, 20.0, 1.0); });
    ASSERT_FALSE(pair.cpu.vapour().empty());
    const auto total = [](const Bioheat& heat) {
      Vec3 moment = Vec3::Zero();
      double water = 0.0, warmth = 0.0;
      for (const Vapour& one : heat.vapour()) {
        water += one.water + one.tissue;
        moment += (one.water + one.tissue) * one.position;
        warmth += (one.water + one.tissue) * one.temperature;
      }
      return std::tuple(water, Vec3(moment / water), warmth / water);
    };
    const auto [water, place, kelvin] = total(pair.cpu);
    const auto [gpu_water, gpu_place, gpu_kelvin] = total(pair.gpu);
    EXPECT_NEAR(gpu_water, water, 1e-2 * water);
    EXPECT_LT((gpu_place - place).norm(), 1e-2 * options.voxel);
    EXPECT_NEAR(gpu_kelvin, kelvin, 0.01 * kelvin);
    EXPECT_NEAR(pair.gpu.vaporised_water(), pair.cpu.vaporised_water(),
                1e-4 * pair.cpu.vaporised_water());
    const HeatDifference difference = pair.difference();
    const char* names[2][4] = {{"excess", "water", "charred", "damage"},
                               {"super_excess", "super_water", "super_charred", "super_damage"}};
    const auto& name = names[scheme == HeatScheme::kSuper];
    record(name[0], difference.excess);
    record(name[1], difference.water);
    record(name[2], difference.charred);
    record(name[3], difference.damage);
    // Where water boils and solids char a rounding decides in which step a voxel is dry.
    EXPECT_LT(difference.excess, 1e-3);
    EXPECT_LT(difference.water, 1e-3);
    EXPECT_LT(difference.charred, 1e-3);
    EXPECT_LT(difference.damage, 5e-3);
    record("book", book_difference(pair.cpu.book(), pair.gpu.book()));
    EXPECT_LT(book_difference(pair.cpu.book(), pair.gpu.book()), 1e-4);
  }
}

TEST_F(GpuHeatTest, StepsOfManySubstepsSumUpAsOnTheCpu) {
  BioheatOptions options;
  options.scheme = HeatScheme::kExplicit;
  const Twins pair = twins(ThermalTissue{}, options, half_space(), [](Bioheat& heat) {
    for (int step = 0; step < 4; ++step) {
      heat_gaussian(heat, Vec3(0.4e-3, 0.1e-3, -0.5e-3), 0.6e-3, 20.0);
      heat.step(0.25);
    }
  });
  EXPECT_GT(pair.cpu.passes_of_last_step(), 5);
  const HeatBook cpu = pair.cpu.book(), gpu = pair.gpu.book();
  EXPECT_GT(cpu.pyrolysis, 0.0);
  EXPECT_NEAR(gpu.latent, cpu.latent, 1e-4 * cpu.latent);
  EXPECT_NEAR(gpu.pyrolysis, cpu.pyrolysis, 1e-3 * cpu.pyrolysis);
  EXPECT_NEAR(gpu.gas, cpu.gas, 1e-4 * cpu.gas);
  EXPECT_LT(std::abs(gpu.residual()), 1e-4 * gpu.delivered);
  EXPECT_NEAR(pair.gpu.vaporised_water(), pair.cpu.vaporised_water(),
              1e-4 * pair.cpu.vaporised_water());
  EXPECT_NEAR(pair.gpu.vaporised_tissue(), pair.cpu.vaporised_tissue(),
              1e-3 * pair.cpu.vaporised_tissue());
  const auto last = [](const Bioheat& heat) {
    double mass = 0.0;
    for (const Vapour& one : heat.vapour()) mass += one.water + one.tissue;
    return mass;
  };
  EXPECT_NEAR(last(pair.gpu), last(pair.cpu), 1e-3 * last(pair.cpu));
  EXPECT_LT(pair.gpu.vapour().size(), pair.cpu.vapour().size()) << "a voxel once a step";
}

TEST_F(GpuHeatTest, EveryJouleIsFoundAgain) {
  for (const HeatScheme scheme : {HeatScheme::kExplicit, HeatScheme::kSuper}) {
    BioheatOptions options;
    options.scheme = scheme;
    Bioheat heat(ThermalTissue{}, options, half_space());
    heat.compute_on(device());
    burn(heat, 20.0, 1.0);
    wait(heat, 1.0);
    EXPECT_EQ(heat.device_failure(), "");
    const HeatBook book = heat.book();
    EXPECT_GT(book.latent, 0.1 * book.delivered);
    EXPECT_GT(book.pyrolysis, 0.0);
    EXPECT_GT(book.gas, 0.0);
    record("residual", std::abs(book.residual()) / book.delivered);
    EXPECT_LT(std::abs(book.residual()), 1e-4 * book.delivered) << book.residual();
  }
}

TEST_F(GpuHeatTest, TheStandardBurnHasTheSameLesion) {
  // The electrode reads temperature and water, and draws heat into its metal, in every step.
  const auto lesion = [&](std::shared_ptr<HeatPasses> passes, HeatReturn fields) {
    BioheatOptions options;
    Bioheat heat(ThermalTissue{}, options, [](const Vec3& p) { return p.z(); });
    heat.compute_on(std::move(passes), fields);
    ElectrodeTip tip(Electrode{.tip_radius = 1e-3});
    const ElectrodeContact contact{
        .point = Vec3::Zero(), .outward = Vec3::UnitZ(), .depth = 0.5e-3};
    for (int step = 0; step < 60; ++step) {
      heat.fetch();
      tip.energise(heat, CurrentMode::kBlend, 30.0, contact, contact, kPictureTime);
      heat.step(kPictureTime);
    }
    heat.fetch();
    EXPECT_EQ(heat.device_failure(), "");
    EXPECT_LT(std::abs(heat.book().residual()), 1e-4 * heat.book().delivered);
    EXPECT_GT(heat.book().instrument, 0.0);
    return lesion_at(heat, Vec3::Zero(), Vec3::UnitZ());
  };
  const Lesion cpu = lesion(nullptr, HeatReturn::kEveryStep);
  EXPECT_GT(cpu.depth, 1e-3);
  const Lesion gpu = lesion(device(), HeatReturn::kEveryStep);
  const Lesion asked = lesion(device(), HeatReturn::kWhenAsked);
  record("depth", std::abs(gpu.depth - cpu.depth) / cpu.depth);
  EXPECT_NEAR(gpu.depth, cpu.depth, 0.01 * cpu.depth);
  EXPECT_NEAR(gpu.width, cpu.width, 0.01 * cpu.width);
  EXPECT_EQ(asked.depth, gpu.depth);
  EXPECT_EQ(asked.width, gpu.width);
}

TEST_F(GpuHeatTest, WhereTissueIsCutAwayHeatGoesOnAsOnTheCpu) {
  BioheatOptions options;
  const SignedDistance left = [](const Vec3& p) {
    return std::max(half_space()(p), 0.3e-3 - std::abs(p.x() - 1.3e-3));
  };
  const Twins pair = twins(ThermalTissue{}, options, half_space(), [&](Bioheat& heat) {
    burn(heat, 5.0, 0.5);
    std::vector<ShapedBrick> shapes;
    for (int x = -2; x < 2; ++x)
      for (int y = -2; y < 2; ++y)
        for (int z = -2; z < 1; ++z)
          shapes.push_back({{x, y, z}, make_geometry({x, y, z}, options.voxel, left)});
    heat.take_shapes(std::move(shapes));
    burn(heat, 2.0, 0.5);
    wait(heat, 1.0);
  });
  EXPECT_GT(pair.cpu.book().removed, 0.0);
  EXPECT_LT(book_difference(pair.gpu.book(), pair.cpu.book()), 2e-5);
  EXPECT_LT(pair.difference().excess, 2e-5);
}

TEST_F(GpuHeatTest, WhatACutTakesOffHasNoBloodAsOnTheCpu) {
  BioheatOptions options;
  const double plate = 1.3e-3;
  const SignedDistance left = [plate](const Vec3& p) {
    return std::max(half_space()(p), 0.3e-3 - std::abs(p.x() - plate));
  };
  std::vector<float> perfused;
  for (int v = 0; v < BrickField::kVoxels; ++v)
    perfused.push_back((v % BrickField::kEdge + 0.5) * options.voxel > plate ? 0.0f : 1.0f);
  const auto warm = [](Bioheat& heat, double seconds) {
    for (int step = 0; step < std::lround(seconds / kPictureTime); ++step) {
      for (const double x : {0.4e-3, 4e-3})
        heat_gaussian(heat, Vec3(x, 0.1e-3, -0.5e-3), 0.6e-3, 0.3);
      heat.step(kPictureTime);
    }
  };
  double perfused_before[2] = {}, perfused_after[2] = {};
  for (const bool severed : {false, true}) {
    const Twins pair = twins(ThermalTissue{}, options, half_space(), [&](Bioheat& heat) {
      // The device has the bricks before the cut; it has to take them anew.
      warm(heat, 0.5);
      std::vector<ShapedBrick> shapes;
      for (int x = -2; x < 3; ++x)
        for (int y = -2; y < 2; ++y)
          for (int z = -2; z < 1; ++z) {
            ShapedBrick& shape = shapes.emplace_back();
            shape.index = {x, y, z};
            if (severed && x > 0) continue;
            shape.geometry = make_geometry(shape.index, options.voxel, left);
            if (severed && x == 0) shape.geometry = with_blood(shape.geometry, perfused);
          }
      heat.take_shapes(std::move(shapes));
      perfused_before[severed] = heat.book().perfused;
      warm(heat, 0.5);
      wait(heat, 4.0);
      perfused_after[severed] = heat.book().perfused;
    });
    const HeatBook cpu = pair.cpu.book(), gpu = pair.gpu.book();
    EXPECT_NEAR(gpu.perfused, cpu.perfused, 1e-5 * cpu.perfused);
    EXPECT_NEAR(gpu.metabolic, cpu.metabolic, 1e-5 * cpu.metabolic);
    EXPECT_LT(book_difference(gpu, cpu), 2e-5);
    EXPECT_LT(pair.difference().excess, 2e-5);
  }
  // On either side about as much is warm.
  EXPECT_LT(perfused_after[1] - perfused_before[1],
            0.65 * (perfused_after[0] - perfused_before[0]));
}

TEST_F(GpuHeatTest, TheSameRunGivesTheSameBits) {
  const auto run = [&](std::shared_ptr<GpuHeat> passes, HeatReturn fields) {
    Bioheat heat(ThermalTissue{}, BioheatOptions{}, half_space());
    heat.compute_on(std::move(passes), fields);
    burn(heat, 20.0, 0.7);
    heat.fetch();
    EXPECT_EQ(heat.device_failure(), "");
    return state_of(heat);
  };
  const std::string one = run(device(), HeatReturn::kEveryStep);
  EXPECT_EQ(run(create(), HeatReturn::kEveryStep), one);
  EXPECT_EQ(run(device(), HeatReturn::kWhenAsked), one) << "when fields come doesn't matter";
}

TEST_F(GpuHeatTest, FieldsThatNobodyAsksForStayOnTheDevice) {
  const std::shared_ptr<GpuHeat> every = device(), asked = device();
  Bioheat first(ThermalTissue{}, BioheatOptions{}, half_space());
  Bioheat second(ThermalTissue{}, BioheatOptions{}, half_space());
  first.compute_on(every);
  second.compute_on(asked, HeatReturn::kWhenAsked);
  for (Bioheat* heat : {&first, &second}) burn(*heat, 5.0, 0.3);
  const std::size_t bricks = first.warm_bricks();
  EXPECT_EQ(second.warm_bricks(), bricks);
  EXPECT_EQ(asked->fetched_bytes(), 0u);
  EXPECT_EQ(asked->uploaded_bricks(), bricks) << "each once";
  EXPECT_EQ(every->uploaded_bricks(), bricks);
  EXPECT_GE(every->fetched_bytes(), 18 * sizeof(HeatBrick::Values));
  EXPECT_EQ(first.greatest_excess(), second.greatest_excess());
  // The book is the device's sums until the fields come.
  EXPECT_NEAR(second.book().stored, first.book().stored, 1e-5 * first.book().stored);
  second.fetch();
  EXPECT_GT(asked->fetched_bytes(), 0u);
  EXPECT_LE(asked->fetched_bytes(), 6 * bricks * sizeof(HeatBrick::Values));
  EXPECT_EQ(state_of(first), state_of(second));
  const std::size_t fetched = asked->fetched_bytes();
  second.fetch();
  EXPECT_EQ(asked->fetched_bytes(), fetched) << "nothing is new";
}

TEST_F(GpuHeatTest, BricksComeAndGoAsOnTheCpuAndLeaveTheirPlace) {
  ThermalTissue tissue;
  BioheatOptions options;
  options.followed = 0.2;
  const std::shared_ptr<GpuHeat> passes = device();
  Bioheat cpu(tissue, options, half_space()), gpu(tissue, options, half_space());
  gpu.compute_on(passes, HeatReturn::kWhenAsked);
  std::size_t most = 0;
  std::size_t bytes = 0;
  for (int place = 0; place < 3; ++place) {
    for (Bioheat* heat : {&cpu, &gpu}) {
      for (int step = 0; step < 20; ++step) {
        heat_gaussian(*heat, Vec3(20e-3 * place, 0.0, -0.5e-3), 0.6e-3, 3.0);
        heat->step(kPictureTime);
      }
      wait(*heat, 300.0, 1.5);
    }
    most = std::max(most, gpu.bricks().count());
    EXPECT_EQ(gpu.warm_bricks(), 0u);
    EXPECT_EQ(gpu.bricks().count(), cpu.bricks().count()) << "harmed ones stay";
    if (place == 0) bytes = passes->bytes();
  }
  EXPECT_GT(most, 3u);
  EXPECT_EQ(passes->bytes(), bytes) << "freed places are used again";
  gpu.fetch();
  const HeatDifference difference = compare(cpu, gpu);
  EXPECT_LT(difference.damage, 1e-3);
  EXPECT_LT(book_difference(cpu.book(), gpu.book()), 1e-4);
  EXPECT_LT(std::abs(gpu.book().residual()), 1e-3 * gpu.book().delivered);
}

TEST_F(GpuHeatTest, BeyondItsBricksHeatLeavesByTheSideAsOnTheCpu) {
  BioheatOptions options;
  options.most_bricks = 3;
  const Twins pair = twins(plain_tissue(), options, {}, [](Bioheat& heat) {
    burn(heat, 2.0, 0.5);
    wait(heat, 2.0);
  });
  EXPECT_TRUE(pair.gpu.bricks().overflowed());
  EXPECT_GT(pair.cpu.book().boundary, 0.01 * pair.cpu.book().delivered);
  EXPECT_NEAR(pair.gpu.book().boundary, pair.cpu.book().boundary, 1e-5 * pair.cpu.book().boundary);
  EXPECT_LT(pair.difference().excess, 1e-5);
}

TEST_F(GpuHeatTest, ManyBricksMakeTheBuffersGrowAndKeepWhatIsInThem) {
  const Twins pair = twins(plain_tissue(), BioheatOptions{}, half_space(), [](Bioheat& heat) {
    for (const double edge : {4e-3, 12e-3, 20e-3}) {
      set_excess(heat, Box(Vec3::Constant(-edge), Vec3::Constant(edge)),
                 [](const Vec3& p) { return 20.0 + 5.0 * std::sin(1e3 * p.x() + 7e2 * p.y()); });
      wait(heat, 2 * kPictureTime);
    }
  });
  EXPECT_GT(pair.gpu.warm_bricks(), 500u);
  EXPECT_LT(pair.difference().excess, 2e-6);
}

TEST_F(GpuHeatTest, GroupsInSeveralRowsAreTheSame) {
  GpuLimits limits = GpuLimits::of_device();
  limits.groups_per_axis = 5;
  const auto run = [&](std::shared_ptr<GpuHeat> passes) {
    Bioheat heat(ThermalTissue{}, BioheatOptions{}, half_space());
    heat.compute_on(std::move(passes));
    burn(heat, 20.0, 0.2);
    EXPECT_EQ(heat.device_failure(), "");
    return state_of(heat);
  };
  EXPECT_EQ(run(create(limits)), run(device()));
}

TEST_F(GpuHeatTest, OrgansShareKernelsAndDontMeet) {
  const auto apart = [&](double power) {
    Bioheat heat(ThermalTissue{}, BioheatOptions{}, half_space());
    heat.compute_on(create());
    burn(heat, power, 0.2);
    return state_of(heat);
  };
  Bioheat weak(ThermalTissue{}, BioheatOptions{}, half_space());
  Bioheat strong(ThermalTissue{}, BioheatOptions{}, half_space());
  weak.compute_on(first_->another());
  strong.compute_on(first_->another());
  for (int step = 0; step < 12; ++step) {
    burn(weak, 3.0, kPictureTime);
    burn(strong, 20.0, kPictureTime);
  }
  EXPECT_EQ(state_of(weak), apart(3.0));
  EXPECT_EQ(state_of(strong), apart(20.0));
}

TEST_F(GpuHeatTest, WhatIsTooLargeForTheDeviceRunsOnTheCpuAndSaysWhy) {
  GpuLimits limits = GpuLimits::of_device();
  limits.block_bytes = 200 * BrickField::kVoxels * 4 * sizeof(float);
  Bioheat cpu(plain_tissue(), BioheatOptions{}), gpu(plain_tissue(), BioheatOptions{});
  gpu.compute_on(create(limits));
  const auto warm = [](Bioheat& heat, double edge) {
    set_excess(heat, Box(Vec3::Constant(-edge), Vec3::Constant(edge)),
               [](const Vec3& p) { return 20.0 + 5.0 * std::sin(1e3 * p.x()); });
    heat.step(kPictureTime);
  };
  warm(gpu, 3e-3);
  EXPECT_NE(gpu.device(), nullptr);
  warm(gpu, 12e-3);
  EXPECT_EQ(gpu.device(), nullptr);
  EXPECT_NE(gpu.device_failure().find("of bricks would make a storage buffer of"),
            std::string::npos)
      << gpu.device_failure();
  warm(cpu, 3e-3);
  warm(cpu, 12e-3);
  EXPECT_LT(compare(cpu, gpu).excess, 1e-6);
  wait(gpu, 0.1);
  wait(cpu, 0.1);
  EXPECT_LT(compare(cpu, gpu).excess, 1e-6);
}

/// A device whose context is lost before the `at`-th advance.
class FatefulPasses final : public HeatPasses {
 public:
  FatefulPasses(std::shared_ptr<GpuHeat> passes, EglContext& context, int at)
      : passes_(std::move(passes)), context_(context), at_(at) {}
  bool start(std::span<HeatBrick* const> warm, const HeatModel& model) override {
    return passes_->start(warm, model);
  }
  HeatFlows prepare() override { return passes_->prepare(); }
  HeatFlows rates() override { return passes_->rates(); }
  void advance(double dt) override {
    if (--at_ == 0) context_.declare_lost();
    passes_->advance(dt);
  }
  void advance_stage(const SuperStage& stage, int j, double dt) override {
    passes_->advance_stage(stage, j, dt);
  }
  void settle(double dt) override { passes_->settle(dt); }
  bool finish(bool fields) override { return passes_->finish(fields); }
  bool fetch(std::span<HeatBrick* const> bricks) override { return passes_->fetch(bricks); }
  const std::string& trouble() const override { return passes_->trouble(); }

 private:
  std::shared_ptr<GpuHeat> passes_;
  EglContext& context_;
  int at_;
};

TEST_F(GpuHeatTest, AContextThatIsLostInAStepCostsNothing) {
  const std::shared_ptr<EglContext> own = *EglContext::create();
  Bioheat cpu(ThermalTissue{}, BioheatOptions{}, half_space());
  Bioheat gpu(ThermalTissue{}, BioheatOptions{}, half_space());
  gpu.compute_on(std::make_shared<FatefulPasses>(create(GpuLimits::of_device(), own), *own, 10));
  burn(cpu, 10.0, 0.3);
  burn(gpu, 10.0, 0.3);
  EXPECT_EQ(gpu.device(), nullptr);
  EXPECT_EQ(gpu.device_failure(), "heat on the GPU: its context was lost");
  EXPECT_LT(compare(cpu, gpu).excess, 1e-3);
  EXPECT_NEAR(gpu.book().delivered, cpu.book().delivered, 1e-6 * cpu.book().delivered);
  EXPECT_LT(std::abs(gpu.book().residual()), 1e-4 * gpu.book().delivered);
  context_->make_current();
}

TEST_F(GpuHeatTest, AContextThatIsLostCostsTheStepsThatWerentFetched) {
  const std::shared_ptr<EglContext> own = *EglContext::create();
  Bioheat heat(ThermalTissue{}, BioheatOptions{}, half_space());
  heat.compute_on(create(GpuLimits::of_device(), own), HeatReturn::kWhenAsked);
  burn(heat, 10.0, 0.2);
  heat.fetch();
  const std::string fetched = state_of(heat);
  const double delivered = heat.book().delivered;
  burn(heat, 10.0, 0.1);
  EXPECT_GT(heat.book().delivered, delivered);
  own->declare_lost();
  heat.fetch();
  EXPECT_EQ(heat.device(), nullptr);
  EXPECT_EQ(heat.device_failure(), "heat on the GPU: its context was lost");
  EXPECT_EQ(heat.book().delivered, delivered);
  EXPECT_LT(std::abs(heat.book().residual()), 1e-4 * delivered)
      << "fields and book are of one time";
  burn(heat, 10.0, 0.1);
  EXPECT_GT(heat.book().delivered, delivered) << "goes on";
  EXPECT_LT(std::abs(heat.book().residual()), 1e-4 * heat.book().delivered);
  context_->make_current();
}

TEST_F(GpuHeatTest, FromCpuToGpuAndBackNothingIsLost) {
  Bioheat heat(ThermalTissue{}, BioheatOptions{}, half_space());
  Bioheat cpu(ThermalTissue{}, BioheatOptions{}, half_space());
  burn(heat, 8.0, 0.2);
  heat.compute_on(device(), HeatReturn::kWhenAsked);
  burn(heat, 8.0, 0.2);
  heat.compute_on(device());
  burn(heat, 8.0, 0.2);
  heat.compute_on(nullptr);
  burn(heat, 8.0, 0.2);
  burn(cpu, 8.0, 0.8);
  EXPECT_EQ(heat.device_failure(), "");
  EXPECT_LT(compare(cpu, heat).excess, 1e-3);
  EXPECT_LT(compare(cpu, heat).damage, 5e-3);
  EXPECT_LT(book_difference(cpu.book(), heat.book()), 1e-4);
}

TEST_F(GpuHeatTest, AnOrganThatNobodyHeatsAsksNothingOfTheDevice) {
  const std::shared_ptr<GpuHeat> passes = device();
  Bioheat heat(ThermalTissue{}, BioheatOptions{}, half_space());
  heat.compute_on(passes);
  wait(heat, 1.0);
  heat.fetch();
  EXPECT_EQ(passes->bytes(), 0u);
  EXPECT_EQ(heat.device_failure(), "");
}

}  // namespace
}  // namespace viscera
