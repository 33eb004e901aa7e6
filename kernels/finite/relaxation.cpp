#include "kernels/finite/relaxation.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "kernels/base/parallel.h"
#include "kernels/finite/finite_body.h"

namespace viscera {
namespace {

/// What is squeezed to less than this share of its volume, or turned inside out, takes hold as if
/// it had this much.
constexpr double kLeastVolume = 0.1;

constexpr std::size_t kTerms = ElasticRegion::kTerms;

/// C^-1 as xx, yy, zz, xy, yz, zx, and J.
struct Metric {
  std::array<double, 6> inverse;
  double volume;
};

/// Of a point with the Green strain e (four numbers apart), grown by g.
Metric metric_of(const double* e, double g) {
  const double square = g * g;
  const auto of = [&](std::size_t k, double one) { return square * (2.0 * e[4 * k] + one); };
  const double xx = of(0, 1.0), yy = of(1, 1.0), zz = of(2, 1.0), xy = of(3, 0.0), yz = of(4, 0.0),
               zx = of(5, 0.0);
  const std::array<double, 6> adjugate = {yy * zz - yz * yz, xx * zz - zx * zx, xx * yy - xy * xy,
                                          yz * zx - xy * zz, xy * zx - xx * yz, xy * yz - yy * zx};
  const double square_volume =
      std::max(xx * adjugate[0] + xy * adjugate[3] + zx * adjugate[5], kLeastVolume * kLeastVolume);
  Metric metric;
  for (std::size_t k = 0; k < 6; ++k) metric.inverse[k] = adjugate[k] / square_volume;
  metric.volume = std::sqrt(square_volume);
  return metric;
}

/// I4 along a of a point with such strains, grown by g.
double square_along(const double* e, const Vec3& a, double g) {
  const double stretched =
      a.x() * a.x() * e[0] + a.y() * a.y() * e[4] + a.z() * a.z() * e[8] +
      2.0 * (a.x() * a.y() * e[12] + a.y() * a.z() * e[16] + a.z() * a.x() * e[20]);
  return g * g * (a.squaredNorm() + 2.0 * stretched);
}

/// Towards what it is now, by what has let go.
void follow(double& mean, double now, const SteppedTerm& term) {
  mean += (1.0 - term.kept) * (now - mean);
}

}  // namespace

std::vector<SteppedTerm> stepped(std::span<const RelaxationTerm> terms, double time_step) {
  std::vector<SteppedTerm> all;
  for (const RelaxationTerm& term : terms) {
    const double x = time_step / term.time;
    all.push_back({std::exp(-x), term.share * (x > 0.0 ? -std::expm1(-x) / x : 1.0)});
  }
  return all;
}

double overstiffness(std::span<const SteppedTerm> terms) {
  double sum = 0.0;
  for (const SteppedTerm& term : terms) sum += term.over;
  return sum;
}

bool FiniteBody::fits(const TissueMemory& memory, std::size_t terms) const {
  const std::vector<int>& held = hold_.nodes();
  return memory.empty() ? memory.dilatations.empty() && memory.hold.empty() && memory.fibres.empty()
                        : memory.points.size() == terms * weights_.size() * TissueMemory::kOfPack &&
                              memory.dilatations.size() == terms * cells() * kTerms &&
                              memory.hold.size() == terms * 3 * held.size() &&
                              memory.fibres.size() == terms * kLanes * fibres_.size();
}

/// Of a body that has been in its imaged shape for long.
TissueMemory FiniteBody::memory_at_rest(std::size_t terms) const {
  TissueMemory memory;
  const std::size_t packs = terms * weights_.size();
  memory.points.assign(packs * TissueMemory::kOfPack, 0.0);
  for (std::size_t p = 0; p < packs; ++p)
    for (const std::size_t k : {0, 1, 2, 6})
      std::fill_n(memory.points.begin() +
                      static_cast<std::ptrdiff_t>(p * TissueMemory::kOfPack + kLanes * k),
                  kLanes, 1.0);
  memory.dilatations.assign(terms * cells() * kTerms, 0.0);
  memory.hold.assign(terms * 3 * hold_.nodes().size(), 0.0);
  memory.fibres.assign(terms * kLanes * fibres_.size(), 1.0);
  if (unloaded_.empty()) return memory;
  const std::vector<SteppedTerm> all_let_go(terms, SteppedTerm{.kept = 0.0, .over = 1.0});
  relax(std::vector<double>(3 * nodes_, 0.0), {}, all_let_go, memory);
  return memory;
}

TissueMemory FiniteBody::continued(const FiniteBody& before, const TissueMemory& memory,
                                   std::size_t terms, const Continuation& continuation) const {
  if (memory.empty()) return {};
  TissueMemory next = memory_at_rest(terms);
  struct PackLane {
    std::size_t pack = 0, lane = 0;
  };
  std::vector<PackLane> was(before.order_.size());
  before.each_point([&](std::size_t pack, std::size_t lane, std::size_t point) {
    was[point] = {pack, lane};
  });
  const auto copy = [&](const std::vector<double>& from, std::size_t from_packs, PackLane source,
                        std::vector<double>& to, std::size_t to_packs, PackLane target,
                        std::size_t numbers) {
    for (std::size_t t = 0; t < terms; ++t)
      for (std::size_t k = 0; k < numbers; ++k)
        to[((t * to_packs + target.pack) * numbers + k) * kLanes + target.lane] =
            from[((t * from_packs + source.pack) * numbers + k) * kLanes + source.lane];
  };
  std::vector<std::size_t> pack_was(weights_.size(), 0);  // of each pack's first point
  each_point([&](std::size_t pack, std::size_t lane, std::size_t point) {
    const PackLane source = was[static_cast<std::size_t>(continuation.points[point])];
    if (lane == 0) pack_was[pack] = source.pack;
    copy(memory.points, before.weights_.size(), source, next.points, weights_.size(), {pack, lane},
         TissueMemory::kOfPack / kLanes);
    if (!fibres_.empty())
      copy(memory.fibres, before.weights_.size(), source, next.fibres, weights_.size(),
           {pack, lane}, 1);
  });
  const auto volume_of = [](const FiniteBody& body, std::size_t cell) {
    double sum = 0.0;
    for (std::size_t p = body.cell_begin_[cell]; p < body.cell_begin_[cell + 1]; ++p)
      for (const double volume : body.volumes_[p]) sum += volume;
    return sum;
  };
  for (std::size_t c = 0; c < cells(); ++c) {
    const auto after = std::ranges::upper_bound(before.cell_begin_, pack_was[cell_begin_[c]]);
    const auto source = static_cast<std::size_t>(after - before.cell_begin_.begin()) - 1;
    // Projections on polynomials that have a norm of 1 on their cell.
    const double scale = std::sqrt(volume_of(*this, c) / volume_of(before, source));
    for (std::size_t t = 0; t < terms; ++t)
      for (std::size_t k = 0; k < kTerms; ++k)
        next.dilatations[(t * cells() + c) * kTerms + k] =
            scale * memory.dilatations[(t * before.cells() + source) * kTerms + k];
  }
  const std::vector<int>&held = hold_.nodes(), &held_before = before.hold_.nodes();
  for (std::size_t i = 0; i < held.size(); ++i) {
    const int node = continuation.nodes[static_cast<std::size_t>(held[i])];
    const auto found = std::ranges::lower_bound(held_before, node);
    if (found == held_before.end() || *found != node) continue;
    const auto source = static_cast<std::size_t>(found - held_before.begin());
    for (std::size_t t = 0; t < terms; ++t)
      for (std::size_t k = 0; k < 3; ++k)
        next.hold[(t * held.size() + i) * 3 + k] =
            memory.hold[(t * held_before.size() + source) * 3 + k];
  }
  next.holds = memory.holds;
  return next;
}

Overstress FiniteBody::relax(std::span<const double> displacements, const ChangedTissue& changed,
                             std::span<const SteppedTerm> terms, TissueMemory& memory) const {
  Overstress sums;
  if (terms.empty()) return sums;
  const std::size_t packs = weights_.size();
  const std::vector<int>& held = hold_.nodes();
  if (memory.empty()) memory = memory_at_rest(terms.size());
  sums.over = overstiffness(terms);
  sums.strains = std::make_shared<const Strains>(strains(displacements));
  std::vector<double> room;
  displacements = from_unloaded(displacements, room);
  sums.points.assign(packs * Overstress::kOfPack, 0.0);
  sums.dilatations.assign(cells() * kTerms, 0.0);
  sums.fibres.assign(kLanes * fibres_.size(), 0.0);
  std::vector<double> constants(pieces_.size(), 0.0);
  parallel_for_each_index(pieces_.size(), 1, [&](std::size_t piece) {
    for (std::size_t c = pieces_[piece].first_cell; c < pieces_[piece].last_cell; ++c) {
      std::array<double, kTerms> theta{};
      for (std::size_t p = cell_begin_[c]; p < cell_begin_[c + 1]; ++p)
        constants[piece] += relax_pack(p, *sums.strains, changed, terms, memory, sums, theta);
      for (std::size_t t = 0; t < terms.size(); ++t)
        for (std::size_t k = 0; k < kTerms; ++k) {
          double& mean = memory.dilatations[(t * cells() + c) * kTerms + k];
          follow(mean, theta[k], terms[t]);
          sums.dilatations[c * kTerms + k] += terms[t].over * mean;
          constants[piece] += 0.5 * averaged_ * terms[t].over * mean * mean;
        }
    }
  });
  for (const double constant : constants) sums.constant += constant;
  sums.hold.assign(3 * held.size(), 0.0);
  for (std::size_t t = 0; t < terms.size(); ++t) {
    std::vector<double> means(sums.hold.size());
    for (std::size_t i = 0; i < means.size(); ++i) {
      double& mean = memory.hold[t * means.size() + i];
      follow(mean, displacements[3 * static_cast<std::size_t>(held[i / 3]) + i % 3], terms[t]);
      means[i] = mean;
      sums.hold[i] += terms[t].over * mean;
    }
    hold_.multiply(means, sums.hold_forces);
    for (std::size_t i = 0; i < means.size(); ++i)
      sums.constant += 0.5 * terms[t].over * means[i] * sums.hold_forces[4 * (i / 3) + i % 3];
  }
  hold_.multiply(sums.hold, sums.hold_forces);
  return sums;
}

/// Adds the dilatations; the constant of these points.
double FiniteBody::relax_pack(std::size_t pack, const Strains& strains,
                              const ChangedTissue& changed, std::span<const SteppedTerm> terms,
                              TissueMemory& memory, Overstress& sums,
                              std::array<double, 4>& theta) const {
  double constant = 0.0;
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const bool grows = !changed.packs.empty();
    const double growth = grows ? changed.packs[pack].growth[lane] : 1.0;
    const double weight = weights_[pack][lane];
    const Metric now = metric_of(strains.data() + 24 * pack + lane, growth);
    if (!psi_.empty())
      for (std::size_t k = 0; k < kTerms; ++k)
        theta[k] += weight * psi_[pack][k][lane] * (now.volume / (growth * growth * growth) - 1.0);
    double square = 0.0;
    double* sum = sums.points.data() + Overstress::kOfPack * pack + lane;
    for (std::size_t t = 0; t < terms.size(); ++t) {
      const double over = terms[t].over;
      double* mean =
          memory.points.data() + TissueMemory::kOfPack * (t * weights_.size() + pack) + lane;
      for (std::size_t k = 0; k < 6; ++k) {
        follow(mean[kLanes * k], now.inverse[k], terms[t]);
        sum[kLanes * k] += over * mean[kLanes * k];
      }
      double& volume = mean[kLanes * 6];
      follow(volume, now.volume, terms[t]);
      sum[kLanes * 6] += over / volume;
      sum[kLanes * 7] += over * volume;
      square += over * volume * volume;
    }
    if (!fibres_.empty()) {
      const double now =
          square_along(strains.data() + 24 * pack + lane, fibre_direction(pack, lane), growth);
      double& sum = sums.fibres[kLanes * pack + lane];
      for (std::size_t t = 0; t < terms.size(); ++t) {
        double& mean = memory.fibres[kLanes * (t * weights_.size() + pack) + lane];
        follow(mean, now, terms[t]);
        sum += terms[t].over / sums.over * mean;
      }
    }
    const double factor = grows ? changed.packs[pack].factor[lane] : 1.0;
    constant += weight * factor * (0.5 * (lambda_ + mu_) * square - 0.5 * mu_ * sums.over);
  }
  return constant;
}

}  // namespace viscera
