#include "kernels/paff/mean_dilatation.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "kernels/base/parallel.h"
#include "kernels/points/kd_tree.h"
#include "kernels/points/neighbours.h"

namespace viscera {
namespace {

constexpr std::size_t kTerms = 4;  // polynomials a cell

/// Least distance of two cells' seeds over the local spacing. A cell then spans some nine nodes:
/// four constraints for nearly thirty unknowns. At Poisson's ratio 0.499 a thick sphere errs half
/// as much again with 1.5; farther than 2, cells soften the body under narrow loads.
constexpr double kSeedDistance = 2.0;

/// Cell of each volume point: that of the nearest seed. Seeds are volume points, taken in their
/// order wherever none is near, so every cell holds what lies within half that distance of its seed
/// and none is a sliver.
std::vector<int> cells_of_points(const LocalSpacing& spacing, const VolumeQuadrature& volume,
                                 const TissuePaths* paths, int& cell_count) {
  std::vector<double> reach(volume.size());
  for (std::size_t q = 0; q < volume.size(); ++q) {
    reach[q] = kSeedDistance * spacing(volume.positions[q]);
  }
  const InfluenceGrid points(volume.positions, reach);
  std::vector<int> cell(volume.size(), -1), near;
  std::vector<double> distance(volume.size());
  cell_count = 0;
  for (std::size_t seed = 0; seed < volume.size(); ++seed) {
    if (cell[seed] >= 0) continue;
    points.reaching(volume.positions[seed], near);
    for (const int point : near) {
      const std::size_t q = static_cast<std::size_t>(point);
      const double to_seed = (volume.positions[q] - volume.positions[seed]).norm();
      if (cell[q] >= 0 && distance[q] <= to_seed) continue;
      if (paths && q != seed &&
          !paths->nearly_straight(volume.positions[seed], volume.positions[q]))
        continue;
      cell[q] = cell_count;
      distance[q] = to_seed;
    }
    ++cell_count;
  }
  return cell;
}

/// Polynomials 1 and, along the principal axes of the points of one cell, up to three linear ones,
/// orthonormal over those points; the others are zero.
struct CellPolynomials {
  Vec3 centre = Vec3::Zero();
  double constant = 0.0;       // [m^-1.5]
  Mat3 linear = Mat3::Zero();  // a row for each polynomial [m^-2.5]

  Vec4 at(const Vec3& y) const { return (Vec4() << constant, linear * (y - centre)).finished(); }
};

/// `points` of the volume and `held` of the fixed ones lie in the cell. Linear polynomials are left
/// out, the one along the thinnest direction first, where the points hardly spread, and where
/// sum_b w_b / beta_b psi psi^T over the fixed points exceeds 1/2: below 1, Nitsche's penalty
/// lambda beta outweighs the held traction of the averaged dilatation.
CellPolynomials cell_polynomials(const VolumeQuadrature& volume,
                                 std::span<const std::size_t> points, const HeldSurface& held,
                                 std::span<const std::size_t> held_points) {
  CellPolynomials out;
  double total = 0.0;
  for (const std::size_t q : points) {
    total += volume.weights[q];
    out.centre += volume.weights[q] * volume.positions[q];
  }
  out.centre /= total;
  out.constant = 1.0 / std::sqrt(total);
  Mat3 second = Mat3::Zero();
  for (const std::size_t q : points) {
    const Vec3 d = volume.positions[q] - out.centre;
    second += volume.weights[q] * d * d.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Mat3> axes(second);  // thinnest first
  constexpr double kLeastSpread = 0.1;                     // of the longest direction
  for (int k = 0; k < 3; ++k) {
    const double moment = axes.eigenvalues()[k];
    if (moment <= kLeastSpread * kLeastSpread * axes.eigenvalues()[2]) continue;
    out.linear.row(k) = axes.eigenvectors().col(k).transpose() / std::sqrt(moment);
  }
  for (int thinnest = 0; thinnest < 3; ++thinnest) {
    Eigen::Matrix4d load = Eigen::Matrix4d::Zero();
    for (const std::size_t b : held_points) {
      const std::size_t point = held.points[b];
      const Vec4 psi = out.at(held.surface.positions[point]);
      load += held.surface.weights[point] / held.penalty[b] * psi * psi.transpose();
    }
    if (Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d>(load, Eigen::EigenvaluesOnly)
            .eigenvalues()[3] < 0.5) {
      break;
    }
    out.linear.row(thinnest).setZero();
  }
  return out;
}

/// The volume point nearest to a place of the surface, of those that it sees.
int owner_of(const KdTree& volume_tree, const VolumeQuadrature& volume, const Vec3& place,
             const TissuePaths* paths) {
  constexpr int kAsked = 16;
  thread_local std::vector<KdTree::Found> found;
  volume_tree.nearest(place, paths ? kAsked : 1, -1, found);
  if (paths) {
    for (const KdTree::Found& one : found)
      if (paths->nearly_straight(volume.positions[static_cast<std::size_t>(one.index)], place))
        return one.index;
  }
  return found.front().index;
}

}  // namespace

MeanDilatation mean_dilatation(const LocalSpacing& spacing, std::size_t node_count,
                               const VolumeQuadrature& volume, const PointFields& volume_fields,
                               const HeldSurface& held, const TissuePaths* paths) {
  const SurfaceQuadrature& surface = held.surface;
  const PointFields& fixed_fields = held.fields;
  const std::span<const std::size_t> fixed = held.points;
  int cell_count = 0;
  MeanDilatation out;
  out.cell = cells_of_points(spacing, volume, paths, cell_count);
  const std::vector<int>& cell = out.cell;
  const std::size_t cells = static_cast<std::size_t>(cell_count);

  std::vector<std::vector<std::size_t>> points_of(cells), fixed_of(cells);
  for (std::size_t q = 0; q < volume.size(); ++q) {
    points_of[static_cast<std::size_t>(cell[q])].push_back(q);
  }
  out.terms = kTerms;
  out.first_row.resize(fixed.size());
  const KdTree volume_tree(volume.positions);
  for (std::size_t b = 0; b < fixed.size(); ++b) {
    const int nearest = owner_of(volume_tree, volume, surface.positions[fixed[b]], paths);
    const int owner = cell[static_cast<std::size_t>(nearest)];
    fixed_of[static_cast<std::size_t>(owner)].push_back(b);
    out.first_row[b] = kTerms * static_cast<std::size_t>(owner);
  }
  out.psi.resize(fixed.size() * kTerms);
  out.volume_psi.resize(volume.size() * kTerms);

  struct Part {
    std::vector<int> nodes;
    std::vector<Vec3> gradients, fluxes;  // (terms x nodes)
  };
  std::vector<Part> parts(cells);
  parallel_chunks(cells, 16, [&](std::size_t first, std::size_t last) {
    std::vector<int> place(node_count, -1);
    for (std::size_t c = first; c < last; ++c) {
      Part& part = parts[c];
      const auto gather = [&](const PointFields& fields, std::size_t point) {
        for (std::size_t e = fields.begin[point]; e < fields.begin[point + 1]; ++e) {
          int& at = place[static_cast<std::size_t>(fields.nodes[e])];
          if (at < 0) part.nodes.push_back(fields.nodes[e]);
          at = 0;
        }
      };
      for (const std::size_t q : points_of[c]) gather(volume_fields, q);
      for (const std::size_t b : fixed_of[c]) gather(fixed_fields, b);
      std::sort(part.nodes.begin(), part.nodes.end());
      const std::size_t width = part.nodes.size();
      for (std::size_t i = 0; i < width; ++i) {
        place[static_cast<std::size_t>(part.nodes[i])] = static_cast<int>(i);
      }
      part.gradients.assign(kTerms * width, Vec3::Zero());
      part.fluxes.assign(kTerms * width, Vec3::Zero());
      const CellPolynomials polynomials = cell_polynomials(volume, points_of[c], held, fixed_of[c]);
      for (const std::size_t q : points_of[c]) {
        Vec4::Map(out.volume_psi.data() + q * kTerms) = polynomials.at(volume.positions[q]);
        const Vec4 psi = volume.weights[q] * polynomials.at(volume.positions[q]);
        for (std::size_t e = volume_fields.begin[q]; e < volume_fields.begin[q + 1]; ++e) {
          const auto at =
              static_cast<std::size_t>(place[static_cast<std::size_t>(volume_fields.nodes[e])]);
          for (std::size_t k = 0; k < kTerms; ++k) {
            part.gradients[k * width + at] += psi[static_cast<int>(k)] * volume_fields.gradients[e];
          }
        }
      }
      for (const std::size_t b : fixed_of[c]) {
        const Vec4 psi = polynomials.at(surface.positions[fixed[b]]);
        const Vec3 area = surface.weights[fixed[b]] * surface.normals[fixed[b]];
        for (std::size_t k = 0; k < kTerms; ++k) {
          out.psi[b * kTerms + k] = psi[static_cast<int>(k)];
        }
        for (std::size_t e = fixed_fields.begin[b]; e < fixed_fields.begin[b + 1]; ++e) {
          const auto at =
              static_cast<std::size_t>(place[static_cast<std::size_t>(fixed_fields.nodes[e])]);
          for (std::size_t k = 0; k < kTerms; ++k) {
            part.fluxes[k * width + at] +=
                (psi[static_cast<int>(k)] * fixed_fields.values[e]) * area;
          }
        }
      }
      for (const int node : part.nodes) place[static_cast<std::size_t>(node)] = -1;
    }
  });
  for (Part& part : parts) {
    for (std::size_t k = 0; k < kTerms; ++k) {
      out.rows.nodes.insert(out.rows.nodes.end(), part.nodes.begin(), part.nodes.end());
      out.rows.begin.push_back(out.rows.nodes.size());
    }
    out.rows.gradients.insert(out.rows.gradients.end(), part.gradients.begin(),
                              part.gradients.end());
    out.fluxes.insert(out.fluxes.end(), part.fluxes.begin(), part.fluxes.end());
    part = Part();
  }
  return out;
}

}  // namespace viscera
