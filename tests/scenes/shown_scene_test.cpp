// Shipped scenes show what their first lines and the guide's table say.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "engine/simulator/simulation.h"
#include "tests/support/paths.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

/// What a step came to.
struct Shown {
  double time = 0.0;          ///< [s]
  double displacement = 0.0;  ///< of the first organ's surface, the greatest [m]
  std::vector<Vec3> forces;   ///< on the tools [N]
};

std::vector<Shown> show(const std::string& scene, double duration, std::size_t tools = 1) {
  std::vector<Shown> all;
  const auto model =
      Model::load(project_file("scenes/" + scene + ".json"), {.assets = project_file("assets")});
  EXPECT_TRUE(model) << model.error().text();
  if (!model) return all;
  auto simulation = Simulation::create(*model);
  EXPECT_TRUE(simulation) << simulation.error().text();
  if (!simulation) return all;
  const auto first = simulation->surface(0).positions;
  const std::vector<Vec3f> rest(first.begin(), first.end());
  while (simulation->time() < duration - 1e-9) {
    const StepReport report = simulation->step();
    EXPECT_EQ(test::but_for_strain(report.flags), FlagSet())
        << scene << " at " << simulation->time() << " s";
    Shown one{simulation->time(), 0.0, {}};
    const auto now = simulation->surface(0).positions;
    for (std::size_t v = 0; v < rest.size(); ++v)
      one.displacement = std::max(one.displacement, double{(now[v] - rest[v]).norm()});
    for (std::size_t tool = 0; tool < tools; ++tool) one.forces.push_back(simulation->force(tool));
    all.push_back(std::move(one));
  }
  return all;
}

TEST(ShownScenes, ATiltedTableMakesTheLiverSagByAboutACentimetreOntoTheProbe) {
  double before = 0.0, met = 0.0;
  const auto shown = show("tilted_table", 5.0);
  ASSERT_FALSE(shown.empty());
  for (const Shown& one : shown) {
    if (one.time < 0.5) before = std::max(before, one.displacement);
    met = std::max(met, one.forces[0].norm());
  }
  EXPECT_LT(before, 1e-5);
  EXPECT_NEAR(shown.back().displacement, 12e-3, 1e-3);
  EXPECT_GT(met, 0.005);
}

TEST(ShownScenes, ARoughProbeDrawsTheKidneyAlongWhereASmoothOneSlides) {
  double rough = 0.0, smooth = 0.0, pressed = 0.0;
  for (const Shown& one : show("kidney_rubbed", 2.0, 2)) {
    if (one.time < 1.3) continue;
    rough = std::max(rough, -one.forces[0].x());
    smooth = std::max(smooth, -one.forces[1].x());
    pressed = std::max(pressed, one.forces[0].z());
  }
  EXPECT_GT(rough, 4.0 * smooth);
  EXPECT_GT(rough, 0.5 * pressed);
  EXPECT_LT(rough, 1.25 * pressed);  // .8, and the slope of the surface and of the dent's wall
}

TEST(ShownScenes, AHandThatPressesTheLiverDeepFeelsItRelax) {
  double arriving = 0.0, leaving = 0.0;
  for (const Shown& one : show("liver_deep_palpation", 3.5)) {
    if (one.time < 2.0) arriving = std::max(arriving, one.forces[0].norm());
    leaving = one.forces[0].norm();
  }
  EXPECT_NEAR(arriving, 0.26, 0.03);
  EXPECT_NEAR(leaving, 0.20, 0.02);
}

TEST(ShownScenes, TheGallbladderIsLiftedFarAndSwingsBack) {
  const auto shown = show("gallbladder_lift", 5.0);
  ASSERT_FALSE(shown.empty());
  double greatest = 0.0, strongest = 0.0;
  for (const auto& one : shown) {
    greatest = std::max(greatest, one.displacement);
    strongest = std::max(strongest, one.forces[0].norm());
  }
  EXPECT_GT(greatest, 28e-3);
  EXPECT_GT(strongest, 0.5);
  EXPECT_LT(shown.back().displacement, 2e-3);
  EXPECT_EQ(shown.back().forces[0].norm(), 0.0);
}

TEST(ShownScenes, ARetractorsBladeLiftsTheLiver) {
  const auto shown = show("liver_retraction", 3.0);
  ASSERT_FALSE(shown.empty());
  EXPECT_GT(shown.back().displacement, 8e-3);
  EXPECT_LT(shown.back().forces[0].z(), -0.1);
}

}  // namespace
}  // namespace viscera::test
