#include "engine/render/instrument_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/shapes.h"

namespace viscera {
namespace {

using Kind = InstrumentView::Kind;

InstrumentView instrument(Kind kind) {
  InstrumentView view;
  view.kind = kind;
  view.tip_radius = kind == Kind::kHook ? 0.6e-3 : 1.5e-3;
  return view;
}

TEST(InstrumentMeshTest, EveryVertexIsFiniteWithAUnitNormalAndInReach) {
  for (const Kind kind : {Kind::kProbe, Kind::kGrasper, Kind::kHook, Kind::kSpatula}) {
    const InstrumentView view = instrument(kind);
    const InstrumentMesh mesh = make_instrument(view);
    ASSERT_GT(mesh.indices.size(), 300u);
    EXPECT_EQ(mesh.indices.size() % 3, 0u);
    EXPECT_LT(*std::max_element(mesh.indices.begin(), mesh.indices.end()), mesh.vertices.size());
    for (const InstrumentVertex& vertex : mesh.vertices) {
      ASSERT_TRUE(vertex.position.allFinite());
      EXPECT_NEAR(vertex.normal.norm(), 1.0f, 1e-4f);
      EXPECT_LE(vertex.position.z(), view.shaft_length + 1e-6);
    }
  }
}

TEST(InstrumentMeshTest, ABagHangsFromARingBeyondTheTipThatClosesToASlit) {
  InstrumentView view = instrument(Kind::kBag);
  view.mouth_radius = 30e-3;
  view.sack_depth = 80e-3;
  for (const double jaw : {1.0, 0.0}) {
    view.jaw = jaw;
    float lowest = 0.0f, widest = 0.0f, deepest = 0.0f, mouth = 0.0f;
    for (const InstrumentVertex& vertex : make_instrument(view).vertices) {
      ASSERT_TRUE(vertex.position.allFinite());
      EXPECT_NEAR(vertex.normal.norm(), 1.0f, 1e-4f);
      lowest = std::min(lowest, vertex.position.z());
      widest = std::max(widest, vertex.position.y());
      if (vertex.position.x() < 1e-3) mouth = std::max(mouth, vertex.position.y());
      deepest = std::max(deepest, vertex.position.x());
    }
    EXPECT_NEAR(lowest, -60e-3f, 1e-3f);
    EXPECT_NEAR(deepest, 80e-3f, 0.2e-3f);
    if (jaw == 1.0) {
      EXPECT_NEAR(mouth, 30e-3f, 1e-3f);
      EXPECT_NEAR(widest, 30e-3f, 1e-3f);
    } else {
      EXPECT_LT(mouth, 4e-3f);
      EXPECT_GT(widest, 20e-3f) << "below its mouth there is room for what it keeps";
    }
  }
}

TEST(InstrumentMeshTest, ProbeEndsInABallAboutTheTip) {
  const InstrumentMesh mesh = make_instrument(instrument(Kind::kProbe));
  float lowest = 1.0f;
  for (const InstrumentVertex& vertex : mesh.vertices)
    lowest = std::min(lowest, vertex.position.z());
  EXPECT_NEAR(lowest, -1.5e-3f, 1e-6f);
}

TEST(InstrumentMeshTest, HookEndsAtTheTipAndItsShaftStandsBack) {
  const InstrumentMesh mesh = make_instrument(instrument(Kind::kHook));
  float farthest_side = -1.0f, sleeve_centre = 0.0f;
  int sleeve = 0;
  for (const InstrumentVertex& vertex : mesh.vertices) {
    if (vertex.finish == static_cast<float>(Finish::kElectrode)) {
      farthest_side = std::max(farthest_side, vertex.position.x());
    }
    if (vertex.finish == static_cast<float>(Finish::kSleeve)) {
      sleeve_centre += vertex.position.x();
      ++sleeve;
    }
  }
  EXPECT_NEAR(farthest_side, 0.6e-3f, 1e-6f);  // the rounded end of the wire
  ASSERT_GT(sleeve, 0);
  EXPECT_LT(sleeve_centre / static_cast<float>(sleeve), -3e-3f);
}

TEST(InstrumentMeshTest, SpatulaIsABladeAsWideAsItsTipAndThin) {
  const InstrumentMesh mesh = make_instrument(instrument(Kind::kSpatula));
  float lowest = 1.0f, wide = 0.0f, thick = 0.0f;
  for (const InstrumentVertex& vertex : mesh.vertices) {
    lowest = std::min(lowest, vertex.position.z());
    if (vertex.position.z() > 5e-3f) continue;
    wide = std::max(wide, std::abs(vertex.position.y()));
    thick = std::max(thick, std::abs(vertex.position.x()));
    EXPECT_GT(vertex.normal.head<2>().dot(vertex.position.head<2>()), -1e-9f) << "inside out";
  }
  EXPECT_NEAR(lowest, -1.5e-3f, 1e-6f);
  EXPECT_NEAR(wide, 1.5e-3f, 1e-6f);
  EXPECT_LT(thick, 0.5f * wide);
}

TEST(InstrumentMeshTest, JawsMeetAtTheTipWhenClosedAndPartWhenOpen) {
  const auto gap_at_tip = [](double jaw) {
    InstrumentView view = instrument(Kind::kGrasper);
    view.jaw = jaw;
    float nearest = 1.0f;
    for (const InstrumentVertex& vertex : make_instrument(view).vertices) {
      if (vertex.position.z() < 5e-3f) nearest = std::min(nearest, std::abs(vertex.position.x()));
    }
    return nearest;
  };
  EXPECT_LT(gap_at_tip(0.0), 1e-4f);
  EXPECT_GT(gap_at_tip(1.0), 4e-3f);
  EXPECT_GT(gap_at_tip(1.0), gap_at_tip(0.5));
}

TEST(InstrumentMeshTest, GivenMeshIsTakenAsItIs) {
  const TriangleSurface ball = test::icosphere(2e-3, 1);
  InstrumentView view = instrument(Kind::kMesh);
  view.mesh = &ball;
  const InstrumentMesh mesh = make_instrument(view);
  EXPECT_EQ(mesh.vertices.size(), ball.vertices.size());
  EXPECT_EQ(mesh.indices.size(), 3 * ball.triangles.size());
}

}  // namespace
}  // namespace viscera
