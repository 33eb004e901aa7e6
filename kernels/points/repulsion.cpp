#include "kernels/points/repulsion.h"

#include <algorithm>
#include <cmath>

#include "kernels/base/parallel.h"
#include "kernels/points/kd_tree.h"
#include "kernels/points/neighbours.h"

namespace viscera {

namespace {

constexpr std::size_t kChunk = 256;
constexpr int kSweepsPerSearch = 5;  // nodes hardly change neighbours in between
constexpr int kSurfaceNeighbours = 12;
constexpr int kInsideNeighbours = 20;
constexpr double kRange = 1.5;         // neighbours nearer than this times h push
constexpr double kStep = 0.15;         // displacement per unit of push, in h
constexpr double kLongestStep = 0.15;  // in h

/// Where the neighbours of node i push it [m].
Vec3 push(const PlacedNodes& nodes, std::size_t i, std::span<const int> neighbours) {
  Vec3 sum = Vec3::Zero();
  for (const int j : neighbours) {
    if (j < 0) break;
    const Vec3 apart = nodes.positions[i] - nodes.positions[j];
    const double distance = apart.norm();
    const double s = 2.0 * distance / (kRange * (nodes.wanted[i] + nodes.wanted[j]));
    if (s >= 1.0 || distance == 0.0) continue;
    sum += (1.0 - s) * (1.0 - s) / s * apart / distance;
  }
  sum *= kStep;
  const double length = sum.norm();
  if (length > kLongestStep) sum *= kLongestStep / length;
  return nodes.wanted[i] * sum;
}

struct Place {
  Vec3 position;
  double wanted;
  double depth;
};

bool usable(double h) {
  return h > 0.0 && std::isfinite(h);
}

Place slide(const PlacementTask& task, const Place& from, const Vec3& step) {
  const Vec3 x = task.tree.closest(from.position + step).position;
  const double h = task.spacing(x);
  return usable(h) ? Place{x, h, 0.0} : from;
}

/// A step that would bring an interior node too near to the surface ends at the least depth; where
/// there is no such place, as in a thin wall, the node stays.
Place move_inside(const PlacementTask& task, const Place& from, const Vec3& step) {
  Place to{from.position + step, 0.0, from.depth - step.norm()};
  to.wanted = task.spacing(to.position);
  if (!usable(to.wanted)) return from;
  if (to.depth >= kDepthShare * to.wanted) return to;
  to.depth = -task.tree.signed_distance(to.position);
  const double needed = kDepthShare * to.wanted;
  if (to.depth >= needed) return to;
  if (to.depth <= 0.0) return from;

  const Vec3 nearest = task.tree.closest(to.position).position;
  to.position = nearest + 1.01 * needed / to.depth * (to.position - nearest);
  to.wanted = task.spacing(to.position);
  if (!usable(to.wanted)) return from;
  to.depth = -task.tree.signed_distance(to.position);
  return to.depth >= kDepthShare * to.wanted ? to : from;
}

/// Moves every node once, all from where they stood before.
void sweep(const PlacementTask& task, PlacedNodes& nodes, const std::vector<int>& neighbours,
           int k) {
  std::vector<Place> moved(nodes.positions.size());
  parallel_for_each_index(nodes.positions.size(), kChunk, [&](std::size_t i) {
    const Place from{nodes.positions[i], nodes.wanted[i], nodes.depths[i]};
    const bool on_surface = i < nodes.surface_count;
    const std::span<const int> own(neighbours.data() + i * k, static_cast<std::size_t>(k));
    const Vec3 step = push(nodes, i, own);
    moved[i] = on_surface ? slide(task, from, step) : move_inside(task, from, step);
  });
  for (std::size_t i = 0; i < moved.size(); ++i) {
    nodes.positions[i] = moved[i].position;
    nodes.wanted[i] = moved[i].wanted;
    nodes.depths[i] = moved[i].depth;
  }
}

Result<void> relax(const PlacementTask& task, PlacedNodes& nodes, int k, const Progress& progress) {
  std::vector<int> neighbours;
  for (int i = 0; i < task.options.sweeps; ++i) {
    if (!progress(static_cast<double>(i) / task.options.sweeps, "relaxing nodes")) {
      return failure(kCancelled);
    }
    if (i % kSweepsPerSearch == 0) neighbours = nearest_neighbours(nodes.positions, k);
    sweep(task, nodes, neighbours, k);
  }
  return {};
}

}  // namespace

Result<void> relax_surface(const PlacementTask& task, PlacedNodes& nodes) {
  return relax(task, nodes, kSurfaceNeighbours, no_progress());
}

Result<void> relax_all(const PlacementTask& task, PlacedNodes& nodes, const Progress& progress) {
  return relax(task, nodes, kInsideNeighbours, progress);
}

void separate(double share, PlacedNodes& nodes) {
  constexpr int kNeighbours = 8;
  for (bool removed = true; removed;) {
    removed = false;
    const std::size_t count = nodes.positions.size();
    const std::vector<int> neighbours = nearest_neighbours(nodes.positions, kNeighbours);
    std::vector<char> gone(count, 0);
    // Nodes stand in the order of their rank, so that the later of a pair goes.
    for (std::size_t i = 0; i < count; ++i) {
      for (int n = 0; n < kNeighbours && !gone[i]; ++n) {
        const int j = neighbours[i * kNeighbours + n];
        if (j < 0 || gone[j]) continue;
        const double distance = (nodes.positions[i] - nodes.positions[j]).norm();
        if (distance >= share * std::max(nodes.wanted[i], nodes.wanted[j])) continue;
        gone[std::max<std::size_t>(i, j)] = 1;
        removed = true;
      }
    }
    std::size_t kept = 0, kept_on_surface = 0;
    for (std::size_t i = 0; i < count; ++i) {
      if (gone[i]) continue;
      if (i < nodes.surface_count) ++kept_on_surface;
      nodes.positions[kept] = nodes.positions[i];
      nodes.wanted[kept] = nodes.wanted[i];
      nodes.depths[kept] = nodes.depths[i];
      ++kept;
    }
    nodes.positions.resize(kept);
    nodes.wanted.resize(kept);
    nodes.depths.resize(kept);
    nodes.surface_count = kept_on_surface;
  }
}

}  // namespace viscera
