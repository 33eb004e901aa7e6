// Bodies at finite strain in rough hands: jerked to and fro, and turned inside out in places. 300
// jerks; ten thousand with VISCERA_JERKED_BODIES=334.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "engine/verification/lifted_body.h"
#include "kernels/base/random.h"

namespace viscera {
namespace {

constexpr std::uint64_t kBodies = 10;
constexpr int kJerks = 30, kFramesBack = 20;
constexpr double kSpacing = 6e-3;                // of nodes [m]
constexpr double kJerk = 50e-3, kThrow = 10e-3;  // at most [m]
const Vec3 kHeld(0.0, 0.0, 4e-3);

std::uint64_t bodies() {
  const char* asked = std::getenv("VISCERA_JERKED_BODIES");
  return asked ? std::strtoull(asked, nullptr, 10) : kBodies;
}

const LiftedBody& body() {
  static const std::unique_ptr<LiftedBody> made = [] {
    auto prepared = LiftedBody::prepare({.spacing = kSpacing});
    EXPECT_TRUE(prepared) << (prepared ? "" : prepared.error().text());
    return std::move(*prepared);
  }();
  return *made;
}

/// Where it comes to rest, held so.
const FiniteState& settled() {
  static const FiniteState state = [] {
    FiniteState held = body().solver().at_rest();
    GripTouch touch = body().held_at(kHeld);
    for (int frame = 0; frame < 200; ++frame) body().solver().step(touch, held);
    return held;
  }();
  return state;
}

double least_volume(const FiniteState& state) {
  double least = 1.0;
  for (const Mat3& f : body().solver().body().mean_gradients(state.displacements))
    least = std::min(least, f.determinant());
  return least;
}

/// Of every so manyth node.
void throw_nodes(const Random& random, std::uint64_t frame, FiniteState& state) {
  const std::size_t every = 1 + random.bits(1000 + frame) % 40;
  for (std::size_t node = 0; node < state.displacements.size() / 3; node += every)
    Vec3::Map(state.displacements.data() + 3 * node) +=
        kThrow * random.uniform(2000 + frame) * random.direction(10'000 * (1 + frame) + node);
}

TEST(JerkedBody, IsBackWithinTwentyFramesAndNeverLost) {
  const FiniteSolver& solver = body().solver();
  double farthest = 0.0;
  std::uint64_t inverted = 0;
  for (std::uint64_t b = 0; b < bodies(); ++b) {
    const Random random(18, b);
    FiniteState state = solver.at_rest();
    for (std::uint64_t frame = 0; frame < kJerks; ++frame) {
      if (random.bits(5000 + frame) % 10 == 0) throw_nodes(random, frame, state);
      inverted += least_volume(state) < 0.0;
      GripTouch touch =
          body().held_at(kJerk * random.uniform(frame) * random.direction(100 + frame));
      solver.step(touch, state);
    }
    GripTouch touch = body().held_at(kHeld);
    for (int frame = 0; frame < kFramesBack; ++frame) solver.step(touch, state);
    double off = 0.0;
    for (std::size_t i = 0; i < state.displacements.size(); i += 3)
      off = std::max(off, (Vec3::Map(state.displacements.data() + i) -
                           Vec3::Map(settled().displacements.data() + i))
                              .norm());
    EXPECT_EQ(state.lost, 0) << b;
    EXPECT_GT(least_volume(state), 0.5) << b;
    EXPECT_LT(off, 1e-3) << b;
    farthest = std::max(farthest, off);
  }
  EXPECT_GT(inverted, 0u) << "nothing was turned inside out";
  RecordProperty("farthest_mm", std::to_string(1e3 * farthest));
  RecordProperty("inverted_frames", std::to_string(inverted));
}

}  // namespace
}  // namespace viscera
