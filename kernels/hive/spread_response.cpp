#include "kernels/hive/spread_response.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "kernels/base/wide.h"
#include "kernels/contact/facing.h"
#include "kernels/contact/half_space.h"
#include "kernels/contact/patch_contact.h"

namespace viscera {
namespace {

/// A bell reaches over this many places at most.
constexpr std::size_t kMostShares = 512;

VISCERA_WIDE void add_scaled(const float* from, float factor, std::size_t n, float* __restrict to) {
#pragma GCC ivdep
  for (std::size_t i = 0; i < n; ++i) to[i] += factor * from[i];
}

}  // namespace

SpreadResponse::SpreadResponse(const SurfaceCompliance& compliance, const TouchableSurface& surface,
                               const IsotropicMaterial& material, int most_nodes,
                               std::size_t most_places)
    : compliance_(compliance),
      surface_(surface),
      material_(material),
      most_places_(std::min(most_places, surface.size())),
      local_of_(surface.size(), -1) {
  shares_of_one_.reserve(kMostShares);
  offsets_.reserve(kMostShares);
  shares_.reserve(static_cast<std::size_t>(most_nodes) * kMostShares);
  sigmas_.reserve(static_cast<std::size_t>(most_nodes));
  touched_.reserve(surface.size());
  column_.resize(3 * most_places_);
  images_.resize(static_cast<Eigen::Index>(3 * most_places_), 3 * most_nodes);
  rows_.resize(3 * most_nodes, static_cast<Eigen::Index>(3 * most_places_));
  sums_.resize(3 * most_nodes, 3 * most_nodes);
}

bool SpreadResponse::gather(std::span<const Vec3> positions, std::span<const Vec3> normals,
                            Eigen::Ref<MatrixX> out) noexcept {
  const std::size_t n = positions.size();
  shares_.clear();
  sigmas_.clear();
  touched_.clear();
  for (std::size_t k = 0; k < n; ++k) {
    const double sigma = PatchContact::spread_factor() * spacing_at(surface_, positions[k]);
    sigmas_.push_back(sigma);
    spread_load(surface_, positions[k], normals[k], sigma, shares_of_one_, offsets_);
    for (const LoadShare& share : shares_of_one_) {
      int& local = local_of_[static_cast<std::size_t>(share.place)];
      if (local < 0) {
        local = static_cast<int>(touched_.size());
        touched_.push_back(share.place);
      }
      shares_.push_back({local, static_cast<int>(k), share.share});
    }
  }
  for (const int place : touched_) local_of_[static_cast<std::size_t>(place)] = -1;
  const std::size_t m = touched_.size();
  if (m > most_places_) return false;

  // By place, so that every column of the compliance is read once.
  std::sort(shares_.begin(), shares_.end(), [](const Share& a, const Share& b) {
    return a.local != b.local ? a.local < b.local : a.node < b.node;
  });
  images_.leftCols(static_cast<Eigen::Index>(3 * n)).setZero();
  const std::size_t rows = compliance_.rows();
  for (std::size_t s = 0; s < shares_.size();) {
    std::size_t end = s;
    while (end < shares_.size() && shares_[end].local == shares_[s].local) ++end;
    const auto place =
        static_cast<std::size_t>(touched_[static_cast<std::size_t>(shares_[s].local)]);
    for (std::size_t a = 0; a < 3; ++a) {
      const float* column = compliance_.columns.data() + (3 * place + a) * rows;
      for (std::size_t i = 0; i < m; ++i) {
        const float* entry =
            column + 3 * compliance_.touchable[static_cast<std::size_t>(touched_[i])];
        for (std::size_t c = 0; c < 3; ++c) column_[3 * i + c] = entry[c];
      }
      for (std::size_t t = s; t < end; ++t)
        add_scaled(column_.data(), static_cast<float>(shares_[t].share), 3 * m,
                   images_.col(3 * shares_[t].node + static_cast<Eigen::Index>(a)).data());
    }
    s = end;
  }

  // S (C S^T): along the nodes, so that rows are added whole.
  const auto wide = static_cast<Eigen::Index>(3 * n);
  for (Eigen::Index i = 0; i < static_cast<Eigen::Index>(3 * m); ++i)
    for (Eigen::Index j = 0; j < wide; ++j) rows_(j, i) = images_(i, j);
  sums_.leftCols(wide).setZero();
  for (const Share& share : shares_)
    for (Eigen::Index c = 0; c < 3; ++c)
      add_scaled(rows_.col(3 * share.local + c).data(), static_cast<float>(share.share), 3 * n,
                 sums_.col(3 * share.node + c).data());
  out = sums_.topLeftCorner(wide, wide).transpose().cast<double>();
  // Single precision leaves its mark; the mirror must be exact.
  for (Eigen::Index j = 0; j < out.cols(); ++j)
    for (Eigen::Index i = 0; i < j; ++i) out(i, j) = out(j, i) = 0.5 * (out(i, j) + out(j, i));

  const HalfSpace half_space(material_);
  for (std::size_t k = 0; k < n; ++k) {
    for (std::size_t l = 0; l <= k; ++l) {
      const double share = facing(normals[k].dot(normals[l]));
      if (share == 0.0) continue;
      // Spread by two Gaussians: their variances add.
      const double sigma = std::hypot(sigmas_[k], sigmas_[l]);
      const Vec3 offset = positions[k] - positions[l];
      const Mat3 response =
          share * half_space.response(gaussian_to_point(offset.norm(), sigma), offset,
                                      (normals[k] + normals[l]).normalized());
      const auto row = static_cast<Eigen::Index>(3 * k), column = static_cast<Eigen::Index>(3 * l);
      out.block<3, 3>(row, column) -= response;
      if (k != l) out.block<3, 3>(column, row) -= response.transpose();
    }
  }
  return true;
}

}  // namespace viscera
