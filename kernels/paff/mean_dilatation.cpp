#include "kernels/paff/mean_dilatation.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>

#include "kernels/base/parallel.h"
#include "kernels/paff/moment_matrix.h"
#include "kernels/points/kd_tree.h"

namespace viscera {
namespace {

/// Greatest width of a cell over the local spacing. Four constraints in a cell of 2 to 2.5 spacings
/// are one for every six to twelve unknowns; measured on the thick sphere at Poisson's ratio 0.499,
/// wider cells gain nothing on the cube and narrower ones lock again.
constexpr double kCellWidth = 1.5;

/// Cell of each volume point, numbered by first appearance.
std::vector<int> cells_of_points(const LocalSpacing& spacing, const VolumeQuadrature& volume,
                                 int& cell_count) {
  Vec3 low = volume.positions.front();
  for (const Vec3& x : volume.positions) low = low.cwiseMin(x);
  const double largest = kCellWidth * spacing.largest();
  low -= largest * Vec3(0.37, 0.43, 0.29);  // off the planes of symmetric bodies

  using Place = std::array<int, 4>;  // level, then the cell's indices
  std::map<Place, int> leaves;       // number of the leaf, or -1 for a cell that is split
  std::vector<int> cell(volume.size());
  cell_count = 0;
  for (std::size_t q = 0; q < volume.size(); ++q) {
    double side = largest;
    for (int level = 0;; ++level, side *= 0.5) {
      const Eigen::Vector3i at = ((volume.positions[q] - low) / side).array().floor().cast<int>();
      const auto [found, is_new] = leaves.try_emplace({level, at.x(), at.y(), at.z()}, -1);
      if (is_new) {
        const Vec3 centre = low + side * (at.cast<double>() + Vec3::Constant(0.5));
        constexpr double kRoundOff = 1.0 + 1e-9;
        if (side <= kRoundOff * kCellWidth * spacing(centre)) found->second = cell_count++;
      }
      if (found->second < 0) continue;
      cell[q] = found->second;
      break;
    }
  }
  return cell;
}

/// A cell stands alone when its points spread in every direction by this part of its width (a full
/// cell's by 0.29); less, and it joins the nearest cell that does. Each cell is a constraint, and
/// slivers are as many as cut cells; and polynomials fitted in a sliver are wild at its faces.
constexpr double kSmallestSpread = 0.12;

struct CellShape {
  double volume = 0.0;
  Vec3 centre = Vec3::Zero();
  Mat3 second = Mat3::Zero();

  double smallest_spread() const {
    return std::sqrt(
        std::max(0.0, Eigen::SelfAdjointEigenSolver<Mat3>(second / volume, Eigen::EigenvaluesOnly)
                          .eigenvalues()[0]));
  }
};

void merge_slivers(const LocalSpacing& spacing, const VolumeQuadrature& volume,
                   std::vector<int>& cell, int& cell_count) {
  std::vector<CellShape> shapes(static_cast<std::size_t>(cell_count));
  const auto shape_of = [&](std::size_t q) -> CellShape& {
    return shapes[static_cast<std::size_t>(cell[q])];
  };
  for (std::size_t q = 0; q < volume.size(); ++q) {
    shape_of(q).volume += volume.weights[q];
    shape_of(q).centre += volume.weights[q] * volume.positions[q];
  }
  for (CellShape& shape : shapes) shape.centre /= shape.volume;
  for (std::size_t q = 0; q < volume.size(); ++q) {
    const Vec3 d = volume.positions[q] - shape_of(q).centre;
    shape_of(q).second += volume.weights[q] * d * d.transpose();
  }

  std::vector<Vec3> kept;
  std::vector<int> number(shapes.size(), -1);
  std::vector<double> width(shapes.size());
  for (std::size_t c = 0; c < shapes.size(); ++c) {
    width[c] = kCellWidth * spacing(shapes[c].centre);
    if (shapes[c].smallest_spread() < kSmallestSpread * width[c]) continue;
    number[c] = static_cast<int>(kept.size());
    kept.push_back(shapes[c].centre);
  }
  cell_count = static_cast<int>(kept.size());
  const KdTree tree(kept);
  std::vector<KdTree::Found> found;
  for (std::size_t c = 0; c < shapes.size(); ++c) {
    if (number[c] >= 0) continue;
    if (!kept.empty()) tree.nearest(shapes[c].centre, 1, -1, found);
    // Walls thinner than a cell have none to join nearby.
    const bool near = !kept.empty() && found.front().distance2 < 2.25 * width[c] * width[c];
    number[c] = near ? found.front().index : cell_count++;
  }
  for (int& c : cell) c = number[static_cast<std::size_t>(c)];
}

/// Polynomials 1, x, y, z, orthonormal over the points of one cell; 1 alone where the points lie in
/// one plane.
struct CellPolynomials {
  Vec3 centre = Vec3::Zero();
  double scale = 1.0;
  Eigen::Matrix4d combine = Eigen::Matrix4d::Zero();  // L^-1 of the Gram matrix

  Vec4 at(const Vec3& y) const {
    return combine * (Vec4() << 1.0, (y - centre) / scale).finished();
  }
};

CellPolynomials orthonormal(const VolumeQuadrature& volume, std::span<const std::size_t> points) {
  CellPolynomials out;
  double total = 0.0;
  for (const std::size_t q : points) {
    total += volume.weights[q];
    out.centre += volume.weights[q] * volume.positions[q];
  }
  out.centre /= total;
  out.centre /= total;
  out.combine(0, 0) = 1.0 / std::sqrt(total);
  out.scale = std::cbrt(total);
  Eigen::Matrix4d gram = Eigen::Matrix4d::Zero();
  for (const std::size_t q : points) {
    const Vec4 p = (Vec4() << 1.0, (volume.positions[q] - out.centre) / out.scale).finished();
    gram += volume.weights[q] * p * p.transpose();
  }
  const Eigen::LLT<Eigen::Matrix4d> factor(gram);
  const Vec4 pivots = factor.matrixLLT().diagonal();
  if (factor.info() == Eigen::Success && pivots.minCoeff() > 0.03 * pivots[0]) {
    out.combine = factor.matrixL().solve(Eigen::Matrix4d::Identity());
  }
  return out;
}

}  // namespace

MeanDilatation mean_dilatation(const LocalSpacing& spacing, std::size_t node_count,
                               const VolumeQuadrature& volume, const PointFields& volume_fields,
                               const SurfaceQuadrature& surface, std::span<const std::size_t> fixed,
                               const PointFields& fixed_fields) {
  int cell_count = 0;
  std::vector<int> cell = cells_of_points(spacing, volume, cell_count);
  merge_slivers(spacing, volume, cell, cell_count);
  const std::size_t cells = static_cast<std::size_t>(cell_count);

  std::vector<std::vector<std::size_t>> points_of(cells), fixed_of(cells);
  for (std::size_t q = 0; q < volume.size(); ++q) {
    points_of[static_cast<std::size_t>(cell[q])].push_back(q);
  }
  MeanDilatation out;
  constexpr std::size_t terms = 4;
  out.terms = terms;
  out.first_row.resize(fixed.size());
  const KdTree volume_tree(volume.positions);
  std::vector<KdTree::Found> found;
  for (std::size_t b = 0; b < fixed.size(); ++b) {
    volume_tree.nearest(surface.positions[fixed[b]], 1, -1, found);
    const int owner = cell[static_cast<std::size_t>(found.front().index)];
    fixed_of[static_cast<std::size_t>(owner)].push_back(b);
    out.first_row[b] = terms * static_cast<std::size_t>(owner);
  }
  out.psi.resize(fixed.size() * terms);

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
      part.gradients.assign(terms * width, Vec3::Zero());
      part.fluxes.assign(terms * width, Vec3::Zero());
      const CellPolynomials polynomials = orthonormal(volume, points_of[c]);
      for (const std::size_t q : points_of[c]) {
        const Vec4 psi = volume.weights[q] * polynomials.at(volume.positions[q]);
        for (std::size_t e = volume_fields.begin[q]; e < volume_fields.begin[q + 1]; ++e) {
          const auto at =
              static_cast<std::size_t>(place[static_cast<std::size_t>(volume_fields.nodes[e])]);
          for (std::size_t k = 0; k < terms; ++k) {
            part.gradients[k * width + at] += psi[static_cast<int>(k)] * volume_fields.gradients[e];
          }
        }
      }
      for (const std::size_t b : fixed_of[c]) {
        const Vec4 psi = polynomials.at(surface.positions[fixed[b]]);
        const Vec3 area = surface.weights[fixed[b]] * surface.normals[fixed[b]];
        for (std::size_t k = 0; k < terms; ++k) {
          out.psi[b * terms + k] = psi[static_cast<int>(k)];
        }
        for (std::size_t e = fixed_fields.begin[b]; e < fixed_fields.begin[b + 1]; ++e) {
          const auto at =
              static_cast<std::size_t>(place[static_cast<std::size_t>(fixed_fields.nodes[e])]);
          for (std::size_t k = 0; k < terms; ++k) {
            part.fluxes[k * width + at] +=
                (psi[static_cast<int>(k)] * fixed_fields.values[e]) * area;
          }
        }
      }
      for (const int node : part.nodes) place[static_cast<std::size_t>(node)] = -1;
    }
  });
  for (Part& part : parts) {
    for (std::size_t k = 0; k < terms; ++k) {
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
