// The organs of the main scene, where the scene puts them.
#include <gtest/gtest.h>

#include <memory>

#include "engine/features/breathing/breathing_keys.h"
#include "engine/features/features.h"
#include "engine/organ/shape.h"
#include "engine/scene/load_scene.h"
#include "kernels/points/surface_tree.h"
#include "tests/engine/organ/shape_check.h"
#include "tests/support/paths.h"

namespace viscera::test {
namespace {

/// What an adult's organ measures, from textbooks of anatomy and sonography, recalled [mL, mm]. The
/// hollow ones are counted as they are filled here; where a scene shows a part, the part's measure
/// stands. `greatest extent` is the longest edge of the bounding box.
struct Human {
  const char* name;
  double least_ml, greatest_ml;
  double least_mm, greatest_mm;
};
constexpr Human kHuman[] = {
    {"liver", 1100, 1800, 200, 260},      // 1.2 to 1.6 L; 20 to 26 cm across
    {"gallbladder", 25, 60, 60, 100},     // 30 to 50 mL; 7 to 10 cm
    {"stomach", 250, 1500, 150, 300},     // up to 1.5 L filled; 20 to 25 cm
    {"duodenum", 30, 110, 90, 200},       // 25 cm along a C, of which 19 here; 2.5 to 3 cm wide
    {"bile_ducts", 0.8, 6, 50, 110},      // common duct 6 to 8 cm, up to 7 mm wide
    {"spleen", 100, 250, 90, 130},        // 100 to 250 mL; up to 12 cm
    {"kidney_right", 120, 220, 95, 125},  // 10 to 12 cm; 120 to 200 mL
    {"kidney_left", 120, 220, 95, 125},
    {"colon", 400, 1200, 240, 400},        // 1 m of it, 4 to 5 cm wide
    {"small_bowel", 400, 1000, 130, 350},  // 1.5 of 3 to 5 m, 2.5 to 3 cm wide
    {"omentum", 50, 800, 100, 300},        // 50 g to 1 kg, after the person
    {"diaphragm", 300, 1000, 280, 360},    // as wide as the trunk inside
    {"falciform_ligament", 10, 80, 120, 220},
    {"abdominal_wall", 3000, 7000, 330, 450},
};

/// Sharp notches of one surface may cut this deep into another's chords [m].
constexpr double kOverlap = 0.2e-3;
/// Organs breathe as rigid bodies; what lies between those that go different ways gives room [m].
constexpr double kBreathingOverlap = 2.5e-3;

struct Organ {
  std::string name;
  TriangleSurface surface;
  Box box;
  std::unique_ptr<SurfaceTree> tree;
  Vec3 breath = Vec3::Zero();  ///< how far the organ has gone at the height of a breath [m]
};

std::vector<Organ> organs_of(const SceneDescription& scene) {
  std::vector<Organ> organs;
  for (const OrganDescription& described : scene.organs) {
    auto surface = build_shape(described.geometry, project_file("assets"));
    if (!surface) {
      ADD_FAILURE() << described.name << ": " << surface.error().text();
      continue;
    }
    for (Vec3& vertex : surface->vertices) vertex = described.pose.to_world(vertex);
    Organ organ;
    organ.name = described.name;
    organ.surface = std::move(*surface);
    if (const MotionDescription* motion = motion_of(described))
      organ.breath = motion->displacement(0.5 * motion->period);
    organ.box = bounds(organ.surface);
    organ.tree = std::make_unique<SurfaceTree>(organ.surface);
    organs.push_back(std::move(organ));
  }
  return organs;
}

/// The least signed distance of a vertex of `one` from `other`, which is moved back by `shift`.
double clearance(const Organ& one, const Organ& other, const Vec3& shift, Vec3& where) {
  double least = 1.0;
  for (const Vec3& place : one.surface.vertices) {
    const Vec3 vertex = place + shift;
    if (other.box.exteriorDistance(vertex) > 2e-3) continue;
    const double distance = other.tree->signed_distance(vertex);
    if (distance < least) least = distance, where = vertex;
  }
  return least;
}

TEST(Anatomy, OrgansOfTheMainSceneAreHumanInSizeAndNoTwoInterpenetrate) {
  SceneLoadOptions options;
  options.assets = project_file("assets");
  options.features = feature_keys();
  const auto scene = load_scene(project_file("scenes/laparoscopic_cautery.json"), options);
  ASSERT_TRUE(scene) << scene.error().text();
  const std::vector<Organ> organs = organs_of(*scene);
  ASSERT_GE(organs.size(), 12u);
  EXPECT_EQ(organs.size(), std::size(kHuman));

  for (const Human& human : kHuman) {
    const auto organ = std::find_if(organs.begin(), organs.end(),
                                    [&](const Organ& o) { return o.name == human.name; });
    if (organ == organs.end()) {
      ADD_FAILURE() << "no " << human.name;
      continue;
    }
    EXPECT_EQ(defects(organ->surface), "") << human.name;
    const double millilitres = 1e6 * volume(organ->surface);
    EXPECT_GE(millilitres, human.least_ml) << human.name;
    EXPECT_LE(millilitres, human.greatest_ml) << human.name;
    const double across = 1e3 * organ->box.sizes().maxCoeff();
    EXPECT_GE(across, human.least_mm) << human.name;
    EXPECT_LE(across, human.greatest_mm) << human.name;
  }

  for (const Organ& one : organs) {
    for (const Organ& other : organs) {
      if (&one == &other || !one.box.intersects(other.box)) continue;
      Vec3 where = Vec3::Zero();
      EXPECT_GE(clearance(one, other, Vec3::Zero(), where), -kOverlap)
          << one.name << " in " << other.name << " at " << 1e3 * where.transpose() << " mm";
      const Vec3 shift = one.breath - other.breath;
      if (shift.isZero(0.0)) continue;
      EXPECT_GE(clearance(one, other, shift, where), -kBreathingOverlap)
          << one.name << " in " << other.name << " at the height of a breath, at "
          << 1e3 * where.transpose() << " mm";
    }
  }
}

}  // namespace
}  // namespace viscera::test
