// The paper's palpations [De2006] fig. 14, whole, on the logical clock: the kidney by its global
// model (GPAFF), the lung by hives alone (LPAFF).
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <string>

#include "engine/features/held_tools/held_tools.h"
#include "engine/features/local/local.h"
#include "engine/run/state_hash.h"
#include "tests/scenes/shipped_world.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

struct Palpation {
  std::string hash;
  double felt = 0.0, dent = 0.0;  ///< greatest, by the hand [N]; of the drawn surface [m]
  std::size_t triangles = 0;
  bool global = false, local = false;
  HiveTissueFigures hives;
  Agreement agreement;
  std::uint64_t passivity_violations = 0;
};

Palpation palpate(const std::string& name,
                  const std::function<void(SceneDescription&)>& change = {}) {
  Palpation out;
  const auto [scene, world] = build_shipped(name, change);
  if (!world) return out;
  World& all = *world;
  if (const auto held = hold_tools(all, {}); !held) {
    ADD_FAILURE() << held.error().text();
    return out;
  }
  StateHash hash;
  Trace trace(stage_names());
  const HapticTool& probe = servos_of(all)->tools().front();
  while (all.time() < scene.duration - 1e-9) {
    step_frame(all, trace);
    hash.add_frame(all);
    out.felt = std::max(out.felt, probe.output.tissue.norm());
    out.dent = std::max(out.dent, double{all.all<OrganState>()[0].greatest_displacement});
  }
  out.hash = hash.finish(all);
  out.triangles = all.all<OrganBody>()[0].model->surface.triangles.size();
  out.global = all.all<OrganBody>()[0].model->touchable_anywhere();
  out.local = all.all<LocalBody>().size() == 1;
  out.hives = probe.tissue->figures();
  out.agreement = probe.agreement;
  out.passivity_violations = probe.servo->passivity_violations();
  return out;
}

void expect_touched(const Palpation& one) {
  EXPECT_GT(one.felt, 0.02);
  EXPECT_GT(one.dent, 1e-3);
  EXPECT_LT(one.dent, 20e-3);
  EXPECT_GE(one.hives.hives, 2u);
  EXPECT_EQ(one.hives.refused, 0u);
  EXPECT_EQ(one.hives.uncovered, 0u);
  EXPECT_EQ(one.passivity_violations, 0u);
  // Hand and picture meet one tissue.
  EXPECT_GT(one.agreement.frames, 5u);
  EXPECT_LT(one.agreement.ratio(), 0.03);
}

TEST(Palpation, TheKidneyIsFeltBesideItsGlobalModelAndRepeats) {
  const Palpation first = palpate("kidney_palpation");
  EXPECT_EQ(first.triangles, 1080u);
  EXPECT_TRUE(first.global && !first.local);
  expect_touched(first);
  EXPECT_EQ(palpate("kidney_palpation").hash, first.hash);
}

TEST(Palpation, TheLungIsFeltAndDentedByHivesAloneAndRepeats) {
  const Palpation first = palpate("lung_palpation");
  EXPECT_EQ(first.triangles, 1364u);
  EXPECT_TRUE(first.local && !first.global);
  expect_touched(first);
  EXPECT_EQ(palpate("lung_palpation").hash, first.hash);
}

// Beside the gallbladder's bed, while a jaw draws the gallbladder, the bed pulls at the liver and
// all of it breathes.
TEST(Palpation, AHookThatRestsOnTheLiverFeelsThePicturesLiver) {
  const Palpation rests = palpate("laparoscopic_cautery", [](SceneDescription& scene) {
    for (InstrumentDescription& tool : scene.instruments) {
      if (!haptic_of(tool)) continue;
      tool.path.resize(3);
      for (const double time : {2.8, 5.0}) {
        InstrumentKey& rest = tool.path.emplace_back(tool.path.back());
        rest.time = time;
        rest.tip = Vec3(-22e-3, -5e-3, 32e-3);
      }
    }
    scene.duration = 5.0;
  });
  EXPECT_GT(rests.felt, 0.005);
  EXPECT_GT(rests.agreement.frames, 20u);
  EXPECT_LT(rests.agreement.ratio(), 0.03);
  EXPECT_EQ(rests.passivity_violations, 0u);
  RecordProperty("difference", std::to_string(rests.agreement.ratio()));
}

}  // namespace
}  // namespace viscera::test
