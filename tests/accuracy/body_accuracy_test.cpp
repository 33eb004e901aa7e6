// Bodies that decide what a contact feels, on 1,100 equally spaced nodes that know nothing of it,
// against finite elements (assets/reference/bodies).
#include <gtest/gtest.h>

#include <cmath>

#include "engine/verification/body_references.h"
#include "tests/support/paths.h"

namespace viscera {
namespace {

const BodyCase& body_named(const std::string& name) {
  for (const BodyCase& body : body_cases())
    if (body.name == name) return body;
  ADD_FAILURE() << name;
  return body_cases().front();
}

/// Worst over the body's loads, at Poisson's ratio .45.
BodyErrors worst_errors(const std::string& name, std::size_t nodes) {
  static const auto references =
      read_body_references(test::project_file("assets/reference/bodies")).value();
  constexpr double kPoisson = 0.45;
  const BodyCase& body = body_named(name);
  BodyErrors worst;
  const auto prepared = prepare_body(body, kPoisson, nodes, "galerkin", no_progress());
  EXPECT_TRUE(prepared) << prepared.error().text();
  if (!prepared) return {1.0, 1.0};
  for (const BodyLoad load : body.loads) {
    const PressedAnswer answer = press_body(**prepared, body, load);
    EXPECT_TRUE(answer.converged) << name << ' ' << name_of(load);
    const BodyErrors errors =
        errors_of(**prepared, body, answer, *find_reference(references, name, load, kPoisson));
    const double force = std::abs(errors.force);
    worst.force = std::max(worst.force, force);
    worst.profile = std::max(worst.profile, errors.profile);
    testing::Test::RecordProperty(std::string(name_of(load)) + "_force", std::to_string(force));
    testing::Test::RecordProperty(std::string(name_of(load)) + "_profile",
                                  std::to_string(errors.profile));
  }
  return worst;
}

void expect_errors(const std::string& name, double force, double profile) {
  const BodyErrors worst = worst_errors(name, 1100);
  EXPECT_LT(worst.force, force);
  EXPECT_LT(worst.profile, profile);
}

// Three spacings of height: the worst of all.
TEST(SlabOfTwoRadii, ErrsByAFifteenthAndLessOnTwiceAsManyNodes) {
  const BodyErrors coarse = worst_errors("slab_2", 1100), fine = worst_errors("slab_2", 2200);
  EXPECT_LT(coarse.force, 0.07);
  EXPECT_LT(coarse.profile, 0.1);
  EXPECT_LT(fine.force, 0.062);
  EXPECT_LT(fine.profile, 0.9 * coarse.profile);
}

TEST(SlabOfThreeAndAHalfRadii, IsPressedWithinAFewPercent) {
  expect_errors("slab_3.5", 0.025, 0.06);
}

TEST(SlabOfFiveRadii, IsPressedWithinAFewPercent) {
  expect_errors("slab_5", 0.01, 0.055);
}

// Nodes 1.4 to 2.7 radii of the contact apart, slabs one to two and a half spacings thick. What
// is finer than the nodes knows the base; their shape is the nodes' own.
TEST(Slabs, ArePressedWithinAFewPercentOnNodesWiderThanTheContact) {
  for (const std::string name : {"slab_2", "slab_3.5", "slab_5"})
    for (const std::size_t nodes : {120, 250})
      EXPECT_LT(worst_errors(name, nodes).force, 0.035) << name << ' ' << nodes;
}

// The cap that holds it is two and a half spacings wide.
TEST(BallGluedToAPlate, IsPressedWithinATenth) {
  expect_errors("ball", 0.06, 0.11);
}

TEST(ContactNearARightAngledEdge, AtOnePointTwoRadiiErrsLittleInForceMoreInShape) {
  expect_errors("edge_1.2", 0.02, 0.085);
}

TEST(ContactNearARightAngledEdge, AtTwoRadiiErrsLittleInForceMoreInShape) {
  expect_errors("edge_2", 0.03, 0.065);
}

TEST(ContactNearARightAngledEdge, AtFourRadiiIsPressedWithinAFewPercent) {
  expect_errors("edge_4", 0.02, 0.045);
}

TEST(BarHeldAtItsEnd, BendsAsFiniteElementsSay) {
  expect_errors("bar", 0.01, 0.005);
}

}  // namespace
}  // namespace viscera
