#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <fstream>

#include "engine/organ/recipe.h"
#include "engine/organ/shape.h"
#include "tests/engine/organ/shape_check.h"
#include "tests/support/paths.h"

namespace viscera::test {
namespace {

RecipeGeometry recipe(const std::string& name, double edge = 0.0) {
  RecipeGeometry geometry;
  geometry.recipe = name;
  geometry.edge = edge;
  return geometry;
}

struct Expected {
  std::string name;
  Vec3 least_mm, greatest_mm;  // range of the extents
  double coarse_mm, fine_mm;   // edges
};

void PrintTo(const Expected& expected, std::ostream* out) {
  *out << expected.name;
}

class RecipeShape : public testing::TestWithParam<Expected> {};

TEST_P(RecipeShape, IsSoundAndOfHumanSizeAtTwoResolutions) {
  const Expected& expected = GetParam();
  const auto described = load_recipe(project_file("assets"), expected.name, 1);
  ASSERT_TRUE(described) << described.error().text();
  for (const double edge_mm : {expected.coarse_mm, expected.fine_mm}) {
    const TriangleSurface surface = built(recipe(expected.name, 1e-3 * edge_mm));
    EXPECT_EQ(defects(surface), "");
    EXPECT_GT(least_angle_degrees(surface), 15.0) << edge_mm;
    EXPECT_NEAR(mean_edge(surface), 1e-3 * edge_mm, 0.1e-3 * edge_mm);
    EXPECT_LT(greatest_offset(surface, described->distance), 1e-6 * edge_mm);
    const Vec3 size_mm = 1e3 * bounds(surface).sizes();
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_GE(size_mm[axis], expected.least_mm[axis]) << axis;
      EXPECT_LE(size_mm[axis], expected.greatest_mm[axis]) << axis;
    }
  }
}

TEST_P(RecipeShape, ChangesSlightlyWithTheSeedAndIsTheSameForTheSameSeed) {
  const Expected& expected = GetParam();
  RecipeGeometry geometry = recipe(expected.name, 1e-3 * expected.coarse_mm);
  const TriangleSurface first = built(geometry);
  EXPECT_EQ(content_hash(first), content_hash(built(geometry)));
  geometry.seed = 2;
  const TriangleSurface other = built(geometry);
  EXPECT_EQ(defects(other), "");
  EXPECT_NE(content_hash(first), content_hash(other));
  EXPECT_NEAR(volume(other) / volume(first), 1.0, 0.15);
}

// The least distance of the body from the walls of its box.
double clearance_in_box(const Recipe& recipe) {
  const Box& box = recipe.box;
  double least = 1.0;
  constexpr int kParts = 24;
  for (int axis = 0; axis < 3; ++axis) {
    for (int i = 0; i <= kParts * kParts; ++i) {
      Vec3 share;
      share[axis] = 0.0;
      share[(axis + 1) % 3] = static_cast<double>(i % kParts) / (kParts - 1);
      share[(axis + 2) % 3] = static_cast<double>(i / kParts) / kParts;
      for (const double side : {0.0, 1.0}) {
        share[axis] = side;
        least = std::min(least, recipe.distance(box.min() + share.cwiseProduct(box.sizes())));
      }
    }
  }
  return least;
}

TEST_P(RecipeShape, StaysInsideItsBoxWhateverTheSeed) {
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    const auto described = load_recipe(project_file("assets"), GetParam().name, seed);
    ASSERT_TRUE(described) << described.error().text();
    EXPECT_GT(clearance_in_box(*described), 1e-3) << seed;
  }
}

INSTANTIATE_TEST_SUITE_P(
    All, RecipeShape,
    testing::Values(Expected{"liver", {200, 120, 90}, {260, 170, 130}, 6.0, 4.0},
                    Expected{"gallbladder", {35, 60, 50}, {50, 80, 70}, 4.0, 2.5},
                    Expected{"stomach", {140, 170, 55}, {200, 260, 90}, 9.0, 6.0},
                    Expected{"spleen", {40, 90, 60}, {65, 125, 95}, 7.0, 5.0},
                    Expected{"kidney", {50, 95, 38}, {70, 125, 52}, 6.0, 4.0},
                    Expected{"kidney_right", {50, 95, 38}, {70, 125, 52}, 6.0, 4.0},
                    Expected{"lung", {85, 230, 150}, {130, 290, 200}, 13.0, 9.0}),
    [](const auto& info) { return info.param.name; });

// Organs made of several others take seconds to mesh; the anatomy test does, and measures them
// there.
class FittedRecipe : public testing::TestWithParam<const char*> {};

TEST_P(FittedRecipe, StaysInsideItsBoxAndFollowsItsSeed) {
  std::vector<double> values;
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    const auto described = load_recipe(project_file("assets"), GetParam(), seed);
    ASSERT_TRUE(described) << described.error().text();
    EXPECT_GT(clearance_in_box(*described), 1e-3) << seed;
    double sum = 0.0;
    for (int i = 0; i < 15 * 15 * 15; ++i)
      sum += described->distance(
          described->box.min() +
          described->box.sizes().cwiseProduct(Vec3(i % 15, i / 15 % 15, i / 225)) / 14.0);
    values.push_back(sum);
  }
  std::sort(values.begin(), values.end());
  EXPECT_EQ(std::adjacent_find(values.begin(), values.end()), values.end());
}

INSTANTIATE_TEST_SUITE_P(All, FittedRecipe,
                         testing::Values("abdominal_cavity", "abdominal_wall", "bile_ducts",
                                         "colon", "diaphragm", "duodenum", "falciform_ligament",
                                         "omentum", "small_bowel"),
                         [](const auto& info) { return std::string(info.param); });

TEST(Recipe, KidneyAndLungHaveThePapersNumbersOfTriangles) {
  for (const auto& [name, triangles] : {std::pair{"kidney", 1080u}, std::pair{"lung", 1364u}}) {
    const TriangleSurface surface = built(recipe(name));
    EXPECT_EQ(surface.triangles.size(), triangles);
    EXPECT_EQ(defects(surface), "");
    EXPECT_GT(least_angle_degrees(surface), 15.0);
  }
}

TEST(Recipe, OneThreadAndManyBuildTheSameSurface) {
  const std::string many = content_hash(built(recipe("kidney", 3e-3)));
  const oneapi::tbb::global_control one(oneapi::tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(content_hash(built(recipe("kidney", 3e-3))), many);
}

TEST(Recipe, ScaleMultipliesTheBodyAndKeepsItsTriangles) {
  RecipeGeometry geometry = recipe("kidney");
  const double whole = volume(built(geometry));
  geometry.scale = 0.5;
  const TriangleSurface half = built(geometry);
  EXPECT_EQ(half.triangles.size(), 1080u);
  EXPECT_NEAR(volume(half) / whole, 0.125, 1e-3);
}

TEST(Recipe, GallbladderLiesInItsBedUnderTheLiverWithoutTouchingIt) {
  const auto liver = load_recipe(project_file("assets"), "liver", 1);
  ASSERT_TRUE(liver);
  const TriangleSurface gallbladder = built(recipe("gallbladder", 3e-3));
  double nearest = 1.0;
  for (const Vec3& x : gallbladder.vertices) nearest = std::min(nearest, liver->distance(x));
  EXPECT_GT(nearest, 0.3e-3);
  EXPECT_LT(nearest, 2e-3);
}

class RecipeFile : public testing::Test {
 protected:
  RecipeFile() { std::filesystem::create_directories(folder_ / "organs"); }

  std::string refusal(const std::string& text) {
    std::ofstream(folder_ / "organs/thing.json") << text;
    const auto surface = build_shape(recipe("thing"), folder_.path());
    return surface ? "" : surface.error().text();
  }

  static std::string with_shape(const std::string& shape) {
    return R"({"version": 1, "box_mm": [[-50, -50, -50], [50, 50, 50]], "edge_mm": 5, "shape": )" +
           shape + "}";
  }

  TemporaryFolder folder_;
};

TEST_F(RecipeFile, EveryKindOfShapeCanBeMeshed) {
  for (
      const char* shape :
      {R"({"ellipsoid": {"radii_mm": [20, 30, 25], "turn_deg": [0, 0, 30]}})",
       R"({"tube": {"points_mm": [[-20, 0, 0, 10], [0, 10, 0, 12], [20, 0, 0, 9]]}})",
       R"({"metaballs": {"balls_mm": [[-10, 0, 0, 15], [12, 0, 0, 15]], "blend_mm": 6}})",
       R"({"box": {"size_mm": [40, 30, 50], "round_mm": 10}})",
       R"({"union": {"smooth_mm": 5, "of": [{"ellipsoid": {"radii_mm": [20, 20, 20]}},
               {"ellipsoid": {"centre_mm": [20, 0, 0], "radii_mm": [15, 15, 15]}}]}})",
       R"({"intersection": {"smooth_mm": 12, "of": [{"ellipsoid": {"radii_mm": [30, 30, 30]}},
               {"half_space": {"point_mm": [0, 0, 5], "outward": [0, 0, 1]}}]}})",
       R"({"subtract": {"smooth_mm": 10, "from": {"ellipsoid": {"radii_mm": [30, 30, 30]}},
               "take": [{"ellipsoid": {"centre_mm": [0, 0, 35], "radii_mm": [20, 20, 20]}}]}})",
       R"({"grow": {"by_mm": 4, "of": {"box": {"size_mm": [30, 30, 30], "round_mm": 9}}}})",
       R"({"tube": {"points_mm": [[-30, 0, 0, 14], [30, 0, 0, 14]], "folds":
               {"pitch_mm": 20, "depth_mm": 4, "bands": 3, "band_depth_mm": 2}}})",
       R"({"mirror": {"along": "x", "of": {"ellipsoid": {"centre_mm": [20, 0, 0], "radii_mm": [15, 15, 15]}}}})",
       R"({"lobules": {"height_mm": 4, "size_mm": 15, "of": {"ellipsoid": {"radii_mm": [25, 25, 25]}}}})",
       R"({"move": {"by_mm": [5, 0, 0], "turn_deg": [90, 0, 0],
               "of": {"ellipsoid": {"radii_mm": [15, 30, 20]}}}})",
       R"({"stretch": {"factors": [1, 1, 1.4], "of": {"ellipsoid": {"radii_mm": [20, 20, 20]}}}})",
       R"({"bend": {"along": "x", "towards": "z", "radius_mm": 60,
               "of": {"ellipsoid": {"radii_mm": [35, 15, 12]}}}})",
       R"({"taper": {"along": "z", "from_mm": -20, "to_mm": 20, "to_scale": 0.5,
               "of": {"ellipsoid": {"radii_mm": [20, 20, 30]}}}})",
       R"({"noise": {"amplitude_mm": 1, "wavelength_mm": 30,
               "of": {"ellipsoid": {"radii_mm": [25, 25, 25]}}}})"}) {
    EXPECT_EQ(refusal(with_shape(shape)), "") << shape;
  }
}

TEST_F(RecipeFile, NamesEveryMistakeWithItsPath) {
  const std::string mistakes = refusal(with_shape(
      R"({"union": {"smooth_mm": -1, "of": [{"elipsoid": {}}, {"ellipsoid": {"radi_mm": [1, 2, 3]}}]}})"));
  EXPECT_NE(mistakes.find("shape/union/smooth_mm: found -1"), std::string::npos) << mistakes;
  EXPECT_NE(mistakes.find("did you mean \"ellipsoid\"?"), std::string::npos) << mistakes;
  EXPECT_NE(mistakes.find("shape/union/of/1/ellipsoid/radii_mm: found nothing"), std::string::npos)
      << mistakes;
  EXPECT_NE(mistakes.find("did you mean \"radii_mm\"?"), std::string::npos) << mistakes;
}

TEST_F(RecipeFile, RefusesBodiesThatLeaveTheirBoxOrFallApartOrAreHollow) {
  struct Case {
    const char* shape;
    const char* reason;
  };
  for (const auto& [shape, reason] :
       {Case{R"({"ellipsoid": {"radii_mm": [60, 20, 20]}})", "leaves its box at x"},
        Case{R"({"ellipsoid": {"centre_mm": [500, 0, 0], "radii_mm": [9, 9, 9]}})", "no body"},
        Case{R"({"metaballs": {"blend_mm": 1,
                    "balls_mm": [[-25, 0, 0, 15], [25, 0, 0, 15]]}})",
             "a second piece of"},
        Case{R"({"shell": {"thickness_mm": 10, "of": {"ellipsoid": {"radii_mm": [30, 30, 30]}}}})",
             "a cavity"}}) {
    const std::string text = refusal(with_shape(shape));
    EXPECT_NE(text.find(reason), std::string::npos) << text;
  }
}

TEST_F(RecipeFile, MakesRoomForABodyOfAnotherRecipe) {
  std::ofstream(folder_ / "organs/core.json")
      << with_shape(R"({"ellipsoid": {"radii_mm": [20, 20, 20]}})");
  const std::string around = with_shape(
      R"({"subtract": {"from": {"box": {"centre_mm": [0, 0, -15], "size_mm": [60, 60, 30]}},
           "take": [{"grow": {"by_mm": 2, "of": {"recipe": {"name": "core"}}}}]}})");
  ASSERT_EQ(refusal(around), "");
  const auto thing = load_recipe(folder_.path(), "thing", 1);
  ASSERT_TRUE(thing) << thing.error().text();
  EXPECT_NEAR(thing->distance({0, 0, -0.022}), 0.0, 1e-9);
  EXPECT_GT(thing->distance({0, 0, -0.019}), 0.0);
  // The cache must notice a change of either file.
  const auto files = recipe_files(folder_.path(), "thing");
  ASSERT_EQ(files.size(), 2u);
  EXPECT_EQ(files[0], folder_ / "organs/thing.json");
  EXPECT_EQ(files[1], folder_ / "organs/core.json");
}

TEST_F(RecipeFile, RefusesARecipeMadeOfItselfOrOfOneThatIsMissing) {
  std::ofstream(folder_ / "organs/other.json") << with_shape(R"({"recipe": {"name": "thing"}})");
  const std::string circle = refusal(with_shape(R"({"recipe": {"name": "other"}})"));
  EXPECT_NE(circle.find("other.json: shape/recipe/name: found \"thing\", expected a recipe that "
                        "isn't made of this one"),
            std::string::npos)
      << circle;
  EXPECT_EQ(recipe_files(folder_.path(), "thing").size(), 2u);
  EXPECT_NE(refusal(with_shape(R"({"recipe": {"name": "nobody"}})")).find("nobody.json"),
            std::string::npos);
  EXPECT_NE(refusal(with_shape(R"({"recipe": {}})")).find("shape/recipe/name: found nothing"),
            std::string::npos);
}

TEST_F(RecipeFile, RefusesFoldsThatMakeNoSense) {
  const std::string text = refusal(with_shape(
      R"({"tube": {"points_mm": [[-30, 0, 0, 14], [30, 0, 0, 14]],
           "folds": {"depth_mm": -1, "bands": 2.5, "pich_mm": 20}}})"));
  EXPECT_NE(text.find("shape/tube/folds/pitch_mm: found nothing"), std::string::npos) << text;
  EXPECT_NE(text.find("shape/tube/folds/depth_mm: found -1"), std::string::npos) << text;
  EXPECT_NE(text.find("shape/tube/folds/bands: found 2.5"), std::string::npos) << text;
  EXPECT_NE(text.find("did you mean \"pitch_mm\"?"), std::string::npos) << text;
}

TEST_F(RecipeFile, RefusesWhatIsMissingOrBroken) {
  EXPECT_NE(refusal("").find("empty"), std::string::npos);
  EXPECT_NE(refusal("{\"version\": 1").find("truncated"), std::string::npos);
  EXPECT_NE(refusal("{\"version\": 2}").find("version: found 2"), std::string::npos);
  const auto absent = build_shape(recipe("livr"), project_file("assets"));
  ASSERT_FALSE(absent);
  EXPECT_NE(absent.error().text().find("did you mean \"liver.json\"?"), std::string::npos)
      << absent.error().text();
}

}  // namespace
}  // namespace viscera::test
