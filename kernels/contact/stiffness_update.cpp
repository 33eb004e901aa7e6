#include "kernels/contact/stiffness_update.h"

#include <algorithm>
#include <cmath>

#include "kernels/base/parallel.h"
#include "kernels/paff/blas.h"

namespace viscera {
namespace {

constexpr std::size_t kRowsAtOnce = 256;  // of a task
/// Factors about a place are averaged by a bell this wide, in spacings.
constexpr double kFeltSpacings = 0.35;
/// On the diagonal of Delta K where it is rooted, relative to its mean.
constexpr double kRootRidge = 1e-12;

int integer(std::size_t n) {
  return static_cast<int>(n);
}

/// A B or, with B given as its transpose, A B^T; column-major, tasks of rows.
template <class Real>
void product(bool transposed, std::size_t m, std::size_t n, std::size_t k, const Real* a,
             const Real* b, Real* c) {
  parallel_chunks(m, kRowsAtOnce, [&](std::size_t first, std::size_t last) {
    blas::multiply(transposed, integer(last - first), integer(n), integer(k), Real(1), a + first,
                   integer(m), b, integer(transposed ? n : k), Real(0), c + first, integer(m));
  });
}

MatrixX product(const MatrixX& a, const MatrixX& b, bool transposed = false) {
  MatrixX c(a.rows(), transposed ? b.rows() : b.cols());
  if (c.size() > 0 && a.cols() > 0) {
    product(transposed, static_cast<std::size_t>(c.rows()), static_cast<std::size_t>(c.cols()),
            static_cast<std::size_t>(a.cols()), a.data(), b.data(), c.data());
  } else {
    c.setZero();
  }
  return c;
}

/// Entries of a (3 x 3) blocked matrix for these of its columns, and rows if `both`.
template <class Matrix>
Matrix chosen_columns(const std::vector<float>& from, std::size_t rows,
                      const std::vector<int>& nodes, bool both) {
  using Index = Eigen::Index;
  const std::size_t height = both ? 3 * nodes.size() : rows;
  Matrix to(static_cast<Index>(height), static_cast<Index>(3 * nodes.size()));
  parallel_for_each_index(3 * nodes.size(), 16, [&](std::size_t c) {
    const float* column = from.data() + (3 * static_cast<std::size_t>(nodes[c / 3]) + c % 3) * rows;
    for (std::size_t r = 0; r < height; ++r) {
      const std::size_t row = both ? 3 * static_cast<std::size_t>(nodes[r / 3]) + r % 3 : r;
      to(static_cast<Index>(r), static_cast<Index>(c)) = column[row];
    }
  });
  return to;
}

/// B has more rows than columns where much tissue is close together; then as many do.
void root_again(MatrixX& roots) {
  if (roots.rows() <= roots.cols()) return;
  const MatrixX across = roots.transpose();
  MatrixX square = product(across, across, true);
  const Eigen::Index n = square.rows();
  square.diagonal().array() += kRootRidge * square.trace() / static_cast<double>(n);
  if (!blas::cholesky(static_cast<int>(n), square.data(), static_cast<int>(n))) return;
  roots = square.triangularView<Eigen::Lower>().toDenseMatrix().transpose();
}

/// What the points of the region within reach of a place are on average.
std::vector<float> felt_stiffness(const ElasticRegion& region, const std::vector<double>& factors,
                                  const TouchableSurface& surface) {
  std::vector<float> felt(surface.size(), 1.0f);
  Box changed;
  for (std::size_t q = 0; q < region.size(); ++q) {
    if (factors[q] > 1.0) changed.extend(region.positions[q]);
  }
  parallel_for_each_index(surface.size(), 16, [&](std::size_t p) {
    const double sigma = kFeltSpacings * surface.spacings[p], reach = 4.0 * sigma;
    if (changed.exteriorDistance(surface.positions[p]) > reach) return;
    double sum = 0.0, weight = 0.0;
    for (std::size_t q = 0; q < region.size(); ++q) {
      const double square = (region.positions[q] - surface.positions[p]).squaredNorm();
      if (square > reach * reach) continue;
      const double share = region.weights[q] * std::exp(-0.5 * square / (sigma * sigma));
      weight += share;
      sum += share * factors[q];
    }
    if (weight > 0.0) felt[p] = static_cast<float>(std::max(1.0, sum / weight));
  });
  return felt;
}

/// One for each point, none below 1.
std::vector<double> sound_factors(const std::vector<double>& stiffness, std::size_t points,
                                  double& greatest) {
  std::vector<double> factors = stiffness;
  factors.resize(points, 1.0);
  for (double& factor : factors) {
    if (!(factor >= 1.0) || !std::isfinite(factor)) factor = 1.0;
    greatest = std::max(greatest, factor);
  }
  return factors;
}

/// V V^T in fewer columns: Q of the eigenvectors that V^T V has at touchable places, greatest
/// first.
MatrixX strongest(const Eigen::MatrixXf& at_touchable, double dropped) {
  const auto n = at_touchable.cols();
  const MatrixX across = at_touchable.transpose().cast<double>();
  MatrixX square = -product(across, across, true);
  VectorX values(n);
  if (!blas::eigen(static_cast<int>(n), square.data(), values.data()))
    return MatrixX::Identity(n, n);
  Eigen::Index kept = 0;  // ascending, hence the greatest first, being negative
  while (kept < n && values[kept] < dropped * values[0]) ++kept;
  return square.leftCols(kept);
}

}  // namespace

std::size_t ChangeableRegion::memory_bytes() const {
  return tissue.memory_bytes() + (places.size() + nodes.size()) * sizeof(float);
}

std::size_t StiffnessUpdate::memory_bytes() const {
  return (columns.size() + touchable.size() + stiffness.size() + shift.size()) * sizeof(float);
}

std::size_t changeable_bytes(std::size_t places, std::size_t nodes) {
  return 9 * nodes * (places + nodes) * sizeof(float);
}

Result<ChangeableRegion> changeable_region(ElasticSolver& solver, ElasticRegion tissue,
                                           const SparseWeights& places, const Progress& progress) {
  ChangeableRegion region;
  region.tissue = std::move(tissue);
  region.rows = 3 * places.rows();
  if (region.empty()) return region;
  // Nodes are places with a field of one.
  SparseWeights all = places;
  std::vector<int> nodes;
  for (const int node : region.tissue.nodes) {
    nodes.push_back(static_cast<int>(all.rows()));
    all.nodes.push_back(node);
    all.values.push_back(1.0f);
    all.row_begin.push_back(static_cast<int>(all.nodes.size()));
  }
  const auto compliance = solver.compliance(all, nodes, progress);
  if (!compliance) return std::unexpected(compliance.error());
  const std::size_t columns = 3 * nodes.size(), height = compliance->rows();
  region.places.resize(region.rows * columns);
  region.nodes.resize(columns * columns);
  parallel_for_each_index(columns, 16, [&](std::size_t c) {
    const float* column = compliance->columns.data() + c * height;
    std::copy_n(column, region.rows, region.places.data() + c * region.rows);
    std::copy_n(column + region.rows, columns, region.nodes.data() + c * columns);
  });
  return region;
}

StiffnessUpdate update_stiffness(const ChangeableRegion& region, const TissueChange& change,
                                 const TouchableSurface& surface, double dropped) {
  prepare_blas();
  StiffnessUpdate update;
  update.rows = region.rows;
  const ElasticRegion& tissue = region.tissue;
  const std::vector<double> factors =
      sound_factors(change.stiffness, tissue.size(), update.greatest_stiffness);
  AddedStiffness added = added_stiffness(tissue, factors);
  update.nodes = added.nodes.size();

  const std::size_t own = 3 * added.nodes.size();
  const auto among =
      chosen_columns<MatrixX>(region.nodes, 3 * tissue.nodes.size(), added.nodes, true);
  MatrixX lower;  // G
  if (own > 0) {
    root_again(added.roots);
    lower = product(added.roots, product(among, added.roots, true));
    lower = (0.5 * (lower + lower.transpose())).eval();
    lower.diagonal().array() += 1.0;
    const int modes = static_cast<int>(lower.rows());
    update.modes = static_cast<std::size_t>(modes);
    if (!blas::cholesky(modes, lower.data(), modes)) return update;
    MatrixX weights = added.roots.transpose();  // B^T G^-T
    parallel_chunks(own, kRowsAtOnce, [&](std::size_t first, std::size_t last) {
      blas::solve_right(true, integer(last - first), modes, lower.data(), modes,
                        weights.data() + first, integer(own));
    });
    const auto at_places =
        chosen_columns<Eigen::MatrixXf>(region.places, region.rows, added.nodes, false);
    Eigen::MatrixXf at_touchable(static_cast<Eigen::Index>(3 * surface.size()), at_places.cols());
    for (std::size_t p = 0; p < surface.size(); ++p) {
      at_touchable.middleRows<3>(3 * static_cast<Eigen::Index>(p)) =
          at_places.middleRows<3>(3 * static_cast<Eigen::Index>(surface.places[p]));
    }
    Eigen::MatrixXf single = weights.cast<float>();
    Eigen::MatrixXf columns(at_touchable.rows(), single.cols());
    product(false, 3 * surface.size(), update.modes, own, at_touchable.data(), single.data(),
            columns.data());
    const MatrixX kept = strongest(columns, dropped);
    single = product(weights, kept).cast<float>();
    update.rank = static_cast<std::size_t>(kept.cols());
    update.columns.resize(update.rows * update.rank);
    product(false, update.rows, update.rank, own, at_places.data(), single.data(),
            update.columns.data());
    update.touchable.resize(3 * surface.size() * update.rank);
    parallel_for_each_index(update.rank, 4, [&](std::size_t k) {
      for (std::size_t i = 0; i < 3 * surface.size(); ++i) {
        update.touchable[k * 3 * surface.size() + i] =
            update.columns[k * update.rows + 3 * static_cast<std::size_t>(surface.places[i / 3]) +
                           i % 3];
      }
    });
    update.stiffness = felt_stiffness(tissue, factors, surface);
  }

  std::vector<double> strains(tissue.size(), 0.0);
  bool shrinks = false;
  for (std::size_t q = 0; q < strains.size() && q < change.shrinkage.size(); ++q) {
    if (!(change.shrinkage[q] > 0.0) || !std::isfinite(change.shrinkage[q])) continue;
    strains[q] = -change.shrinkage[q];
    shrinks = true;
  }
  if (!shrinks) return update;
  VectorX load = eigenstrain_load(tissue, factors, strains);
  if (own > 0) {
    // Nodes that only shrinking tissue reaches have loads, too.
    VectorX moved(static_cast<Eigen::Index>(own));
    const std::size_t all = 3 * tissue.nodes.size();
    parallel_for_each_index(own, 16, [&](std::size_t i) {
      const float* column =  // a row, the matrix being symmetric
          region.nodes.data() + (3 * static_cast<std::size_t>(added.nodes[i / 3]) + i % 3) * all;
      double sum = 0.0;
      for (std::size_t j = 0; j < all; ++j) {
        sum += static_cast<double>(column[j]) * load[static_cast<Eigen::Index>(j)];
      }
      moved[static_cast<Eigen::Index>(i)] = sum;
    });
    VectorX amounts = added.roots * moved;
    lower.triangularView<Eigen::Lower>().solveInPlace(amounts);
    lower.triangularView<Eigen::Lower>().transpose().solveInPlace(amounts);
    const VectorX taken = added.roots.transpose() * amounts;
    for (std::size_t i = 0; i < own; ++i) {
      load[3 * added.nodes[i / 3] + static_cast<Eigen::Index>(i % 3)] -=
          taken[static_cast<Eigen::Index>(i)];
    }
  }
  update.shift.assign(update.rows, 0.0f);
  parallel_chunks(update.rows, kRowsAtOnce, [&](std::size_t first, std::size_t last) {
    VectorX sums = VectorX::Zero(static_cast<Eigen::Index>(last - first));
    for (Eigen::Index c = 0; c < load.size(); ++c) {
      if (load[c] == 0.0) continue;
      const float* column =
          region.places.data() + static_cast<std::size_t>(c) * update.rows + first;
      for (Eigen::Index i = 0; i < sums.size(); ++i)
        sums[i] += load[c] * static_cast<double>(column[i]);
    }
    for (std::size_t i = first; i < last; ++i) {
      update.shift[i] = static_cast<float>(sums[static_cast<Eigen::Index>(i - first)]);
    }
  });
  for (std::size_t p = 0; p < update.rows; p += 3) {
    update.greatest_shift = std::max(
        update.greatest_shift, static_cast<double>(Vec3f::Map(update.shift.data() + p).norm()));
  }
  return update;
}

StiffnessUpdate energy_update(const ElasticRegion& tissue, TissueChange change,
                              const TouchableSurface& surface) {
  StiffnessUpdate update;
  update.stiffness = felt_stiffness(
      tissue, sound_factors(change.stiffness, tissue.size(), update.greatest_stiffness), surface);
  update.change = std::move(change);
  return update;
}

double update_cost(const ChangeableRegion& region, const TissueChange& change,
                   const TouchableSurface& surface) {
  const ElasticRegion& tissue = region.tissue;
  std::vector<char> node(tissue.nodes.size(), 0), cell(tissue.cells(), 0);
  double rows = 0.0, nodes = 0.0;
  const auto mark = [&](const std::vector<int>& of, std::size_t first, std::size_t last) {
    for (std::size_t e = first; e < last; ++e) {
      char& seen = node[static_cast<std::size_t>(of[e])];
      nodes += seen ? 0.0 : 1.0;
      seen = 1;
    }
  };
  for (std::size_t q = 0; q < tissue.size() && q < change.stiffness.size(); ++q) {
    if (!(change.stiffness[q] > 1.0)) continue;
    rows += 6.0;
    mark(tissue.point_nodes, tissue.begin[q], tissue.begin[q + 1]);
    if (tissue.cell.empty()) continue;
    const auto c = static_cast<std::size_t>(tissue.cell[q]);
    if (cell[c]) continue;
    cell[c] = 1;
    rows += static_cast<double>(ElasticRegion::kTerms);
    mark(tissue.cell_nodes, tissue.cell_begin[c], tissue.cell_begin[c + 1]);
  }
  constexpr double kMostKept = 200.0;
  const double m = 3.0 * nodes, modes = std::min(rows, m);
  return (rows > m ? m * m * rows : 0.0) +
         modes * m * (m + modes + 3.0 * static_cast<double>(surface.size())) +
         std::min(modes, kMostKept) * m * static_cast<double>(region.rows) +
         4.0 * modes * modes * modes;
}

void subtract_update(const StiffnessUpdate& update, std::span<const int> touched,
                     std::span<const Vec3> loads, std::span<float> sums) {
  if (update.rank == 0 || touched.empty()) return;
  const std::size_t height = update.touchable.size() / update.rank;
  const bool all = sums.size() == update.rows;
  const std::vector<float>& columns = all ? update.columns : update.touchable;
  std::vector<float> amounts(update.rank);
  for (std::size_t k = 0; k < update.rank; ++k) {
    const float* column = update.touchable.data() + k * height;
    double sum = 0.0;
    for (std::size_t j = 0; j < touched.size(); ++j) {
      sum += Vec3f::Map(column + 3 * static_cast<std::size_t>(touched[j]))
                 .cast<double>()
                 .dot(loads[j]);
    }
    amounts[k] = static_cast<float>(sum);
  }
  constexpr std::size_t kChunk = 2048;
  parallel_chunks(sums.size(), kChunk, [&](std::size_t first, std::size_t last) {
    for (std::size_t k = 0; k < update.rank; ++k) {
      const float* __restrict column = columns.data() + k * sums.size();
      float* __restrict sum = sums.data();
      const float amount = amounts[k];
      for (std::size_t i = first; i < last; ++i) sum[i] -= amount * column[i];
    }
  });
}

}  // namespace viscera
