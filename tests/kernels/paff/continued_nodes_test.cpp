// Which node of a body that is cut goes on as which.
#include "kernels/paff/continued_nodes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine/verification/cut_block.h"
#include "kernels/paff/true_neighbours.h"
#include "kernels/points/closed_pieces.h"

namespace viscera {
namespace {

constexpr double kSpacing = 5e-3, kSupport = 1.8, kGap = 0.5e-3;  // [m]

/// Slit across x = 0 from the top down to a height.
TriangleSurface slit(double down) {
  CutBlock block;
  block.slit_down_to(down, kSpacing, kGap);
  return block.surface;
}

TEST(ContinuedNodes, AreThemselvesAndTwinsComeFromTheirNodesOrFromTheTwinsThatWere) {
  const CutBlock block = CutBlock::whole(kSpacing, 3).value();
  const ShapeFunctions whole(block.surface, block.cloud, kSupport);
  const ShapeFunctions half(slit(0.0), block.cloud, kSupport);
  const ShapeFunctions deep(slit(-5e-3), block.cloud, kSupport);
  ASSERT_FALSE(whole.true_neighbours());
  const std::size_t own = block.cloud.size();
  ASSERT_GT(half.cloud().size(), own);
  ASSERT_GT(deep.cloud().size(), half.cloud().size());

  const std::vector<int> first = continued_nodes(whole, half), next = continued_nodes(half, deep);
  ASSERT_EQ(first.size(), half.cloud().size());
  ASSERT_EQ(next.size(), deep.cloud().size());
  for (std::size_t node = 0; node < own; ++node) {
    EXPECT_EQ(first[node], static_cast<int>(node));
    EXPECT_EQ(next[node], static_cast<int>(node));
  }
  std::size_t kept = 0;
  for (std::size_t twin = own; twin < first.size(); ++twin)
    EXPECT_EQ(first[twin], half.true_neighbours()->parent(twin - own));
  for (std::size_t twin = own; twin < next.size(); ++twin) {
    const int parent = deep.true_neighbours()->parent(twin - own);
    const auto from = static_cast<std::size_t>(next[twin]);
    if (from == static_cast<std::size_t>(parent)) continue;
    ASSERT_GE(from, own);
    EXPECT_EQ(half.true_neighbours()->parent(from - own), parent);
    ++kept;
  }
  // All of the first cut's twins are there, or nearly.
  EXPECT_GE(kept, (half.cloud().size() - own) * 9 / 10);
}

TEST(ContinuedNodes, CarryALinearFieldOverToAnyCut) {
  const CutBlock block = CutBlock::whole(kSpacing, 3).value();
  const ShapeFunctions half(slit(0.0), block.cloud, kSupport);
  const ShapeFunctions deep(slit(-5e-3), block.cloud, kSupport);
  const auto field = [](const Vec3& x) { return 0.3 * x.x() - 0.1 * x.y() + 0.7 * x.z(); };
  std::vector<double> before;
  for (const Vec3& x : half.cloud().positions) before.push_back(field(x));
  const std::vector<int> from = continued_nodes(half, deep);
  ShapeValues values;
  for (const Vec3& x : {Vec3(2e-3, 1e-3, 4e-3), Vec3(-2e-3, 1e-3, 4e-3), Vec3(1e-3, 0, -4e-3)}) {
    ASSERT_TRUE(deep.evaluate(x, false, values));
    double sum = 0.0;
    for (std::size_t k = 0; k < values.nodes.size(); ++k)
      sum += values.values[k] *
             before[static_cast<std::size_t>(from[static_cast<std::size_t>(values.nodes[k])])];
    EXPECT_NEAR(sum, field(x), 1e-12);
  }
}

TEST(ContinuedNodes, BesideAPieceThatIsGoneGoOnAsWhatCarriedTheTissueThatIsLeft) {
  CutBlock block = CutBlock::whole(kSpacing, 3).value();
  TissueShare gone(CutBlock::kKerfVoxel);
  kSeveringKerfs[0].cut(gone);  // straight, across x = 0
  ASSERT_TRUE(block.take(gone, kSpacing));
  const std::vector<TriangleSurface> pieces = closed_pieces(block.surface);
  ASSERT_EQ(pieces.size(), 2u);
  const std::size_t kept = bounds(with_used_vertices(pieces[0])).center().x() < 0.0 ? 0 : 1;
  const TriangleSurface left = with_used_vertices(pieces[kept]);
  const SurfaceTree tree(left), other(with_used_vertices(pieces[1 - kept]));
  PointCloud about;
  for (std::size_t node = 0; node < block.cloud.size(); ++node) {
    if (tree.signed_distance(block.cloud.positions[node]) > 1.15 * block.cloud.spacings[node])
      continue;
    about.positions.push_back(block.cloud.positions[node]);
    about.spacings.push_back(block.cloud.spacings[node]);
  }
  ASSERT_LT(about.size(), block.cloud.size());
  const ShapeFunctions before(block.surface, block.cloud, kSupport), now(left, about, kSupport);
  // What is of the other piece has gone far away; twins carry what is on the other side of their
  // nodes.
  const auto field = [](const Vec3& x) { return 0.3 * x.x() - 0.1 * x.y() + 0.7 * x.z(); };
  std::vector<double> moved;
  for (std::size_t node = 0; node < before.cloud().size(); ++node) {
    const Vec3& x = before.cloud().positions[node];
    const bool twin = node >= block.cloud.size();
    const Vec3& carried =
        twin ? before.true_neighbours()->place_of_twin(node - block.cloud.size()) : x;
    const bool gone_away = other.signed_distance(carried) < tree.signed_distance(carried);
    moved.push_back(field(x) + (gone_away ? 100.0 : 0.0));
  }
  const std::vector<int> from = continued_beside_gone_pieces(before, now, tree);
  ASSERT_EQ(from.size(), now.cloud().size());
  ShapeValues values;
  for (const Vec3& x : {Vec3(-0.4e-3, 1e-3, 4e-3), Vec3(-2e-3, -9e-3, -6e-3), Vec3(-7e-3, 3e-3, 0),
                        Vec3(-20e-3, 0, 4e-3)}) {
    ASSERT_TRUE(now.evaluate(x, false, values));
    double sum = 0.0;
    for (std::size_t k = 0; k < values.nodes.size(); ++k)
      sum += values.values[k] *
             moved[static_cast<std::size_t>(from[static_cast<std::size_t>(values.nodes[k])])];
    // Where a node had no twin the nearest place's own node stands for it: by a spacing or two.
    EXPECT_NEAR(sum, field(x), 0.7 * kSpacing) << x.transpose();
  }
}

}  // namespace
}  // namespace viscera
