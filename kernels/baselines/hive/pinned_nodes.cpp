#include "kernels/baselines/hive/pinned_nodes.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace viscera {

PinnedNodes::PinnedNodes(int most_nodes) : matrix_(most_nodes, most_nodes) {
  const auto n = static_cast<std::size_t>(most_nodes);
  nodes_.reserve(n);
  cells_.reserve(n);
  forces_.reserve(n);
  rows_.resize(n * (n + 1));
}

void PinnedNodes::seat(std::span<const ContactCell> cells, const HiveNodes& nodes, int free_nodes,
                       Eigen::Ref<const MatrixX> compliance) noexcept {
  nodes_.clear();
  cells_.clear();
  Vec3 middle = Vec3::Zero();
  for (const ContactCell& cell : cells) middle += cell.position / static_cast<double>(cells.size());
  int central = 0, central_cell = 0;
  double least_to_middle = std::numeric_limits<double>::infinity();
  for (int i = 0; i < free_nodes && !cells.empty(); ++i) {
    const Vec3& x = nodes.positions[static_cast<std::size_t>(i)];
    int nearest = 0;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < cells.size(); ++k) {
      const double d2 = (cells[k].position - x).squaredNorm();
      if (d2 < least) {
        least = d2;
        nearest = static_cast<int>(k);
      }
    }
    if (const double d2 = (x - middle).squaredNorm(); d2 < least_to_middle) {
      least_to_middle = d2;
      central = i;
      central_cell = nearest;
    }
    if (least * std::numbers::pi > cells[static_cast<std::size_t>(nearest)].area) continue;
    nodes_.push_back(i);
    cells_.push_back(nearest);
  }
  if (nodes_.empty() && !cells.empty()) {
    nodes_.push_back(central);
    cells_.push_back(central_cell);
  }
  for (std::size_t i = 0; i < nodes_.size(); ++i)
    for (std::size_t j = 0; j < nodes_.size(); ++j)
      matrix_(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
          cells[static_cast<std::size_t>(cells_[i])].direction.dot(
              compliance.block<3, 3>(3 * nodes_[i], 3 * nodes_[j]) *
              cells[static_cast<std::size_t>(cells_[j])].direction);
  forces_.assign(nodes_.size(), 0.0);
}

bool PinnedNodes::solve(std::span<const double> depths) noexcept {
  // Nodes that the tool hasn't reached are free. Gauss with row exchanges on the others.
  const std::size_t all = nodes_.size();
  std::fill(forces_.begin(), forces_.end(), 0.0);
  std::size_t n = 0;
  const auto touches = [&](std::size_t i) {
    return depths[static_cast<std::size_t>(cells_[i])] > 0.0;
  };
  for (std::size_t i = 0; i < all; ++i) n += touches(i);
  const std::size_t width = n + 1;
  std::size_t row = 0;
  for (std::size_t i = 0; i < all; ++i) {
    if (!touches(i)) continue;
    double* into = rows_.data() + row++ * width;
    for (std::size_t j = 0; j < all; ++j)
      if (touches(j)) *into++ = matrix_(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
    *into = depths[static_cast<std::size_t>(cells_[i])];
  }
  double* a = rows_.data();
  for (std::size_t k = 0; k < n; ++k) {
    std::size_t best = k;
    for (std::size_t i = k + 1; i < n; ++i)
      if (std::abs(a[i * width + k]) > std::abs(a[best * width + k])) best = i;
    if (!(std::abs(a[best * width + k]) > 0.0)) return false;
    std::swap_ranges(a + k * width, a + (k + 1) * width,
                     best == k ? a + k * width : a + best * width);
    for (std::size_t i = k + 1; i < n; ++i) {
      const double f = a[i * width + k] / a[k * width + k];
      for (std::size_t j = k; j < width; ++j) a[i * width + j] -= f * a[k * width + j];
    }
  }
  for (std::size_t k = n; k-- > 0;) {
    double& x = a[k * width + n];
    for (std::size_t j = k + 1; j < n; ++j) x -= a[k * width + j] * a[j * width + n];
    x /= a[k * width + k];
    if (!std::isfinite(x)) return false;
  }
  row = 0;
  for (std::size_t i = 0; i < all; ++i)
    if (touches(i)) forces_[i] = a[row++ * width + n];
  return true;
}

}  // namespace viscera
