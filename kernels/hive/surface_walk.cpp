#include "kernels/hive/surface_walk.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "kernels/points/closest_on_triangle.h"

namespace viscera {
namespace {

/// A walk that takes more triangles than this has lost its way: a tick must end.
constexpr int kMostSteps = 512;

}  // namespace

Result<WalkableSurface> WalkableSurface::make(TriangleSurface surface) {
  WalkableSurface out;
  out.surface_ = std::move(surface);
  const auto& triangles = out.surface_.triangles;
  const std::size_t vertices = out.surface_.vertices.size();
  if (triangles.empty()) return failure("surface: found no triangles, expected some to walk on");
  struct Edge {
    int low, high, triangle, corner;
    bool forward;
  };
  std::vector<Edge> edges;
  out.ring_begin_.assign(vertices + 1, 0);
  double length = 0.0;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (int a = 0; a < 3; ++a) {
      const int from = triangles[t][static_cast<std::size_t>(a)];
      const int to = triangles[t][static_cast<std::size_t>((a + 1) % 3)];
      if (from < 0 || static_cast<std::size_t>(from) >= vertices)
        return failure("surface: triangle " + std::to_string(t) + " has corner " +
                       std::to_string(from) + ", expected one of " + std::to_string(vertices) +
                       " vertices");
      edges.push_back({std::min(from, to), std::max(from, to), static_cast<int>(t), a, from < to});
      ++out.ring_begin_[static_cast<std::size_t>(from) + 1];
    }
  }
  std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
    return std::tie(a.low, a.high, a.triangle) < std::tie(b.low, b.high, b.triangle);
  });
  out.across_.assign(triangles.size(), {-1, -1, -1});
  for (std::size_t i = 0; i < edges.size();) {
    std::size_t end = i + 1;
    while (end < edges.size() && edges[end].low == edges[i].low && edges[end].high == edges[i].high)
      ++end;
    const Edge& one = edges[i];
    const auto where = [&] {
      return "surface: edge between vertices " + std::to_string(one.low) + " and " +
             std::to_string(one.high);
    };
    if (end - i > 2)
      return failure(where() + " belongs to " + std::to_string(end - i) +
                     " triangles, expected one or two");
    if (end - i == 2) {
      const Edge& other = edges[i + 1];
      if (one.forward == other.forward)
        return failure(where() + ": its two triangles disagree on what is outside");
      out.across_[static_cast<std::size_t>(one.triangle)][static_cast<std::size_t>(one.corner)] =
          other.triangle;
      out.across_[static_cast<std::size_t>(other.triangle)]
                 [static_cast<std::size_t>(other.corner)] = one.triangle;
    }
    length += (out.surface_.vertices[static_cast<std::size_t>(one.low)] -
               out.surface_.vertices[static_cast<std::size_t>(one.high)])
                  .norm() *
              static_cast<double>(end - i);
    i = end;
  }
  out.mean_edge_ = length / static_cast<double>(edges.size());
  for (std::size_t v = 0; v < vertices; ++v) out.ring_begin_[v + 1] += out.ring_begin_[v];
  out.ring_.resize(3 * triangles.size());
  std::vector<int> next(out.ring_begin_.begin(), out.ring_begin_.end() - 1);
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (const int corner : triangles[t])
      out.ring_[static_cast<std::size_t>(next[static_cast<std::size_t>(corner)]++)] =
          static_cast<int>(t);
  out.normals_ = vertex_normals(out.surface_);
  return out;
}

WalkEnd WalkableSurface::walk(std::span<const Vec3> vertices, std::span<const Vec3> vertex_normals,
                              const Vec3& tip, double reach, SurfaceSpot& spot) const noexcept {
  if (!spot.on_surface() || !tip.allFinite()) return WalkEnd::kLost;
  const auto corner_of = [&](int triangle, std::size_t a) {
    return static_cast<std::size_t>(surface_.triangles[static_cast<std::size_t>(triangle)][a]);
  };
  SurfacePoint best;
  double least = std::numeric_limits<double>::infinity();
  const auto look_at = [&](int triangle) {
    const Vec3 &a = vertices[corner_of(triangle, 0)], &b = vertices[corner_of(triangle, 1)],
               &c = vertices[corner_of(triangle, 2)];
    const Vec3 weights = closest_weights(tip, a, b, c);
    const double distance2 = (weights[0] * a + weights[1] * b + weights[2] * c - tip).squaredNorm();
    // Neighbours share the nearest place on an edge up to round-off, which must not lead in
    // circles.
    if (!(distance2 < least - 1e-14 * (least < 1e300 ? least : 0.0))) return;
    least = distance2;
    best = {triangle, weights};
  };
  look_at(spot.point.triangle);
  if (best.triangle < 0) return WalkEnd::kLost;
  for (int step = 0;; ++step) {
    if (step == kMostSteps) return WalkEnd::kLost;
    const SurfacePoint here = best;
    const int zeros = static_cast<int>((here.weights.array() == 0.0).count());
    for (std::size_t a = 0; a < 3; ++a) {
      if (zeros == 1 && here.weights[static_cast<Eigen::Index>(a)] == 0.0) {
        const int other = across_[static_cast<std::size_t>(here.triangle)][(a + 1) % 3];
        if (other >= 0) look_at(other);
      }
      if (zeros == 2 && here.weights[static_cast<Eigen::Index>(a)] != 0.0) {
        const std::size_t vertex = corner_of(here.triangle, a);
        for (int i = ring_begin_[vertex]; i < ring_begin_[vertex + 1]; ++i)
          look_at(ring_[static_cast<std::size_t>(i)]);
      }
    }
    if (best.triangle != here.triangle) continue;
    // Seen from inside, every face of a ball has a place that is nearest to its surroundings: look
    // a little farther before believing it.
    for (std::size_t a = 0; a < 3; ++a) {
      const std::size_t vertex = corner_of(here.triangle, a);
      for (int i = ring_begin_[vertex]; i < ring_begin_[vertex + 1]; ++i)
        look_at(ring_[static_cast<std::size_t>(i)]);
    }
    if (best.triangle == here.triangle) break;
  }
  if (!(least <= reach * reach)) return WalkEnd::kLost;
  const std::span<const Vec3> normals =
      vertex_normals.empty() ? std::span<const Vec3>(normals_) : vertex_normals;
  spot.point = best;
  spot.position.setZero();
  spot.normal.setZero();
  for (std::size_t a = 0; a < 3; ++a) {
    const double weight = best.weights[static_cast<Eigen::Index>(a)];
    spot.position += weight * vertices[corner_of(best.triangle, a)];
    spot.normal += weight * normals[corner_of(best.triangle, a)];
  }
  spot.normal.normalize();
  return WalkEnd::kFound;
}

WalkEnd WalkableSurface::straight(const Vec3& along, SurfaceSpot& spot) const noexcept {
  if (!spot.on_surface() || !along.allFinite()) return WalkEnd::kLost;
  int triangle = spot.point.triangle;
  Vec3 weights = spot.point.weights.cwiseMax(0.0);
  weights /= weights.sum();
  double left = along.norm();
  if (!(left > 0.0)) return WalkEnd::kFound;
  const auto corner = [&](int t, int a) -> const Vec3& {
    return surface_.vertices[static_cast<std::size_t>(
        surface_.triangles[static_cast<std::size_t>(t)][static_cast<std::size_t>(a % 3)])];
  };
  const auto normal_of = [&](int t) {
    return Vec3((corner(t, 1) - corner(t, 0)).cross(corner(t, 2) - corner(t, 0)).normalized());
  };
  Vec3 normal = normal_of(triangle);
  Vec3 direction = Quaternion::FromTwoVectors(spot.normal, normal) * Vec3(along / left);
  direction = (direction - direction.dot(normal) * normal).normalized();
  int entered = -1;  // edge, from its first corner
  for (int step = 0; step < kMostSteps; ++step) {
    // How fast the weights change along the direction.
    Vec3 rate;
    for (int a = 0; a < 3; ++a) {
      const Vec3 edge = corner(triangle, a + 2) - corner(triangle, a + 1);
      const Vec3 height = normal.cross(edge);
      rate[a] = height.dot(direction) / height.dot(corner(triangle, a) - corner(triangle, a + 1));
    }
    double way = std::numeric_limits<double>::infinity();
    int out = -1;  // corner whose weight ends: the edge opposite to it is crossed
    for (int a = 0; a < 3; ++a) {
      if ((a + 1) % 3 == entered || !(rate[a] < 0.0)) continue;
      const double s = std::max(0.0, -weights[a] / rate[a]);
      if (s < way) {
        way = s;
        out = a;
      }
    }
    if (out < 0 || way >= left) {
      weights = (weights + left * rate).cwiseMax(0.0);
      if (!weights.allFinite()) return WalkEnd::kLost;
      weights /= weights.sum();
      spot = at({triangle, weights});
      return WalkEnd::kFound;
    }
    left -= way;
    const Vec3 place_weights = weights + way * rate;
    const int first = (out + 1) % 3;
    const int other = across_[static_cast<std::size_t>(triangle)][static_cast<std::size_t>(first)];
    if (other < 0) return WalkEnd::kEdge;
    const Vec3 edge = (corner(triangle, first + 1) - corner(triangle, first)).normalized();
    const Vec3 next_normal = normal_of(other);
    // The part of the direction across the edge turns with the surface.
    const double ahead = direction.dot(edge);
    const double aside = std::sqrt(std::max(0.0, 1.0 - ahead * ahead));
    direction = ahead * edge + aside * edge.cross(next_normal);
    const auto& from = surface_.triangles[static_cast<std::size_t>(triangle)];
    const auto& into = surface_.triangles[static_cast<std::size_t>(other)];
    Vec3 next = Vec3::Zero();
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b)
        if (a != out && into[static_cast<std::size_t>(b)] == from[static_cast<std::size_t>(a)])
          next[b] = std::max(0.0, place_weights[a]);
    for (int b = 0; b < 3; ++b)
      if (into[static_cast<std::size_t>(b)] == from[static_cast<std::size_t>((first + 1) % 3)] &&
          into[static_cast<std::size_t>((b + 1) % 3)] == from[static_cast<std::size_t>(first)])
        entered = b;
    if (!(next.sum() > 0.0)) return WalkEnd::kLost;
    weights = next / next.sum();
    triangle = other;
    normal = next_normal;
  }
  return WalkEnd::kLost;
}

SurfaceSpot WalkableSurface::at(const SurfacePoint& point) const noexcept {
  SurfaceSpot spot;
  spot.point = point;
  spot.position.setZero();
  spot.normal.setZero();
  for (std::size_t a = 0; a < 3; ++a) {
    const auto vertex =
        static_cast<std::size_t>(surface_.triangles[static_cast<std::size_t>(point.triangle)][a]);
    const double weight = point.weights[static_cast<Eigen::Index>(a)];
    spot.position += weight * surface_.vertices[vertex];
    spot.normal += weight * normals_[vertex];
  }
  spot.normal.normalize();
  return spot;
}

SurfaceSpot WalkableSurface::nearest(const Vec3& tip) const noexcept {
  SurfacePoint best;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t t = 0; t < surface_.triangles.size(); ++t) {
    const auto& corners = surface_.triangles[t];
    const Vec3 &a = surface_.vertices[static_cast<std::size_t>(corners[0])],
               &b = surface_.vertices[static_cast<std::size_t>(corners[1])],
               &c = surface_.vertices[static_cast<std::size_t>(corners[2])];
    const Vec3 weights = closest_weights(tip, a, b, c);
    const double distance2 = (weights[0] * a + weights[1] * b + weights[2] * c - tip).squaredNorm();
    if (distance2 < least) {
      least = distance2;
      best = {static_cast<int>(t), weights};
    }
  }
  return best.triangle < 0 ? SurfaceSpot{} : at(best);
}

}  // namespace viscera
