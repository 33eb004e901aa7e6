#include "engine/render/vessel_pattern.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "kernels/base/random.h"
#include "kernels/base/types.h"

namespace viscera {
namespace {

using Vec2f = Eigen::Vector2f;

/// All lengths are shares of the square's edge.
struct Growth {
  int roots = 4;
  int sinks = 1500;  ///< points that want blood
  float step = 0.006f;
  float sight = 0.12f;   ///< a sink draws the nearest vessel within this
  float fed = 0.014f;    ///< a sink is fed by a vessel this near
  int fork_every = 5;    ///< steps from one fork to the next, at least
  float wander = 0.55f;  ///< sideways share of a step
  float twig = 0.0006f;  ///< half width of the last branches
  std::uint64_t seed = 1;
};

struct Node {
  Vec2f at;
  int parent = -1;
  float radius = 0.0f;
  int branches = 0;
  int run = 0;  // nodes since the last fork
};

/// From a to b the short way round.
Vec2f between(const Vec2f& a, const Vec2f& b) {
  Vec2f d = b - a;
  return {d.x() - std::round(d.x()), d.y() - std::round(d.y())};
}

Vec2f wrapped(const Vec2f& p) {
  return {p.x() - std::floor(p.x()), p.y() - std::floor(p.y())};
}

std::vector<Node> grow(const Growth& growth) {
  std::vector<Node> nodes;
  const Random random(growth.seed, 0);
  std::uint64_t drawn = 0;
  const auto next = [&] { return static_cast<float>(random.uniform(drawn++)); };
  const auto place = [&] {
    const float x = next();
    return Vec2f(x, next());
  };
  for (int i = 0; i < growth.roots; ++i) nodes.push_back({place()});
  struct Sink {
    Vec2f at;
    int nearest = -1;
    float distance = std::numeric_limits<float>::max();
  };
  std::vector<Sink> sinks;
  for (int i = 0; i < growth.sinks; ++i) sinks.push_back({place()});
  std::size_t seen = 0;  // nodes that the sinks know
  for (int round = 0; round < 400 && !sinks.empty(); ++round) {
    for (Sink& sink : sinks) {
      for (std::size_t n = seen; n < nodes.size(); ++n) {
        const float apart = between(nodes[n].at, sink.at).norm();
        if (apart < sink.distance) {
          sink.distance = apart;
          sink.nearest = static_cast<int>(n);
        }
      }
    }
    seen = nodes.size();
    std::erase_if(sinks, [&](const Sink& sink) { return sink.distance < growth.fed; });
    std::vector<Vec2f> pull(nodes.size(), Vec2f::Zero());
    // Until the first vessels have come near, every sink draws.
    const float sight = round < 30 ? 1.0f : growth.sight;
    for (const Sink& sink : sinks) {
      if (sink.distance > sight) continue;
      const auto n = static_cast<std::size_t>(sink.nearest);
      pull[n] += between(nodes[n].at, sink.at).normalized();
    }
    for (std::size_t n = 0; n < pull.size(); ++n) {
      // Vessels fork in two, no more, and not again at once; a root is the end of a trunk.
      const bool forks = nodes[n].branches == 1;
      if (pull[n].norm() < 1e-3f || nodes[n].branches == 2) continue;
      if (forks && (nodes[n].parent < 0 || nodes[n].run < growth.fork_every)) continue;
      ++nodes[n].branches;
      const Vec2f ahead = pull[n].normalized();
      const float aside = growth.wander * (2.0f * next() - 1.0f);
      const Vec2f way = (ahead + aside * Vec2f(-ahead.y(), ahead.x())).normalized();
      Node next_node{wrapped(nodes[n].at + growth.step * way), static_cast<int>(n)};
      next_node.run = forks ? 0 : nodes[n].run + 1;
      nodes.push_back(next_node);
    }
  }
  // Children follow their parents: from the last to the first, every vessel knows what it feeds.
  std::vector<float> fed(nodes.size(), 0.0f);
  constexpr float kMurray = 2.7f;
  for (std::size_t n = nodes.size(); n-- > 0;) {
    nodes[n].radius = std::max(growth.twig, std::pow(fed[n], 1.0f / kMurray));
    if (nodes[n].parent >= 0)
      fed[static_cast<std::size_t>(nodes[n].parent)] += std::pow(nodes[n].radius, kMurray);
  }
  return nodes;
}

void draw(const std::vector<Node>& nodes, std::size_t channel, VesselPattern& pattern) {
  const auto edge = static_cast<float>(pattern.edge);
  for (const Node& node : nodes) {
    if (node.parent < 0) continue;
    const Vec2f a = edge * node.at;
    const Vec2f ab = edge * between(node.at, nodes[static_cast<std::size_t>(node.parent)].at);
    const float radius = edge * node.radius;
    const float reach = radius + 1.0f;
    const Vec2f low = a.cwiseMin(a + ab).array() - reach, high = a.cwiseMax(a + ab).array() + reach;
    for (int y = static_cast<int>(std::floor(low.y())); y <= static_cast<int>(high.y()); ++y) {
      for (int x = static_cast<int>(std::floor(low.x())); x <= static_cast<int>(high.x()); ++x) {
        const Vec2f from_a = Vec2f(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f) - a;
        const float along = std::clamp(from_a.dot(ab) / ab.squaredNorm(), 0.0f, 1.0f);
        const float apart = (from_a - along * ab).norm();
        // A vessel thinner than a texel covers a part of it; thin ones lie deeper under the skin.
        const float most = std::min(1.0f, 0.12f + 0.75f * radius);
        const float cover = std::clamp(radius + 0.5f - apart, 0.0f, most);
        const auto row = static_cast<std::size_t>((y + pattern.edge) % pattern.edge);
        const auto column = static_cast<std::size_t>((x + pattern.edge) % pattern.edge);
        std::uint8_t& texel =
            pattern.coverage[2 * (row * static_cast<std::size_t>(pattern.edge) + column) + channel];
        texel = std::max(texel, static_cast<std::uint8_t>(std::lround(255.0f * cover)));
      }
    }
  }
}

}  // namespace

VesselPattern grow_vessels(int edge) {
  VesselPattern pattern;
  pattern.edge = edge;
  pattern.coverage.assign(2 * static_cast<std::size_t>(edge) * static_cast<std::size_t>(edge), 0);
  draw(grow({.roots = 4, .sinks = 1100, .twig = 0.0006f, .seed = 11}), 0, pattern);
  draw(grow({.roots = 3, .sinks = 420, .fed = 0.02f, .wander = 0.4f, .twig = 0.0011f, .seed = 29}),
       1, pattern);
  return pattern;
}

}  // namespace viscera
