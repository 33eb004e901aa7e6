#include "kernels/contact/touchable_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>

#include "kernels/base/parallel.h"

namespace viscera {
namespace {

/// A piece of a triangle no wider than half the node spacing.
struct Piece {
  Vec3 centroid;
  Vec3 area_vector;
  std::array<std::int64_t, 5> key;  // pieces of one key become one sample
};

double spacing_from(const ShapeValues& values, const PointCloud& cloud) {
  double h = 0.0;
  for (std::size_t i = 0; i < values.nodes.size(); ++i) {
    h += values.values[i] * cloud.spacings[static_cast<std::size_t>(values.nodes[i])];
  }
  return h;
}

std::unexpected<Error> uncovered(const Vec3& x) {
  char text[240];
  std::snprintf(
      text, sizeof text,
      "touchable surface at (%.2f, %.2f, %.2f mm): found no fields that cover it, expected "
      "at least four nodes in general position in reach; make the node spacing finer there",
      1e3 * x.x(), 1e3 * x.y(), 1e3 * x.z());
  return failure(text);
}

/// Voxel of about half a spacing, and the way the surface faces: neighbours that share both are
/// sampled together, the two sides of a thin wall never.
std::array<std::int64_t, 5> sample_key(const Vec3& x, const Vec3& normal, double h) {
  const int level = static_cast<int>(std::lround(std::log2(0.5 * h)));
  const double edge = std::ldexp(1.0, level);
  int axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  // The grid is moved by an odd share of a voxel: flat faces at round coordinates stay whole.
  const Vec3 at = x / edge + Vec3(0.317, 0.421, 0.283);
  return {
      level, 2 * axis + (normal[axis] > 0.0 ? 1 : 0), static_cast<std::int64_t>(std::floor(at.x())),
      static_cast<std::int64_t>(std::floor(at.y())), static_cast<std::int64_t>(std::floor(at.z()))};
}

/// Splits a triangle into n x n pieces of equal area.
void split_triangle(const std::array<Vec3, 3>& corner, int n, double h, std::vector<Piece>& out) {
  const Vec3 u = (corner[1] - corner[0]) / n, v = (corner[2] - corner[0]) / n;
  const Vec3 area_vector = 0.5 * u.cross(v);
  const double area = area_vector.norm();
  if (area <= 0.0) return;
  const Vec3 normal = area_vector / area;
  const auto add = [&](const Vec3& centroid) {
    out.push_back({centroid, area_vector, sample_key(centroid, normal, h)});
  };
  for (int i = 0; i < n; ++i) {
    for (int j = 0; i + j < n; ++j) {
      const Vec3 base = corner[0] + i * u + j * v;
      add(base + (u + v) / 3.0);
      if (i + j + 1 < n) add(base + (u + v) * (2.0 / 3.0));
    }
  }
}

/// Pieces of one key merged into samples; the order is that of the keys.
void merge_pieces(std::vector<Piece>& pieces, TouchableSurface& out) {
  std::stable_sort(pieces.begin(), pieces.end(),
                   [](const Piece& a, const Piece& b) { return a.key < b.key; });
  for (std::size_t begin = 0; begin < pieces.size();) {
    Vec3 moment = Vec3::Zero(), area_vector = Vec3::Zero();
    double area = 0.0;
    std::size_t end = begin;
    for (; end < pieces.size() && pieces[end].key == pieces[begin].key; ++end) {
      const double a = pieces[end].area_vector.norm();
      moment += a * pieces[end].centroid;
      area_vector += pieces[end].area_vector;
      area += a;
    }
    out.positions.push_back(moment / area);
    out.normals.push_back(area_vector.normalized());
    out.areas.push_back(area);
    begin = end;
  }
}

int flat_index(const Eigen::Vector3i& cell, const Eigen::Vector3i& cells) {
  return (cell.z() * cells.y() + cell.y()) * cells.x() + cell.x();
}

Eigen::Vector3i cell_of(const TouchableSurface& surface, const Vec3& x) {
  const Vec3 place = (x - surface.box.min()) / surface.cell;
  Eigen::Vector3i cell;
  for (int a = 0; a < 3; ++a) {
    cell[a] = static_cast<int>(
        std::clamp(std::floor(place[a]), 0.0, static_cast<double>(surface.cells[a] - 1)));
  }
  return cell;
}

void build_grid(TouchableSurface& out) {
  double spacing = 0.0;
  for (const Vec3& x : out.positions) out.box.extend(x);
  for (const double h : out.spacings) spacing += h;
  // About a spreading radius wide, but never more cells than a body's surface has use for.
  const double mean = 2.0 * spacing / static_cast<double>(out.size());
  out.cell = std::max(mean, out.box.sizes().maxCoeff() / 100.0);
  for (int a = 0; a < 3; ++a) {
    out.cells[a] = 1 + static_cast<int>(std::floor(out.box.sizes()[a] / out.cell));
  }
  std::vector<int> cell_of_sample(out.size());
  out.cell_begin.assign(static_cast<std::size_t>(out.cells.prod()) + 1, 0);
  for (std::size_t i = 0; i < out.size(); ++i) {
    cell_of_sample[i] = flat_index(cell_of(out, out.positions[i]), out.cells);
    ++out.cell_begin[static_cast<std::size_t>(cell_of_sample[i]) + 1];
  }
  for (std::size_t c = 1; c < out.cell_begin.size(); ++c)
    out.cell_begin[c] += out.cell_begin[c - 1];
  std::vector<int> next(out.cell_begin.begin(), out.cell_begin.end() - 1);
  out.cell_items.resize(out.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    auto& place = next[static_cast<std::size_t>(cell_of_sample[i])];
    out.cell_items[static_cast<std::size_t>(place++)] = static_cast<int>(i);
  }
}

/// Calls visit(sample, squared distance) for samples nearer than radius, in a fixed order.
template <class Visit>
void samples_within(const TouchableSurface& surface, const Vec3& x, double radius,
                    const Visit& visit) {
  const Eigen::Vector3i low = cell_of(surface, x - Vec3::Constant(radius));
  const Eigen::Vector3i high = cell_of(surface, x + Vec3::Constant(radius));
  for (int k = low.z(); k <= high.z(); ++k) {
    for (int j = low.y(); j <= high.y(); ++j) {
      for (int i = low.x(); i <= high.x(); ++i) {
        const auto c = static_cast<std::size_t>(flat_index({i, j, k}, surface.cells));
        for (int at = surface.cell_begin[c]; at < surface.cell_begin[c + 1]; ++at) {
          const int sample = surface.cell_items[static_cast<std::size_t>(at)];
          const double d2 = (surface.positions[static_cast<std::size_t>(sample)] - x).squaredNorm();
          if (d2 < radius * radius) visit(sample, d2);
        }
      }
    }
  }
}

int nearest_sample(const TouchableSurface& surface, const Vec3& x) {
  int nearest = -1;
  double least = 0.0;
  // Something is always found once the ball holds the box.
  const double outside = surface.box.exteriorDistance(x);
  for (double radius = outside + surface.cell; nearest < 0; radius *= 2.0) {
    samples_within(surface, x, radius, [&](int sample, double d2) {
      if (nearest < 0 || d2 < least || (d2 == least && sample < nearest)) {
        nearest = sample;
        least = d2;
      }
    });
  }
  return nearest;
}

/// (1 - (r / R)^2)^3 with R = kReach sigma: nearly a Gaussian, of finite reach and without a step
/// at its end. kReach is such that the load's own mean displacement on a half-space,
/// proportional to the integral of its squared transform, is that of the Gaussian of the closed
/// forms of NearField (computed: 3.162 would match the variance, and miss that by 3.3 %).
constexpr double kReach = 3.058;

/// 0 for samples that face away, 1 for those within 60 degrees.
double facing(double cosine) {
  const double t = std::clamp(2.0 * cosine, 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

}  // namespace

Result<TouchableSurface> sample_touchable_surface(
    const TriangleSurface& surface, const std::function<bool(const Vec3&)>& is_touchable,
    const ShapeFunctions& fields, std::vector<int>& touchable_nodes) {
  const PointCloud& cloud = fields.cloud();
  ShapeValues values;
  std::vector<Piece> pieces;
  for (const auto& triangle : surface.triangles) {
    std::array<Vec3, 3> corner;
    for (std::size_t a = 0; a < 3; ++a) {
      corner[a] = surface.vertices[static_cast<std::size_t>(triangle[a])];
    }
    const Vec3 centroid = (corner[0] + corner[1] + corner[2]) / 3.0;
    if (!is_touchable(centroid)) continue;
    if (!fields.evaluate(centroid, false, values)) return uncovered(centroid);
    const double h = spacing_from(values, cloud);
    const double longest = std::sqrt(
        std::max({(corner[1] - corner[0]).squaredNorm(), (corner[2] - corner[1]).squaredNorm(),
                  (corner[0] - corner[2]).squaredNorm()}));
    split_triangle(corner, std::max(1, static_cast<int>(std::ceil(longest / (0.5 * h)))), h,
                   pieces);
  }
  if (pieces.empty()) {
    return failure(
        "touchable surface: found none of " + std::to_string(surface.triangles.size()) +
        " triangles with its centroid in reach of the instruments, expected at least one");
  }

  TouchableSurface out;
  merge_pieces(pieces, out);

  std::vector<ShapeValues> at_sample(out.size());
  std::vector<char> covered(out.size());
  parallel_for_each_index(out.size(), 256, [&](std::size_t i) {
    covered[i] = fields.evaluate(out.positions[i], false, at_sample[i]);
  });
  touchable_nodes.clear();
  for (std::size_t i = 0; i < out.size(); ++i) {
    if (!covered[i]) return uncovered(out.positions[i]);
    touchable_nodes.insert(touchable_nodes.end(), at_sample[i].nodes.begin(),
                           at_sample[i].nodes.end());
  }
  std::sort(touchable_nodes.begin(), touchable_nodes.end());
  touchable_nodes.erase(std::unique(touchable_nodes.begin(), touchable_nodes.end()),
                        touchable_nodes.end());

  std::vector<int> column_of(cloud.size(), -1);
  for (std::size_t i = 0; i < touchable_nodes.size(); ++i) {
    column_of[static_cast<std::size_t>(touchable_nodes[i])] = static_cast<int>(i);
  }
  for (const ShapeValues& sample : at_sample) {
    out.spacings.push_back(spacing_from(sample, cloud));
    for (std::size_t i = 0; i < sample.nodes.size(); ++i) {
      out.weights.nodes.push_back(column_of[static_cast<std::size_t>(sample.nodes[i])]);
      out.weights.values.push_back(static_cast<float>(sample.values[i]));
    }
    out.weights.row_begin.push_back(static_cast<int>(out.weights.nodes.size()));
  }
  build_grid(out);
  return out;
}

double spacing_at(const TouchableSurface& surface, const Vec3& position) {
  const double h = surface.spacings[static_cast<std::size_t>(nearest_sample(surface, position))];
  const double radius2 = 9.0 * h * h;
  double sum = 0.0, weighted = 0.0;
  samples_within(surface, position, 3.0 * h, [&](int sample, double d2) {
    const auto s = static_cast<std::size_t>(sample);
    const double fall = 1.0 - d2 / radius2;
    const double weight = surface.areas[s] * fall * fall;
    sum += weight;
    weighted += weight * surface.spacings[s];
  });
  return sum > 0.0 ? weighted / sum : h;
}

bool spread_load(const TouchableSurface& surface, const Vec3& position, const Vec3& normal,
                 double sigma, std::vector<SampleShare>& shares) {
  shares.clear();
  const double reach = kReach * sigma;
  const Vec3 first = normal.unitOrthogonal(), second = normal.cross(first);
  const auto tangential = [&](int sample) {
    const Vec3 offset = surface.positions[static_cast<std::size_t>(sample)] - position;
    return Vec2(first.dot(offset), second.dot(offset));
  };

  double sum = 0.0;
  Vec2 moment = Vec2::Zero();
  Eigen::Matrix2d inertia = Eigen::Matrix2d::Zero();
  samples_within(surface, position, reach, [&](int sample, double d2) {
    const auto s = static_cast<std::size_t>(sample);
    const double fall = 1.0 - d2 / (reach * reach);
    const double share =
        surface.areas[s] * fall * fall * fall * facing(normal.dot(surface.normals[s]));
    if (share <= 0.0) return;
    const Vec2 offset = tangential(sample);
    sum += share;
    moment += share * offset;
    inertia += share * offset * offset.transpose();
    shares.push_back({sample, share});
  });
  if (shares.empty()) {
    shares.push_back({nearest_sample(surface, position), 1.0});
    return false;
  }

  // Samples are irregular, so the centre of the load strays a little from the cell, differently as
  // the cell slides: a linear factor brings it back. Where samples end (a border) it can't without
  // negative shares, so it is bounded there.
  const double ridge = 1e-6 * sum * sigma * sigma;
  Vec2 slope = (inertia + ridge * Eigen::Matrix2d::Identity()).ldlt().solve(moment);
  const double steepest = slope.norm() * reach;
  if (steepest > 0.5) slope *= 0.5 / steepest;
  double corrected = 0.0;
  for (SampleShare& share : shares) {
    share.share *= 1.0 - slope.dot(tangential(share.sample));
    corrected += share.share;
  }
  for (SampleShare& share : shares) share.share /= corrected;
  return true;
}

}  // namespace viscera
