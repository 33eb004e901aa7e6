#include "kernels/contact/surface_strains.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "kernels/points/kd_tree.h"

namespace viscera {
namespace {

/// A ring is made of the vertex that lies farthest out in each of these sectors.
constexpr std::size_t kSectors = 12;
/// Vertices nearest to a place among which its ring is sought: the drawn surface is finer than
/// nodes by no more.
constexpr int kMostSought = 400;
/// Where a ring of the wanted radius has too few vertices it is widened so often, by so much.
constexpr int kWidenings = 4;
constexpr double kWiden = 1.5;
constexpr std::size_t kFewest = 5;
/// Of two normals of one side: the cosine between them.
constexpr double kSameSide = 0.5;
/// A ring as flat as this knows no gradient across.
constexpr double kFlattest = 1e-2;

/// Vertices about a place, one a sector at most.
std::vector<int> ring_about(const std::vector<KdTree::Found>& near, double reach,
                            std::span<const Vec3f> vertices, std::span<const Vec3f> vertex_normals,
                            const Vec3& place, const Vec3& normal) {
  const Vec3 x = normal.unitOrthogonal(), y = normal.cross(x);
  std::array<int, kSectors> farthest;
  std::array<double, kSectors> distance;
  farthest.fill(-1);
  distance.fill(0.0);
  for (const KdTree::Found& one : near) {
    if (one.distance2 > reach * reach) break;
    const auto v = static_cast<std::size_t>(one.index);
    if (vertex_normals[v].cast<double>().dot(normal) < kSameSide) continue;
    const Vec3 off = vertices[v].cast<double>() - place;
    const double angle = std::atan2(off.dot(y), off.dot(x)) / (2.0 * std::numbers::pi) + 0.5;
    const auto sector =
        std::min(kSectors - 1, static_cast<std::size_t>(angle * static_cast<double>(kSectors)));
    if (one.distance2 <= distance[sector]) continue;
    distance[sector] = one.distance2;
    farthest[sector] = one.index;
  }
  std::vector<int> ring;
  for (const int v : farthest)
    if (v >= 0) ring.push_back(v);
  return ring;
}

}  // namespace

SurfaceGradients::SurfaceGradients(std::span<const Vec3f> vertices,
                                   std::span<const Vec3f> vertex_normals,
                                   std::span<const Vec3> places, std::span<const Vec3> normals,
                                   std::span<const double> reaches) {
  std::vector<Vec3> points;
  for (const Vec3f& v : vertices) points.push_back(v.cast<double>());
  const KdTree tree(points);
  std::vector<KdTree::Found> near;
  for (std::size_t p = 0; p < places.size(); ++p) {
    tree.nearest(places[p], kMostSought, -1, near);
    std::vector<int> ring;
    double reach = reaches[p];
    for (int i = 0; i <= kWidenings && ring.size() < kFewest; ++i, reach *= kWiden)
      ring = ring_about(near, reach, vertices, vertex_normals, places[p], normals[p]);
    if (ring.size() < kFewest) continue;

    const auto n = static_cast<Eigen::Index>(ring.size());
    Eigen::Matrix3Xd at(3, n);
    for (Eigen::Index k = 0; k < n; ++k)
      at.col(k) = points[static_cast<std::size_t>(ring[static_cast<std::size_t>(k)])];
    const Vec3 middle = at.rowwise().mean();
    at.colwise() -= middle;
    const Vec3 x = normals[p].unitOrthogonal(), y = normals[p].cross(x);
    Eigen::Matrix<double, 2, 3> across;
    across.row(0) = x.transpose();
    across.row(1) = y.transpose();
    const Eigen::Matrix2Xd flat = across * at;
    const Eigen::Matrix2d gram = flat * flat.transpose();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> spread(gram, Eigen::EigenvaluesOnly);
    if (!(spread.eigenvalues()[0] > kFlattest * spread.eigenvalues()[1])) continue;
    // Weights that give the columns of F, and so turned and scaled that these are orthonormal at
    // rest: the piece may be tilted against the place's normal.
    Eigen::Matrix2Xd weights = gram.inverse() * flat;
    const Eigen::Matrix<double, 3, 2> rest = at * weights.transpose();
    const Eigen::Matrix2d metric = rest.transpose() * rest;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> root(metric);
    weights = root.operatorInverseSqrt() * weights;
    const Eigen::Matrix<double, 3, 2> frame = at * weights.transpose();
    frames_.push_back({frame.col(0).cast<float>(), frame.col(1).cast<float>(),
                       frame.col(0).cross(frame.col(1)).cast<float>(), middle.cast<float>()});
    double sum = 0.0;
    for (Eigen::Index k = 0; k < n; ++k) {
      vertices_.push_back(ring[static_cast<std::size_t>(k)]);
      weights_.push_back(weights.col(k).cast<float>());
      sum += weights.col(k).norm();
    }
    bound_ = std::max(bound_, sum);
    begin_.push_back(static_cast<int>(vertices_.size()));
  }
}

SurfaceStrains SurfaceGradients::greatest(std::span<const Vec3f> vertices) const {
  // F^T F = U^2, and U = (U^2 + det U) / sqrt(tr U^2 + 2 det U) by Cayley and Hamilton.
  float least_trace = 3.0f, greatest_stretch = 0.0f;
  SurfaceStrains strains;
  for (std::size_t s = 0; s < frames_.size(); ++s) {
    const auto first = static_cast<std::size_t>(begin_[s]);
    const auto last = static_cast<std::size_t>(begin_[s + 1]);
    // The weights of a ring sum up to zero: from one of its vertices the rest is as long as the
    // ring is wide, and single precision is enough.
    const Vec3f& origin = vertices[static_cast<std::size_t>(vertices_[first])];
    Vec3f fx = Vec3f::Zero(), fy = Vec3f::Zero();
    for (std::size_t e = first + 1; e < last; ++e) {
      const Vec3f off = vertices[static_cast<std::size_t>(vertices_[e])] - origin;
      fx += weights_[e].x() * off;
      fy += weights_[e].y() * off;
    }
    const float xx = fx.squaredNorm(), yy = fy.squaredNorm(), xy = fx.dot(fy);
    const float half = 0.5f * (xx + yy), apart = std::hypot(0.5f * (xx - yy), xy);
    const Frame& rest = frames_[s];
    const float stretch = std::max(std::abs(std::sqrt(half + apart) - 1.0f),
                                   std::abs(std::sqrt(std::max(0.0f, half - apart)) - 1.0f));
    if (stretch > greatest_stretch) {
      greatest_stretch = stretch;
      strains.stretched = rest.middle.cast<double>();
    }
    const float determinant = std::sqrt(std::max(0.0f, xx * yy - xy * xy));
    const float trace = std::sqrt(xx + yy + 2.0f * determinant);
    if (!(determinant > 0.0f)) continue;
    // R = F U^-1, with the inverse of a symmetric matrix of two rows.
    const float uxx = (xx + determinant) / trace, uyy = (yy + determinant) / trace,
                uxy = xy / trace;
    const Vec3f rx = (uyy * fx - uxy * fy) / determinant, ry = (uxx * fy - uxy * fx) / determinant;
    const float turned = rx.dot(rest.x) + ry.dot(rest.y) + rx.cross(ry).dot(rest.normal);
    if (turned < least_trace) {
      least_trace = turned;
      strains.rotated = rest.middle.cast<double>();
    }
  }
  strains.rotation =
      std::acos(std::clamp(0.5 * (static_cast<double>(least_trace) - 1.0), -1.0, 1.0));
  strains.stretch = greatest_stretch;
  return strains;
}

}  // namespace viscera
