#include "kernels/finite/loose_pieces.h"

#include <algorithm>

#include "kernels/finite/finite_limits.h"
#include "kernels/finite/rigid_way.h"
#include "kernels/finite/warped_factor.h"

namespace viscera {
namespace {

std::vector<Mat3> mean_gradients(const FiniteBody& body, const VectorX& u) {
  return body.mean_gradients({u.data(), static_cast<std::size_t>(u.size())});
}

}  // namespace

LoosePieces::LoosePieces(std::span<const int> piece_of, std::span<const Vec3> positions,
                         std::span<const double> masses) {
  for (std::size_t node = 0; node < piece_of.size(); ++node) {
    if (piece_of[node] < 0) continue;
    const auto piece = static_cast<std::size_t>(piece_of[node]);
    if (piece >= pieces_.size()) pieces_.resize(piece + 1);
    pieces_[piece].push_back(static_cast<int>(node));
  }
  if (pieces_.empty()) return;
  piece_of_.assign(piece_of.begin(), piece_of.end());
  positions_.assign(positions.begin(), positions.end());
  masses_.assign(masses.begin(), masses.end());
}

LoosePieces LoosePieces::of_free_body(std::span<const Vec3> positions,
                                      std::span<const double> masses) {
  LoosePieces all(std::vector<int>(positions.size(), 0), positions, masses);
  all.whole_ = true;
  return all;
}

double LoosePieces::mass(int piece) const {
  double sum = 0.0;
  for (const int node : pieces_[static_cast<std::size_t>(piece)])
    sum += masses_[static_cast<std::size_t>(node)];
  return sum;
}

VectorX LoosePieces::gone_by(const VectorX& u, const VectorX& way, bool rigidly) const {
  VectorX next = u + way;
  for (const std::vector<int>& piece : pieces_)
    go_by({piece, positions_, masses_}, u, way, rigidly, next);
  return next;
}

VectorX LoosePieces::as_at_rest(const VectorX& u) const {
  VectorX next = u;
  for (const std::vector<int>& piece : pieces_) {
    const auto mass = [&](int node) { return masses_[static_cast<std::size_t>(node)]; };
    const auto at_rest = [&](int node) { return positions_[static_cast<std::size_t>(node)]; };
    const auto place = [&](int node) {
      return Vec3(at_rest(node) + u.segment<3>(Eigen::Index{3} * node));
    };
    double sum = 0.0;
    Vec3 rest = Vec3::Zero(), now = Vec3::Zero();
    for (const int node : piece) {
      sum += mass(node);
      rest += mass(node) * at_rest(node);
      now += mass(node) * place(node);
    }
    rest /= sum;
    now /= sum;
    Mat3 spread = Mat3::Zero();
    double size = 0.0;
    for (const int node : piece) {
      spread += mass(node) * (place(node) - now) * (at_rest(node) - rest).transpose();
      size += mass(node) * (at_rest(node) - rest).squaredNorm();
    }
    const Mat3 turned = polar_rotation(3.0 / size * spread);
    for (const int node : piece)
      next.segment<3>(Eigen::Index{3} * node) =
          now + turned * (at_rest(node) - rest) - at_rest(node);
  }
  return next;
}

std::vector<Mat3> LoosePieces::rotations(const FiniteBody& body, const VectorX& u) const {
  const std::vector<Mat3> means = mean_gradients(body, u);
  std::vector<Mat3> turned;
  for (const std::vector<int>& piece : pieces_) {
    Mat3 sum = Mat3::Zero();
    for (const int node : piece)
      sum += masses_[static_cast<std::size_t>(node)] * means[static_cast<std::size_t>(node)];
    turned.push_back(polar_rotation(sum));
  }
  return turned;
}

void LoosePieces::set(std::span<const Mat3> of_pieces, NodalRotations& rotations) const {
  for (std::size_t p = 0; p < pieces_.size(); ++p)
    for (const int node : pieces_[p])
      Eigen::Map<Mat3>(rotations.data() + 9 * static_cast<std::size_t>(node)) = of_pieces[p];
}

bool LoosePieces::any_swollen(const FiniteBody& body, const VectorX& u) const {
  if (empty()) return false;
  const std::vector<Mat3> means = mean_gradients(body, u);
  const auto swollen = [&](int node) {
    const double volume = means[static_cast<std::size_t>(node)].determinant();
    return !(volume > 1.0 / kMostSwelled && volume < kMostSwelled);
  };
  return std::ranges::any_of(
      pieces_, [&](const std::vector<int>& piece) { return std::ranges::any_of(piece, swollen); });
}

std::vector<int> LoosePieces::out_of_view(const VectorX& u) const {
  std::vector<int> nodes;
  if (whole_) return nodes;
  for (const std::vector<int>& piece : pieces_)
    if (std::ranges::all_of(
            piece, [&](int node) { return u.segment<3>(Eigen::Index{3} * node).norm() > kInView; }))
      nodes.insert(nodes.end(), piece.begin(), piece.end());
  return nodes;
}

bool LoosePieces::is_tissue(const VectorX& u) const {
  if (!u.allFinite()) return false;
  for (Eigen::Index at = 0; at < u.size(); at += 3) {
    const bool loose = has(static_cast<std::size_t>(at / 3));
    if (!(u.segment<3>(at).norm() < (loose ? kFarthestFree : kFarthest))) return false;
  }
  return true;
}

}  // namespace viscera
