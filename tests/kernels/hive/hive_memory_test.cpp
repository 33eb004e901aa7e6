// A program of its own: it counts what the whole program allocates.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "engine/verification/hemisphere_body.h"
#include "kernels/base/sanitized.h"
#include "kernels/hive/hive.h"

namespace {
std::atomic<long> allocations{0};
}

#ifndef VISCERA_SANITIZED
// Eigen takes its memory by malloc.
extern "C" void* __libc_malloc(std::size_t size);
extern "C" void* malloc(std::size_t size) {
  ++allocations;
  return __libc_malloc(size);
}
#endif

namespace viscera {
namespace {

TEST(HiveMemory, BuildSeatAndPressTakeNone) {
  if (kSanitized) GTEST_SKIP() << "a sanitizer has a malloc of its own";
  HemisphereOptions options;
  options.nodes = 300;
  options.touchable_zone = 0.9;
  auto body = HemisphereBody::prepare(options, no_progress());
  ASSERT_TRUE(body);
  const auto surface = WalkableSurface::make((*body)->surface());
  ASSERT_TRUE(surface);
  ASSERT_GT(allocations, 1000);  // they are counted
  struct Case {
    HiveFormulation formulation;
    HivePeriphery periphery;
    int nodes;
  };
  for (const Case& one : {Case{HiveFormulation::kSubtracted, HivePeriphery::kCoupled, 80},
                          Case{HiveFormulation::kSubtracted, HivePeriphery::kCoupled, 200},
                          Case{HiveFormulation::kSubtracted, HivePeriphery::kBoussinesq, 200},
                          Case{HiveFormulation::kSubtracted, HivePeriphery::kFixed, 512},
                          Case{HiveFormulation::kPaper, HivePeriphery::kBoussinesq, 28}}) {
    HiveSettings settings;
    settings.material = (*body)->material();
    settings.formulation = one.formulation;
    settings.periphery = one.periphery;
    settings.radius = 0.4 * kHemisphereRadius;
    settings.nodes = one.nodes;
    auto hive =
        Hive::create({&*surface, &(*body)->compliance(), &(*body)->touchable()}, settings, 64);
    ASSERT_TRUE(hive) << hive.error().text();
    const auto many = HemisphereBody::cells(HemisphereContact::kFrictionless, 0.45, 0.1, 3, 0.0);
    const auto few = HemisphereBody::cells(HemisphereContact::kFrictionless, 0.45, 0.08, 2, 0.02);
    std::vector<double> depths(many.size(), 1e-4);
    SurfaceSpot spot = surface->nearest(Vec3(0, 0, kHemisphereRadius));
    const long before = allocations;
    int sound = 0;
    for (int i = 0; i < 4; ++i) {
      const Vec3 tip = kHemisphereRadius * Vec3(0.01 * i, 0.002 * i, 1.0).normalized();
      surface->walk(tip, 1.0, spot);
      sound += hive->build(spot) == HiveVerdict::kSound;
      sound += hive->seat(few) == HiveVerdict::kSound;
      sound += hive->press(std::span(depths).first(few.size())).verdict == HiveVerdict::kSound;
      sound += hive->seat(many) == HiveVerdict::kSound;
      for (std::size_t k = 0; k < depths.size(); ++k)
        depths[k] = 1e-4 - 1e-5 * static_cast<double>(k * i);
      sound += hive->press(depths).verdict == HiveVerdict::kSound;
      sound += hive->displacement(spot).allFinite();
    }
    const long taken = allocations - before;
    EXPECT_EQ(taken, 0) << name_of(one.formulation) << ' ' << name_of(one.periphery) << ' '
                        << one.nodes;
    EXPECT_EQ(sound, 24);
  }
}

}  // namespace
}  // namespace viscera
