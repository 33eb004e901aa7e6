#include "kernels/finite/unloaded_shape.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <deque>
#include <string>

#include "kernels/finite/finite_body.h"

namespace viscera {
namespace {

constexpr std::size_t kTerms = ElasticRegion::kTerms;

/// What unloads to less than this share of its volume isn't tissue any more.
constexpr double kLeastVolume = 0.1;
/// Steps that a search remembers (Anderson's mixing [Walker2011]).
constexpr std::size_t kRemembered = 5;

using Gram = Eigen::Matrix<double, kTerms, kTerms>;
using Terms = Eigen::Matrix<double, kTerms, 1>;

/// Turns a cell's polynomials into those that have with other weights the products that they had.
Gram same_products(const Gram& before, const Gram& now) {
  std::vector<Eigen::Index> there;
  for (Eigen::Index k = 0; k < before.rows(); ++k)
    if (before(k, k) > 0.0) there.push_back(k);
  const MatrixX old_root = MatrixX(before(there, there)).llt().matrixL();
  const MatrixX new_root = MatrixX(now(there, there)).llt().matrixL();
  const MatrixX turn =
      new_root.transpose().triangularView<Eigen::Upper>().solve(old_root.transpose()).transpose();
  Gram whole = Gram::Zero();
  whole(there, there) = turn;
  return whole;
}

void keep_products(const ElasticRegion& before, ElasticRegion& now) {
  if (before.cell.empty()) return;
  const auto cells = static_cast<std::size_t>(*std::ranges::max_element(before.cell)) + 1;
  std::vector<Gram> were(cells, Gram::Zero()), are(cells, Gram::Zero());
  const auto psi = [](auto& region, std::size_t q) {
    return Eigen::Map<const Terms>(region.psi.data() + kTerms * q);
  };
  for (std::size_t q = 0; q < before.size(); ++q) {
    const auto c = static_cast<std::size_t>(before.cell[q]);
    const Gram square = psi(before, q) * psi(before, q).transpose();
    were[c] += before.weights[q] * square;
    are[c] += now.weights[q] * square;
  }
  for (std::size_t c = 0; c < cells; ++c) were[c] = same_products(were[c], are[c]);
  for (std::size_t q = 0; q < before.size(); ++q)
    Eigen::Map<Terms>(now.psi.data() + kTerms * q) =
        were[static_cast<std::size_t>(before.cell[q])] * psi(before, q);
}

/// What a guess of u0 is off by: where the imaged body would go, about.
class Unloading {
 public:
  Unloading(const ElasticRegion& region, const SymmetricBlockMatrix& hold,
            std::span<const double> weight, const std::function<VectorX(const VectorX&)>& answer)
      : region_(region), hold_(hold), weight_(weight), answer_(answer) {}

  Result<VectorX> way_of_image(const VectorX& unloaded) const {
    const std::span<const double> shape(unloaded.data(), weight_.size());
    const auto region = region_unloaded(region_, shape);
    if (!region) return std::unexpected(region.error());
    const auto body = FiniteBody::create(*region, hold_);
    if (!body) return std::unexpected(body.error());
    const VectorX back = -unloaded;
    VectorX forces = -Eigen::Map<const VectorX>(weight_.data(), unloaded.size());
    FiniteBody::Workspace workspace;
    body->energy({back.data(), weight_.size()}, {forces.data(), weight_.size()}, workspace);
    return answer_(-forces);
  }

 private:
  const ElasticRegion& region_;
  const SymmetricBlockMatrix& hold_;
  std::span<const double> weight_;
  const std::function<VectorX(const VectorX&)>& answer_;
};

/// Where a fixed point is sought next, of what was found out at the last guesses.
class Mixing {
 public:
  VectorX next(const VectorX& guess, const VectorX& way) {
    if (last_way_.size() > 0) {
      guesses_.push_back(guess - last_guess_);
      ways_.push_back(way - last_way_);
      if (ways_.size() > kRemembered) {
        guesses_.pop_front();
        ways_.pop_front();
      }
    }
    last_guess_ = guess;
    last_way_ = way;
    VectorX to = guess - way;
    if (ways_.empty()) return to;
    MatrixX changes(way.size(), static_cast<Eigen::Index>(ways_.size()));
    for (std::size_t i = 0; i < ways_.size(); ++i)
      changes.col(static_cast<Eigen::Index>(i)) = ways_[i];
    const VectorX amounts = changes.colPivHouseholderQr().solve(way);
    for (std::size_t i = 0; i < ways_.size(); ++i)
      to -= amounts[static_cast<Eigen::Index>(i)] * (guesses_[i] - ways_[i]);
    return to;
  }
  void forget() {
    guesses_.clear();
    ways_.clear();
    last_way_.resize(0);
  }

 private:
  std::deque<VectorX> guesses_, ways_;
  VectorX last_guess_, last_way_;
};

}  // namespace

double farthest(std::span<const double> displacements) {
  double most = 0.0;
  for (std::size_t i = 0; i < displacements.size(); i += 3)
    most = std::max(most, Vec3::Map(displacements.data() + i).squaredNorm());
  return std::sqrt(most);
}

Result<ElasticRegion> region_unloaded(const ElasticRegion& region,
                                      std::span<const double> unloaded) {
  ElasticRegion now = region;
  now.cell_begin = {0};
  now.cell_nodes.clear();
  now.cell_gradients.clear();
  for (std::size_t q = 0; q < region.size(); ++q) {
    Mat3 f = Mat3::Identity();
    for (std::size_t e = region.begin[q]; e < region.begin[q + 1]; ++e) {
      const int node = region.nodes[static_cast<std::size_t>(region.point_nodes[e])];
      f += Vec3::Map(unloaded.data() + 3 * static_cast<std::size_t>(node)) *
           region.gradients[e].transpose();
    }
    const double volume = f.determinant();
    if (!(volume > kLeastVolume))
      return failure("unloaded shape: tissue would be turned inside out");
    const Mat3 turn = f.inverse().transpose();
    for (std::size_t e = region.begin[q]; e < region.begin[q + 1]; ++e)
      now.gradients[e] = turn * region.gradients[e];
    now.weights[q] = volume * region.weights[q];
    if (!region.fibres.empty() && region.fibres[q].modulus > 0.0)
      now.fibres[q].direction = (f * region.fibres[q].direction).normalized();
  }
  keep_products(region, now);
  return now;
}

Result<UnloadedShape> find_unloaded_shape(const ElasticRegion& region,
                                          const SymmetricBlockMatrix& hold,
                                          std::span<const double> weight,
                                          const std::function<VectorX(const VectorX&)>& answer,
                                          const Progress& progress) {
  const Unloading unloading(region, hold, weight, answer);
  Mixing mixing;
  VectorX best = VectorX::Zero(static_cast<Eigen::Index>(weight.size())), best_way, guess = best;
  double least = 0.0;
  for (int i = 0; i <= kMostUnloading; ++i) {
    if (progress && !progress(static_cast<double>(i) / kMostUnloading, "unloading"))
      return failure(kCancelled);
    const Result<VectorX> way = unloading.way_of_image(guess);
    const double off = way ? farthest({way->data(), weight.size()}) : 0.0;
    if (way && std::isfinite(off) && (best_way.size() == 0 || off < 2.0 * least)) {
      if (best_way.size() == 0 || off < least) {
        best = guess;
        best_way = *way;
        least = off;
      }
      if (least < kStillOff) {
        UnloadedShape found{.off = least, .iterations = i};
        found.displacements.assign(best.begin(), best.end());
        return found;
      }
      guess = mixing.next(guess, *way);
      continue;
    }
    if (best_way.size() == 0) return std::unexpected(way.error());
    // Too far: nearer to the best, and on from there.
    mixing.forget();
    guess = 0.5 * (guess + best);
  }
  return failure("unloaded shape: not found in " + std::to_string(kMostUnloading) +
                 " iterations; the imaged one would still go by " + std::to_string(1e3 * least) +
                 " mm");
}

}  // namespace viscera
