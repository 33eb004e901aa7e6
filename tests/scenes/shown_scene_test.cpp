// Shipped scenes show what their first lines and the guide's table say.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "engine/features/contact/contact.h"
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
  /// How much of what they press each could draw along x, were all its cells to slide that way [N].
  std::vector<double> most_drawn;
};

/// A cell drags across its own normal, by its coefficient of friction times what it presses at
/// most; and where that normal leans it presses along x, too.
double most_drawn(const World& world, std::size_t tool) {
  const Entity instrument = world.all<InstrumentBody>().owner(tool);
  const OrganContact& contact = world.all<OrganContact>()[0];
  double sum = 0.0;
  for (const CellRange& range : world.all<OrganTouch>()[0].ranges) {
    if (range.instrument != instrument) continue;
    for (std::size_t k = range.begin; k < range.end; ++k) {
      const ContactCell& cell = contact.cells[k];
      const double along = cell.direction.x();
      sum += contact.solution.forces[k].dot(cell.direction) *
             (along + cell.friction * std::sqrt(1.0 - along * along));
    }
  }
  return sum;
}

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
    for (std::size_t tool = 0; tool < tools; ++tool)
      one.most_drawn.push_back(most_drawn(simulation->world(), tool));
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
  double rough = 0.0, smooth = 0.0, pressed = 0.0, slides = 0.0;
  for (const Shown& one : show("kidney_rubbed", 2.0, 2)) {
    if (one.time < 1.3) continue;
    // The walls of its dent press it back, too: more than .8 of what it presses in all.
    EXPECT_LT(-one.forces[0].x(), (1.0 + 1e-6) * one.most_drawn[0]) << one.time << " s";
    EXPECT_NEAR(-one.forces[1].x(), one.most_drawn[1], 1e-6 * one.forces[1].norm());
    slides = std::max(slides, -one.forces[0].x() / one.most_drawn[0]);
    rough = std::max(rough, -one.forces[0].x());
    smooth = std::max(smooth, -one.forces[1].x());
    pressed = std::max(pressed, one.forces[0].z());
  }
  EXPECT_GT(rough, 4.0 * smooth);
  EXPECT_GT(rough, 0.5 * pressed);
  RecordProperty("of_what_could_be_drawn", std::to_string(slides));
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
