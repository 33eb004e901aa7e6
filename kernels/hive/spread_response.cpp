#include "kernels/hive/spread_response.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "kernels/base/wide.h"
#include "kernels/contact/facing.h"
#include "kernels/contact/half_space.h"
#include "kernels/contact/patch_contact.h"

namespace viscera {
namespace {

/// A bell reaches over some twenty places. Room is for so many of one, and so many in the mean.
constexpr std::size_t kMostOfOne = 1024, kMostShares = 128;
/// Touched places that are worked on at a time, so that what they need fits into the fast memory.
constexpr std::size_t kTogether = 32;

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
  shares_of_one_.reserve(std::min(kMostOfOne, surface.size()));
  offsets_.reserve(std::min(kMostOfOne, surface.size()));
  shares_.reserve(static_cast<std::size_t>(most_nodes) * std::min(kMostShares, surface.size()));
  sigmas_.reserve(static_cast<std::size_t>(most_nodes));
  touched_.reserve(most_places_);
  images_.resize(static_cast<Eigen::Index>(3 * kTogether), 3 * most_nodes);
  rows_.resize(3 * most_nodes, static_cast<Eigen::Index>(3 * kTogether));
  sums_.resize(3 * most_nodes, 3 * most_nodes);
}

/// C S^T on the touched places [first, end), put at the head of images_: every column of the
/// compliance there is read once.
VISCERA_WIDE void SpreadResponse::add_images(std::size_t first, std::size_t end) noexcept {
  const std::size_t rows = compliance_.rows(), count = 3 * (end - first);
  std::array<float, 3 * kTogether> column;
  for (std::size_t s = 0; s < shares_.size();) {
    std::size_t next = s;
    while (next < shares_.size() && shares_[next].local == shares_[s].local) ++next;
    const auto place = static_cast<std::size_t>(touched_[shares_[s].local]);
    for (std::size_t a = 0; a < 3; ++a) {
      const float* all = compliance_.columns.data() + (3 * place + a) * rows;
      for (std::size_t i = first; i < end; ++i) {
        const float* entry = all + 3 * compliance_.touchable[static_cast<std::size_t>(touched_[i])];
        for (std::size_t c = 0; c < 3; ++c) column[3 * (i - first) + c] = entry[c];
      }
      for (std::size_t t = s; t < next; ++t) {
        const float share = shares_[t].share;
        float* __restrict to = images_.data() + (3 * shares_[t].node + a) * 3 * kTogether;
#pragma GCC ivdep
        for (std::size_t i = 0; i < count; ++i) to[i] += share * column[i];
      }
    }
    s = next;
  }
}

bool SpreadResponse::gather(std::span<const Vec3> positions, std::span<const Vec3> normals,
                            double modulus, Eigen::Ref<MatrixX> out) noexcept {
  const std::size_t n = positions.size();
  shares_.clear();
  sigmas_.clear();
  touched_.clear();
  bool room = true;
  for (std::size_t k = 0; k < n && room; ++k) {
    const double sigma = PatchContact::spread_factor() * spacing_at(surface_, positions[k]);
    sigmas_.push_back(sigma);
    room = places_in_reach(surface_, positions[k], sigma) <= kMostOfOne;
    if (!room) break;
    spread_load(surface_, positions[k], normals[k], sigma, shares_of_one_, offsets_);
    for (const LoadShare& share : shares_of_one_) {
      int& local = local_of_[static_cast<std::size_t>(share.place)];
      room = shares_.size() < shares_.capacity() && (local >= 0 || touched_.size() < most_places_);
      if (!room) break;
      if (local < 0) {
        local = static_cast<int>(touched_.size());
        touched_.push_back(share.place);
      }
      shares_.push_back({static_cast<std::uint16_t>(local), static_cast<std::uint16_t>(k),
                         static_cast<float>(share.share)});
    }
  }
  for (const int place : touched_) local_of_[static_cast<std::size_t>(place)] = -1;
  if (!room) return false;
  compliance_.need(touched_);

  std::sort(shares_.begin(), shares_.end(), [](const Share& a, const Share& b) {
    return a.local != b.local ? a.local < b.local : a.node < b.node;
  });
  const auto wide = static_cast<Eigen::Index>(3 * n);
  sums_.leftCols(wide).setZero();
  std::size_t s = 0;
  for (std::size_t first = 0; first < touched_.size(); first += kTogether) {
    const std::size_t end = std::min(first + kTogether, touched_.size());
    images_.leftCols(wide).setZero();
    add_images(first, end);
    // S (C S^T): along the nodes, so that rows are added whole.
    for (Eigen::Index i = 0; i < static_cast<Eigen::Index>(3 * (end - first)); ++i)
      for (Eigen::Index j = 0; j < wide; ++j) rows_(j, i) = images_(i, j);
    for (; s < shares_.size() && shares_[s].local < end; ++s)
      for (Eigen::Index c = 0; c < 3; ++c)
        add_scaled(rows_.col(3 * static_cast<Eigen::Index>(shares_[s].local - first) + c).data(),
                   shares_[s].share, 3 * n, sums_.col(3 * shares_[s].node + c).data());
  }
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
      const Mat3 response = share / modulus *
                            half_space.response(gaussian_to_point(offset.norm(), sigma), offset,
                                                (normals[k] + normals[l]).normalized());
      const auto row = static_cast<Eigen::Index>(3 * k), column = static_cast<Eigen::Index>(3 * l);
      out.block<3, 3>(row, column) -= response;
      if (k != l) out.block<3, 3>(column, row) -= response.transpose();
    }
  }
  return true;
}

}  // namespace viscera
