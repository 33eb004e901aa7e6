#include "engine/organ/wrap.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/io/distance_grid.h"
#include "engine/organ/figures_text.h"
#include "engine/organ/shape.h"
#include "kernels/base/disjoint_sets.h"
#include "kernels/base/parallel.h"
#include "kernels/points/surface_checks.h"
#include "kernels/points/surface_tree.h"
#include "kernels/points/winding_number.h"

namespace viscera {
namespace {

constexpr double kLeastVoxels = 8.0;   // across the body
constexpr double kGreatestBare = 0.1;  // share of the area that may lie outside as a bare sheet
constexpr double kWideHole = 10.0;     // voxels
constexpr int kBandVoxels = 3;         // beyond the closing radius

// Triangles that have corners and an extent.
TriangleSurface usable(const TriangleSurface& original) {
  TriangleSurface surface;
  surface.vertices = original.vertices;
  for (const auto& [a, b, c] : original.triangles) {
    if (a == b || b == c || c == a) continue;
    surface.triangles.push_back({a, b, c});
  }
  return surface;
}

double close_of(const WrapOptions& options) {
  return std::max(options.close, 2.0 * options.voxel);
}

// Whether each grid point can be reached from the border along points farther than `radius` from
// the triangles.
std::vector<char> reached_from_outside(const DistanceGrid& distance, double radius) {
  std::vector<char> outside(distance.values.size(), 0);
  std::vector<std::size_t> stack;
  const auto visit = [&](std::size_t v) {
    if (outside[v] || distance.values[v] <= radius) return;
    outside[v] = 1;
    stack.push_back(v);
  };
  visit(0);  // the margin keeps every border point far from the triangles
  const std::size_t x = distance.size.x(), y = distance.size.y(), z = distance.size.z();
  while (!stack.empty()) {
    const std::size_t v = stack.back();
    stack.pop_back();
    const std::size_t i = v % x, j = v / x % y, k = v / (x * y);
    if (i > 0) visit(v - 1);
    if (i + 1 < x) visit(v + 1);
    if (j > 0) visit(v - x);
    if (j + 1 < y) visit(v + x);
    if (k > 0) visit(v - x * y);
    if (k + 1 < z) visit(v + x * y);
  }
  return outside;
}

// Distance to the border of the region that winding numbers call inside, by their value and slope
// on a grid twice as coarse; winding numbers are smooth away from the triangles.
DistanceGrid winding_distance(const TriangleSurface& surface, const DistanceGrid& like) {
  const WindingNumber winding(surface);
  DistanceGrid coarse;
  coarse.voxel = 2.0 * like.voxel;
  coarse.origin = like.origin;
  coarse.size = (like.size + Eigen::Vector3i::Ones()) / 2 + Eigen::Vector3i::Ones();
  coarse.values.resize(static_cast<std::size_t>(coarse.size.x()) * coarse.size.y() *
                       coarse.size.z());
  const std::size_t x = coarse.size.x(), xy = x * coarse.size.y();
  const auto index = [&](std::size_t v) {
    return Eigen::Vector3i(static_cast<int>(v % x), static_cast<int>(v % xy / x),
                           static_cast<int>(v / xy));
  };
  parallel_for_each_index(coarse.values.size(), 512, [&](std::size_t v) {
    const Eigen::Vector3i i = index(v);
    coarse.values[v] = static_cast<float>(winding(coarse.point(i.x(), i.y(), i.z())));
  });
  // Patches that all turn inwards wind the other way.
  const auto more = std::ranges::count_if(coarse.values, [](float w) { return w > 0.5f; });
  const auto less = std::ranges::count_if(coarse.values, [](float w) { return w < -0.5f; });
  if (less > more) {
    for (float& w : coarse.values) w = -w;
  }
  DistanceGrid distance = coarse;
  const auto limit = static_cast<float>(6.0 * coarse.voxel);
  parallel_for_each_index(coarse.values.size(), 512, [&](std::size_t v) {
    const Eigen::Vector3i i = index(v);
    double slope2 = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3i low = (i - Eigen::Vector3i::Unit(axis)).cwiseMax(0);
      const Eigen::Vector3i high =
          (i + Eigen::Vector3i::Unit(axis)).cwiseMin(coarse.size - Eigen::Vector3i::Ones());
      const double difference = coarse.values[coarse.at(high.x(), high.y(), high.z())] -
                                coarse.values[coarse.at(low.x(), low.y(), low.z())];
      slope2 += std::pow(difference / ((high[axis] - low[axis]) * coarse.voxel), 2);
    }
    const double by = (0.5 - coarse.values[v]) / std::sqrt(std::max(slope2, 1e-12));
    distance.values[v] = std::clamp(static_cast<float>(by), -limit, limit);
  });
  return distance;
}

// The body as a signed distance, its border on the outermost triangles.
Result<DistanceGrid> closed_body(const DistanceGrid& distance, double radius,
                                 const DistanceGrid* winding) {
  const std::vector<char> outside = reached_from_outside(distance, radius);
  DistanceGrid field = distance;
  const std::size_t x = field.size.x(), xy = x * field.size.y();
  const auto deep = static_cast<float>(-radius);
  for (std::size_t v = 0; v < field.values.size(); ++v) {
    float& value = field.values[v];
    value = outside[v] ? value - static_cast<float>(radius)
                       : std::min(value - static_cast<float>(radius), -1e-3f * float(radius));
    if (!outside[v] && distance.values[v] > radius) value = deep;
    if (!winding) continue;
    const Vec3 at = field.point(static_cast<int>(v % x), static_cast<int>(v % xy / x),
                                static_cast<int>(v / xy));
    value = std::min(value, static_cast<float>((*winding)(at)-radius));
  }
  const double beyond = kBandVoxels * field.voxel;
  auto body = distance_to_zero_set(field, beyond, radius + beyond);
  if (!body) return body;
  for (float& value : body->values) value += static_cast<float>(radius);
  return body;
}

// Share of the original's area that has no body on either side: sheets that the outside has got
// behind.
double sheet_share(const TriangleSurface& original, const DistanceGrid& body) {
  std::vector<char> sheet(original.triangles.size());
  parallel_for_each_index(sheet.size(), 256, [&](std::size_t t) {
    const auto& [a, b, c] = original.triangles[t];
    const Vec3 middle = (original.vertices[a] + original.vertices[b] + original.vertices[c]) / 3.0;
    const Vec3 step = 0.75 * body.voxel * area_vector(original, static_cast<int>(t)).normalized();
    sheet[t] = std::min(body(middle + step), body(middle - step)) > 0.0;
  });
  double whole = 0.0, bare = 0.0;
  for (std::size_t t = 0; t < sheet.size(); ++t) {
    const double area = area_vector(original, static_cast<int>(t)).norm();
    whole += area;
    if (sheet[t]) bare += area;
  }
  return whole > 0.0 ? bare / whole : 0.0;
}

// How much of the original sticks out of the wrap.
struct Bare {
  double share = 0.0;     // of the area, outside by more than `limit`
  double farthest = 0.0;  // [m]
  Vec3 place = Vec3::Zero();
};

template <class Distance>
Bare bare_area(const TriangleSurface& original, const Distance& signed_distance, double limit) {
  Bare bare;
  double whole = 0.0, out = 0.0;
  std::vector<double> distances(original.triangles.size());
  std::vector<Vec3> middles(original.triangles.size());
  parallel_for_each_index(original.triangles.size(), 256, [&](std::size_t t) {
    const auto& [a, b, c] = original.triangles[t];
    middles[t] = (original.vertices[a] + original.vertices[b] + original.vertices[c]) / 3.0;
    distances[t] = signed_distance(middles[t]);
  });
  for (std::size_t t = 0; t < original.triangles.size(); ++t) {
    const double area = area_vector(original, static_cast<int>(t)).norm();
    whole += area;
    if (distances[t] > limit) out += area;
    if (distances[t] > bare.farthest) bare.farthest = distances[t], bare.place = middles[t];
  }
  bare.share = whole > 0.0 ? out / whole : 0.0;
  return bare;
}

void measure_distances(Wrap& wrap, const TriangleSurface& original, double voxel) {
  const SurfaceTree tree(original);
  const TriangleSurface& surface = wrap.surface;
  std::vector<double> away(surface.vertices.size());
  parallel_for_each_index(away.size(), 64, [&](std::size_t v) {
    away[v] = tree.closest(surface.vertices[v]).distance;
  });
  const std::vector<double> areas = vertex_areas(surface);
  double sum = 0.0;
  for (std::size_t v = 0; v < away.size(); ++v) {
    sum += areas[v] * away[v];
    if (away[v] <= wrap.greatest_distance) continue;
    wrap.greatest_distance = away[v];
    wrap.farthest = surface.vertices[v];
  }
  wrap.mean_distance = sum / area(surface);

  // Neighbouring vertices that are far from the original lie on one bridge.
  DisjointSets bridges(away.size());
  const auto far = [&](int v) { return away[v] > 2.0 * voxel; };
  for (const auto& triangle : surface.triangles) {
    for (int i = 0; i < 3; ++i) {
      const int a = triangle[i], b = triangle[(i + 1) % 3];
      if (far(a) && far(b)) bridges.join(a, b);
    }
  }
  std::vector<int> farthest(away.size(), -1);
  for (int v = 0; v < static_cast<int>(away.size()); ++v) {
    int& best = farthest[bridges.root(v)];
    if (best < 0 || away[v] > away[best]) best = v;
  }
  for (const int v : farthest) {
    if (v < 0 || 2.0 * away[v] <= kWideHole * voxel) continue;
    wrap.holes.push_back({surface.vertices[v], 2.0 * away[v]});
  }
  std::ranges::stable_sort(wrap.holes, {}, [](const ClosedHole& hole) { return -hole.width; });
}

}  // namespace

std::vector<std::string> wrap_notes(const Wrap& wrap, const WrapOptions& options) {
  std::vector<std::string> notes;
  notes.push_back("wrapped at voxels of " + millimetres(options.voxel) +
                  ": distance from the original at most " + millimetres(wrap.greatest_distance) +
                  " at " + place_text(wrap.farthest) + ", " + millimetres(wrap.mean_distance) +
                  " in the mean");
  for (const ClosedHole& hole : wrap.holes) {
    notes.push_back("wrapping closed a gap about " + millimetres(hole.width) + " wide at " +
                    place_text(hole.place) + ", more than ten voxels");
  }
  if (wrap.filled) {
    notes.push_back("the surface is open: gaps wider than " + millimetres(close_of(options)) +
                    " were filled where it winds around a place by more than half");
  }
  if (wrap.lost_share > 0.0) {
    notes.push_back("wrapping lost " + short_number(100.0 * wrap.lost_share) +
                    " % of the original's area, sheets without thickness that stick out by up to " +
                    millimetres(wrap.greatest_lost) + " at " + place_text(wrap.lost_place));
  }
  return notes;
}

Result<Wrap> wrap_surface(const TriangleSurface& original, const WrapOptions& options) {
  const TriangleSurface triangles = usable(original);
  if (triangles.empty()) return failure("found no triangles to wrap");
  const Box box = bounds(triangles);
  const double size = box.sizes().maxCoeff(), voxel = options.voxel;
  if (!(voxel > 0.0) || size < kLeastVoxels * voxel) {
    return failure("found a voxel of " + millimetres(voxel) + " for a body of " +
                   millimetres(size) + ", expected at most an eighth of it");
  }
  const double radius = 0.5 * close_of(options);
  const double band = radius + kBandVoxels * voxel;
  const auto distance = unsigned_distance(triangles, voxel, band, band + 2.0 * voxel);
  if (!distance) return std::unexpected(distance.error());

  Wrap wrap;
  auto body = closed_body(*distance, radius, nullptr);
  if (!body) return std::unexpected(body.error());
  if (sheet_share(triangles, *body) > kGreatestBare) {
    const DistanceGrid winding = winding_distance(triangles, *distance);
    body = closed_body(*distance, radius, &winding);
    if (!body) return std::unexpected(body.error());
    wrap.filled = true;
  }

  const double edge = options.edge > 0.0 ? options.edge : 2.0 * voxel;
  Box around;
  around.extend(distance->origin + Vec3::Constant(voxel));
  around.extend(
      distance->point(distance->size.x() - 2, distance->size.y() - 2, distance->size.z() - 2));
  const SignedDistance field = [&body](const Vec3& x) { return (*body)(x); };
  auto surface = mesh_signed_distance(field, around, edge, voxel);
  if (!surface) {
    return failure("wrapping at voxels of " + millimetres(voxel) + ": " + surface.error().text() +
                   (wrap.filled ? ": the surface is open, and its patches don't turn alike; a "
                                  "greater close_mm may help"
                                : ""));
  }
  if (const auto defects = surface_defects(*surface); !defects.empty()) {
    return failure("wrapping at voxels of " + millimetres(voxel) + ": " + defects.front());
  }
  wrap.surface = std::move(*surface);
  measure_distances(wrap, triangles, voxel);
  const SurfaceTree tree(wrap.surface);
  const Bare lost = bare_area(
      triangles, [&tree](const Vec3& x) { return tree.signed_distance(x); }, voxel);
  if (lost.share > 0.5) {
    return failure("wrapping at voxels of " + millimetres(voxel) + " lost " +
                   short_number(100.0 * lost.share) +
                   " % of the surface's area: it is an open sheet with gaps wider than " +
                   millimetres(close_of(options)) +
                   " and encloses nothing; a greater close_mm "
                   "may help");
  }
  wrap.lost_share = lost.share;
  wrap.greatest_lost = lost.share > 0.0 ? lost.farthest : 0.0;
  wrap.lost_place = lost.place;
  return wrap;
}

}  // namespace viscera
