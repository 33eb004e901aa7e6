#include "kernels/finite/finite_body.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "kernels/base/finite.h"
#include "kernels/base/parallel.h"
#include "kernels/base/wide.h"
#include "kernels/finite/cell_points.h"
#include "kernels/finite/fibre_law.h"
#include "kernels/finite/unloaded_shape.h"

namespace viscera {
namespace {

/// Points of a piece, about: enough to be worth a thread, few enough that its nodes stay in the
/// nearest cache.
constexpr std::size_t kPointsOfPiece = 1024;
/// Points that share a "cell" where nothing is averaged.
constexpr std::size_t kPointsWithoutCell = 64;

constexpr std::size_t kTerms = ElasticRegion::kTerms;

using namespace point_lanes;

/// Of a pack: the deformation gradients row by row, how strains have changed within the step, and
/// the determinants less one.
constexpr std::size_t kOfF = 9, kOfStrain = 6, kScratch = 4 * (kOfF + kOfStrain + 1);
/// Of a pack: F, and an averaged change of volume.
constexpr std::size_t kOfDeformation = kOfF + 1;

/// E = (F^T F - 1) / 2 as xx, yy, zz, xy, yz, zx.
VISCERA_INLINE void green_strain(const Lanes* f, Lanes* e) {
  e[0] = 0.5 * (f[0] * f[0] + f[3] * f[3] + f[6] * f[6] - 1.0);
  e[1] = 0.5 * (f[1] * f[1] + f[4] * f[4] + f[7] * f[7] - 1.0);
  e[2] = 0.5 * (f[2] * f[2] + f[5] * f[5] + f[8] * f[8] - 1.0);
  e[3] = 0.5 * (f[0] * f[1] + f[3] * f[4] + f[6] * f[7]);
  e[4] = 0.5 * (f[1] * f[2] + f[4] * f[5] + f[7] * f[8]);
  e[5] = 0.5 * (f[2] * f[0] + f[5] * f[3] + f[8] * f[6]);
}

/// Of fibres by s = I4 - 1, as FibreLaw has it: energy, and its derivative by s.
VISCERA_INLINE void fibre_law(const Lanes& quarter, const Lanes& bend, const Lanes& s,
                              Lanes& energy, Lanes& slope) {
  const Lanes pressed = s < 0.0 ? s : Lanes{};
  const Lanes square = 1.0 + bend * pressed * pressed;
  Lanes root;
  for (int lane = 0; lane < 4; ++lane) root[lane] = std::sqrt(square[lane]);
  slope = quarter * s / root;
  energy = quarter * s * s / (1.0 + root);
}

/// Points in the order of their cells; without cells, in groups as they come.
struct PointOrder {
  std::vector<std::size_t> points;
  std::vector<std::size_t> cell_begin{0};
};

PointOrder order_of(const ElasticRegion& region) {
  PointOrder order;
  order.points.resize(region.size());
  std::iota(order.points.begin(), order.points.end(), std::size_t{0});
  if (region.cell.empty()) {
    for (std::size_t q = kPointsWithoutCell; q < region.size(); q += kPointsWithoutCell)
      order.cell_begin.push_back(q);
    order.cell_begin.push_back(region.size());
    return order;
  }
  std::stable_sort(order.points.begin(), order.points.end(),
                   [&](std::size_t a, std::size_t b) { return region.cell[a] < region.cell[b]; });
  for (std::size_t i = 1; i <= order.points.size(); ++i)
    if (i == order.points.size() ||
        region.cell[order.points[i]] != region.cell[order.points[i - 1]])
      order.cell_begin.push_back(i);
  return order;
}

}  // namespace

const ChangedTissue FiniteBody::kUnchanged;

/// What evaluating a cell reads.
struct FiniteBody::CellView : CellPoints {
  double viscous = 0.0;            // time mu / dt [Pa]; 0: none
  const double* before = nullptr;  // strains of its packs
  double over = 0.0;               // Overstress of its packs; 0: nothing relaxes
  const double *relaxing = nullptr, *relaxing_dilatations = nullptr, *relaxing_fibres = nullptr;

  /// Energy of a pack's fibres per volume, as F has moved them: F a, and twice the derivative of
  /// the energy by |F a|^2.
  VISCERA_INLINE void pull_fibres(std::size_t pack, const Lanes* f, Lanes* a, Lanes* moved,
                                  Lanes& energy, Lanes& pull) const {
    Lanes quarter, bend;
    for (std::size_t k = 0; k < 3; ++k) load(fibres[pack].direction[k].data(), a[k]);
    load(fibres[pack].quarter.data(), quarter);
    load(fibres[pack].bend.data(), bend);
    for (std::size_t i = 0; i < 3; ++i)
      moved[i] = f[3 * i] * a[0] + f[3 * i + 1] * a[1] + f[3 * i + 2] * a[2];
    const Lanes square = moved[0] * moved[0] + moved[1] * moved[1] + moved[2] * moved[2];
    fibre_law(quarter, bend, square - 1.0, energy, pull);
    if (over > 0.0) {
      Lanes mean, more, slope;
      load(relaxing_fibres + kLanes * pack, mean);
      fibre_law(quarter, bend, square - mean, more, slope);
      energy += over * more;
      pull += over * slope;
    }
    pull *= 2.0;
  }

  /// Overstress of a pack's points.
  VISCERA_INLINE void load_means(std::size_t pack, Lanes* mean) const {
    for (std::size_t k = 0; k < 8; ++k)
      load(relaxing + Overstress::kOfPack * pack + kLanes * k, mean[k]);
  }
};

/// Energy of what is averaged over a cell, and its derivative by the dilatations.
VISCERA_WIDE double FiniteBody::add_averaged(const CellView& cell, const double* dilatation,
                                             double* derivative) {
  double sum = 0.0;
  if (cell.changed == nullptr) {
    for (std::size_t k = 0; k < kTerms; ++k) {
      derivative[k] = cell.averaged * dilatation[k];
      sum += 0.5 * derivative[k] * dilatation[k];
      if (cell.over == 0.0) continue;
      const double half = 0.5 * cell.over * dilatation[k];
      derivative[k] += cell.averaged * (2.0 * half - cell.relaxing_dilatations[k]);
      sum += cell.averaged * dilatation[k] * (half - cell.relaxing_dilatations[k]);
    }
    return sum;
  }
  Lanes energy = {}, by[kTerms] = {};
  for (std::size_t p = 0; p < cell.packs; ++p) {
    Lanes w, growth, factor, psi[kTerms], change = {}, relaxing = {};
    load(cell.weights[p].data(), w);
    load(cell.changed[p].growth.data(), growth);
    load(cell.changed[p].factor.data(), factor);
    for (std::size_t k = 0; k < kTerms; ++k) {
      load(cell.psi[p][k].data(), psi[k]);
      change += dilatation[k] * psi[k];
      if (cell.over > 0.0) relaxing += cell.relaxing_dilatations[k] * psi[k];
    }
    const Lanes cubed = growth * growth * growth, stiff = cell.averaged * w * factor;
    const Lanes half = 0.5 * cell.over * change, since = stiff * cubed * (2.0 * half - relaxing);
    energy += stiff * cubed * cubed * change * (half - relaxing);
    change = cubed * (1.0 + change) - 1.0;
    const Lanes pull = stiff * change + since;
    energy += 0.5 * stiff * change * change;
    for (std::size_t k = 0; k < kTerms; ++k) by[k] += pull * cubed * psi[k];
  }
  for (std::size_t k = 0; k < kTerms; ++k) derivative[k] = sum_of(by[k]);
  return sum_of(energy);
}

/// Energy of a cell; adds forces, a component's four lanes after another's, to `forces` unless that
/// is null. `scratch` has kScratch numbers for each of its packs.
VISCERA_WIDE double FiniteBody::add_cell(const CellView& cell, const double* displacements,
                                         double* scratch, double* forces) {
  Lanes energy = {}, theta[kTerms] = {};
  for (std::size_t p = 0; p < cell.packs; ++p) {
    double* kept = scratch + kScratch * p;
    Lanes f[kOfF], c[kOfF], w;
    cell.deform(p, displacements, f);
    for (std::size_t i = 0; i < kOfF; ++i) store(f[i], kept + 4 * i);
    load(cell.weights[p].data(), w);
    const Lanes sound = w;
    Lanes strain[kOfStrain], cubed = Lanes{} + 1.0;
    if (cell.viscous > 0.0) green_strain(f, strain);
    if (cell.changed != nullptr) {
      Lanes growth, factor;
      load(cell.changed[p].growth.data(), growth);
      load(cell.changed[p].factor.data(), factor);
      for (std::size_t i = 0; i < kOfF; ++i) f[i] *= growth;
      w *= factor;
      cubed = growth * growth * growth;
    }
    cofactors(f, c);
    const Lanes grown = f[0] * c[0] + f[1] * c[1] + f[2] * c[2] - 1.0;
    Lanes length = f[0] * f[0];
    for (std::size_t i = 1; i < kOfF; ++i) length += f[i] * f[i];
    energy += w * (0.5 * cell.mu * (length - 3.0) - cell.mu * grown +
                   0.5 * (cell.lambda + cell.mu) * grown * grown);
    if (cell.fibres != nullptr) {
      Lanes a[3], moved[3], stretched, pull;
      cell.pull_fibres(p, f, a, moved, stretched, pull);
      energy += w * stretched;
    }
    if (cell.over > 0.0) {
      Lanes mean[8];
      cell.load_means(p, mean);
      const Lanes volume = 1.0 + grown;
      const Lanes along = mean[0] * (f[0] * f[0] + f[3] * f[3] + f[6] * f[6]) +
                          mean[1] * (f[1] * f[1] + f[4] * f[4] + f[7] * f[7]) +
                          mean[2] * (f[2] * f[2] + f[5] * f[5] + f[8] * f[8]);
      const Lanes across = mean[3] * (f[0] * f[1] + f[3] * f[4] + f[6] * f[7]) +
                           mean[4] * (f[1] * f[2] + f[4] * f[5] + f[7] * f[8]) +
                           mean[5] * (f[2] * f[0] + f[5] * f[3] + f[8] * f[6]);
      energy += w * (0.5 * cell.mu * (along + 2.0 * across) - cell.mu * mean[6] * volume +
                     (cell.lambda + cell.mu) * volume * (0.5 * cell.over * volume - mean[7]));
    }
    if (cell.viscous > 0.0) {
      Lanes(&e)[kOfStrain] = strain;
      for (std::size_t k = 0; k < kOfStrain; ++k) {
        Lanes before;
        load(cell.before + 4 * (kOfStrain * p + k), before);
        e[k] -= before;
        store(e[k], kept + 4 * (kOfF + k));
      }
      energy += sound * cell.viscous *
                (e[0] * e[0] + e[1] * e[1] + e[2] * e[2] +
                 2.0 * (e[3] * e[3] + e[4] * e[4] + e[5] * e[5]));
    }
    if (cell.psi != nullptr)
      for (std::size_t k = 0; k < kTerms; ++k) {
        Lanes psi;
        load(cell.psi[p][k].data(), psi);
        theta[k] += sound * psi * ((1.0 + grown) / cubed - 1.0);
      }
    store(grown, kept + 4 * (kOfF + kOfStrain));
  }
  double sum = sum_of(energy), dilatation[kTerms], averaged[kTerms];
  for (std::size_t k = 0; k < kTerms; ++k) dilatation[k] = sum_of(theta[k]);
  if (cell.psi != nullptr) sum += add_averaged(cell, dilatation, averaged);
  if (forces == nullptr) return sum;

  for (std::size_t p = 0; p < cell.packs; ++p) {
    const double* kept = scratch + kScratch * p;
    Lanes f[kOfF], c[kOfF], stress[kOfF], w, pressure, averaging;
    for (std::size_t i = 0; i < kOfF; ++i) load(kept + 4 * i, f[i]);
    load(cell.weights[p].data(), w);
    averaging = w;
    if (cell.viscous > 0.0) {
      Lanes e[kOfStrain];
      for (std::size_t k = 0; k < kOfStrain; ++k) load(kept + 4 * (kOfF + k), e[k]);
      const Lanes rate = 2.0 * cell.viscous * w;
      for (std::size_t i = 0; i < kOfF; i += 3) {
        stress[i] = rate * (f[i] * e[0] + f[i + 1] * e[3] + f[i + 2] * e[5]);
        stress[i + 1] = rate * (f[i] * e[3] + f[i + 1] * e[1] + f[i + 2] * e[4]);
        stress[i + 2] = rate * (f[i] * e[5] + f[i + 1] * e[4] + f[i + 2] * e[2]);
      }
    } else {
      for (std::size_t i = 0; i < kOfF; ++i) stress[i] = Lanes{};
    }
    // The law's stress is by g F, and g times it by F; the cofactors are those of g F, too.
    if (cell.changed != nullptr) {
      Lanes growth, factor;
      load(cell.changed[p].growth.data(), growth);
      load(cell.changed[p].factor.data(), factor);
      for (std::size_t i = 0; i < kOfF; ++i) f[i] *= growth;
      w *= factor * growth;
      averaging /= growth * growth;
    }
    if (cell.fibres != nullptr) {
      Lanes a[3], moved[3], stretched, pull;
      cell.pull_fibres(p, f, a, moved, stretched, pull);
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t k = 0; k < 3; ++k) stress[3 * i + k] += w * pull * moved[i] * a[k];
    }
    load(kept + 4 * (kOfF + kOfStrain), pressure);
    const Lanes volume = 1.0 + pressure;
    pressure = w * ((cell.lambda + cell.mu) * pressure - cell.mu);
    const Lanes shear = w * cell.mu;
    if (cell.over > 0.0) {
      Lanes m[8];
      cell.load_means(p, m);
      pressure += w * ((cell.lambda + cell.mu) * (cell.over * volume - m[7]) - cell.mu * m[6]);
      for (std::size_t i = 0; i < kOfF; i += 3) {
        stress[i] += shear * (f[i] * m[0] + f[i + 1] * m[3] + f[i + 2] * m[5]);
        stress[i + 1] += shear * (f[i] * m[3] + f[i + 1] * m[1] + f[i + 2] * m[4]);
        stress[i + 2] += shear * (f[i] * m[5] + f[i + 1] * m[4] + f[i + 2] * m[2]);
      }
    }
    if (cell.psi != nullptr)
      for (std::size_t k = 0; k < kTerms; ++k) {
        Lanes psi;
        load(cell.psi[p][k].data(), psi);
        pressure += averaging * averaged[k] * psi;
      }
    cofactors(f, c);
    for (std::size_t i = 0; i < kOfF; ++i) stress[i] += shear * f[i] + pressure * c[i];
    for (std::size_t e = cell.begin[p]; e < cell.begin[p + 1]; ++e) {
      Lanes g[3];
      for (std::size_t k = 0; k < 3; ++k) load(cell.gradients[e].data() + kLanes * k, g[k]);
      double* on_node = forces + 3 * kLanes * static_cast<std::size_t>(cell.nodes[e]);
      for (std::size_t i = 0; i < 3; ++i) {
        Lanes force;
        load(on_node + kLanes * i, force);
        force += stress[3 * i] * g[0] + stress[3 * i + 1] * g[1] + stress[3 * i + 2] * g[2];
        store(force, on_node + kLanes * i);
      }
    }
  }
  return sum;
}

VISCERA_WIDE void FiniteBody::find_strains(const CellView& cell, const double* displacements,
                                           double* strains) {
  for (std::size_t p = 0; p < cell.packs; ++p) {
    Lanes f[kOfF], e[kOfStrain];
    cell.deform(p, displacements, f);
    green_strain(f, e);
    for (std::size_t k = 0; k < kOfStrain; ++k) store(e[k], strains + 4 * (kOfStrain * p + k));
  }
}

/// F row by row, and what is averaged of the change of volume there.
VISCERA_WIDE void FiniteBody::find_deformations(const CellView& cell, const double* displacements,
                                                double* found) {
  Lanes theta[kTerms] = {};
  for (std::size_t p = 0; p < cell.packs; ++p) {
    Lanes f[kOfF], c[kOfF], w;
    cell.deform(p, displacements, f);
    for (std::size_t i = 0; i < kOfF; ++i) store(f[i], found + 4 * (kOfDeformation * p + i));
    if (cell.psi == nullptr) continue;
    cofactors(f, c);
    load(cell.weights[p].data(), w);
    const Lanes grown = w * (f[0] * c[0] + f[1] * c[1] + f[2] * c[2] - 1.0);
    for (std::size_t k = 0; k < kTerms; ++k) {
      Lanes psi;
      load(cell.psi[p][k].data(), psi);
      theta[k] += grown * psi;
    }
  }
  for (std::size_t p = 0; p < cell.packs; ++p) {
    Lanes averaged = {};
    for (std::size_t k = 0; cell.psi != nullptr && k < kTerms; ++k) {
      Lanes psi;
      load(cell.psi[p][k].data(), psi);
      averaged += sum_of(theta[k]) * psi;
    }
    store(averaged, found + 4 * (kOfDeformation * p + kOfF));
  }
}

/// Up to four points, with all nodes that they reach.
void FiniteBody::add_pack(const ElasticRegion& region, std::span<const std::size_t> points,
                          Piece& piece, std::vector<int>& number) {
  std::vector<std::pair<int, std::array<Vec3, kLanes>>> entries;
  for (std::size_t lane = 0; lane < points.size(); ++lane) {
    for (std::size_t e = region.begin[points[lane]]; e < region.begin[points[lane] + 1]; ++e) {
      const int node = region.nodes[static_cast<std::size_t>(region.point_nodes[e])];
      auto at = std::ranges::find(entries, node, [](const auto& entry) { return entry.first; });
      if (at == entries.end()) {
        entries.push_back({node, {}});
        at = entries.end() - 1;
        at->second.fill(Vec3::Zero());
      }
      at->second[lane] = region.gradients[e];
    }
  }
  Lane weights = {}, volumes = {};
  std::array<Lane, 4> psi = {};
  for (std::size_t lane = 0; lane < points.size(); ++lane) {
    weights[lane] = region.weights[points[lane]];
    volumes[lane] = region.volume(points[lane]);
    if (!region.cell.empty())
      for (std::size_t k = 0; k < kTerms; ++k) psi[k][lane] = region.psi[kTerms * points[lane] + k];
  }
  for (const auto& [node, gradients] : entries) {
    int& own = number[static_cast<std::size_t>(node)];
    if (own < 0) {
      own = static_cast<int>(piece.nodes.size());
      piece.nodes.push_back(node);
    }
    entry_nodes_.push_back(static_cast<std::uint16_t>(own));
    std::array<float, 3 * kLanes>& to = gradients_.emplace_back();
    for (std::size_t lane = 0; lane < kLanes; ++lane)
      for (std::size_t k = 0; k < 3; ++k)
        to[kLanes * k + lane] = static_cast<float>(gradients[lane][static_cast<Eigen::Index>(k)]);
  }
  begin_.push_back(entry_nodes_.size());
  weights_.push_back(weights);
  volumes_.push_back(volumes);
  if (!region.fibres.empty()) fibres_.push_back(fibre_pack(region, points));
  if (!region.cell.empty()) psi_.push_back(psi);
  points_ += points.size();
}

FiniteBody::FibrePack FiniteBody::fibre_pack(const ElasticRegion& region,
                                             std::span<const std::size_t> points) const {
  FibrePack pack = {};
  for (std::size_t lane = 0; lane < points.size(); ++lane) {
    const std::size_t q = points[lane];
    const Fibres& fibres = region.fibres[q];
    const double relative = region.modulus.empty() ? 1.0 : region.modulus[q];
    const FibreLaw law = FibreLaw::of(fibres.modulus / relative, mu_);
    for (std::size_t k = 0; k < 3; ++k)
      pack.direction[k][lane] = fibres.direction[static_cast<Eigen::Index>(k)];
    pack.quarter[lane] = law.quarter;
    pack.bend[lane] = law.bend;
  }
  return pack;
}

/// Of each cell the mean gradients, and of each node its cells, by the volume of their points that
/// it reaches.
void FiniteBody::find_means(const ElasticRegion& region, std::span<const std::size_t> points,
                            std::span<const std::size_t> cell_begin) {
  std::vector<std::vector<std::pair<int, double>>> shares(nodes_);
  std::vector<int> place(nodes_, -1);
  for (std::size_t c = 0; c + 1 < cell_begin.size(); ++c) {
    const std::size_t first = mean_nodes_.size();
    double volume = 0.0;
    for (std::size_t i = cell_begin[c]; i < cell_begin[c + 1]; ++i) {
      const std::size_t q = points[i];
      volume += region.weights[q];
      for (std::size_t e = region.begin[q]; e < region.begin[q + 1]; ++e) {
        const int node = region.nodes[static_cast<std::size_t>(region.point_nodes[e])];
        int& at = place[static_cast<std::size_t>(node)];
        if (at < 0) {
          at = static_cast<int>(mean_nodes_.size());
          mean_nodes_.push_back(node);
          means_.push_back(Vec3::Zero());
          shares[static_cast<std::size_t>(node)].emplace_back(static_cast<int>(c), 0.0);
        }
        means_[static_cast<std::size_t>(at)] += region.weights[q] * region.gradients[e];
        shares[static_cast<std::size_t>(node)].back().second += region.weights[q];
      }
    }
    for (std::size_t i = first; i < mean_nodes_.size(); ++i) {
      means_[i] /= volume;
      place[static_cast<std::size_t>(mean_nodes_[i])] = -1;
    }
    mean_begin_.push_back(mean_nodes_.size());
  }
  for (const auto& of : shares) {
    double sum = 0.0;
    for (const auto& [cell, weight] : of) sum += weight;
    for (const auto& [cell, weight] : of) {
      share_cells_.push_back(cell);
      shares_.push_back(weight / sum);
    }
    share_begin_.push_back(shares_.size());
  }
}

Result<FiniteBody> FiniteBody::create(const ElasticRegion& imaged, const SymmetricBlockMatrix& hold,
                                      std::span<const double> unloaded,
                                      std::span<const double> weight) {
  Result<ElasticRegion> other;
  if (!unloaded.empty()) {
    if (unloaded.size() != 3 * hold.pattern.rows() || !all_finite(unloaded))
      return failure("unloaded shape: found " + std::to_string(unloaded.size()) +
                     " numbers, expected " + std::to_string(3 * hold.pattern.rows()) +
                     ", all of them finite");
    other = region_unloaded(imaged, unloaded);
    if (!other) return std::unexpected(other.error());
  }
  const ElasticRegion& region = unloaded.empty() ? imaged : *other;
  FiniteBody body;
  body.nodes_ = hold.pattern.rows();
  body.mu_ = region.shear_modulus;
  body.lambda_ = region.pointwise_lambda;
  body.averaged_ = region.averaged_lambda;
  const PointOrder order = order_of(region);
  const std::size_t cells = order.cell_begin.size() - 1;
  std::vector<int> number(body.nodes_, -1);
  for (std::size_t cell = 0; cell < cells;) {
    Piece piece;
    piece.first_cell = cell;
    const std::size_t first = order.cell_begin[cell];
    for (; cell < cells &&
           (cell == piece.first_cell || order.cell_begin[cell + 1] - first <= kPointsOfPiece);
         ++cell) {
      const std::span points =
          std::span(order.points)
              .subspan(order.cell_begin[cell], order.cell_begin[cell + 1] - order.cell_begin[cell]);
      for (std::size_t i = 0; i < points.size(); i += kLanes)
        body.add_pack(region, points.subspan(i, std::min(kLanes, points.size() - i)), piece,
                      number);
      body.cell_begin_.push_back(body.weights_.size());
    }
    if (piece.nodes.size() > std::numeric_limits<std::uint16_t>::max())
      return failure("nodes: one group of quadrature points reaches over 65535 of them");
    piece.last_cell = cell;
    for (const int node : piece.nodes) number[static_cast<std::size_t>(node)] = -1;
    body.pieces_.push_back(std::move(piece));
  }
  body.hold_ = HoldRows(hold);
  // Parts are turned from where they were imaged, as what answers was prepared there.
  body.find_means(imaged, order.points, order.cell_begin);
  body.order_ = order.points;
  if (!unloaded.empty()) body.unload(unloaded, weight);
  return body;
}

void FiniteBody::unload(std::span<const double> unloaded, std::span<const double> weight) {
  unloaded_.assign(unloaded.begin(), unloaded.end());
  std::vector<double> room, forces(3 * nodes_, 0.0);
  Workspace workspace;
  image_energy_ = energy_unloaded(from_unloaded(forces, room), forces, workspace, {}, {}, {});
  image_forces_ = std::move(forces);
  if (weight.empty()) return;
  image_forces_.assign(weight.begin(), weight.end());
  rests_as_imaged_ = false;
}

std::span<const double> FiniteBody::from_unloaded(std::span<const double> displacements,
                                                  std::vector<double>& room) const {
  if (unloaded_.empty()) return displacements;
  room.assign(displacements.begin(), displacements.end());
  for (std::size_t i = 0; i < room.size(); ++i) room[i] -= unloaded_[i];
  return room;
}

ChangedTissue FiniteBody::changed(const TissueChange& change, double swelling) const {
  ChangedTissue changed;
  if (change.stiffness.empty() && change.shrinkage.empty() && swelling == 0.0) return changed;
  ChangedTissue::Pack sound;
  sound.growth.fill(1.0);
  sound.factor.fill(1.0);
  changed.packs.assign(weights_.size(), sound);
  const auto value = [](const std::vector<double>& of, std::size_t q, double least, double most) {
    return q < of.size() && of[q] >= least ? std::min(of[q], most) : least;
  };
  std::size_t i = 0;
  for (std::size_t p = 0; p < weights_.size(); ++p)
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      if (!(weights_[p][lane] > 0.0)) continue;
      const std::size_t q = order_[i++];
      const double left = (1.0 - value(change.shrinkage, q, 0.0, 0.5)) * (1.0 + swelling);
      changed.packs[p].growth[lane] = 1.0 / left;
      changed.packs[p].factor[lane] = value(change.stiffness, q, 1.0, 1e6) * left * left * left;
    }
  return changed;
}

FiniteBody::CellPoints FiniteBody::points_of(std::size_t cell,
                                             std::span<const ChangedTissue::Pack> changed) const {
  const std::size_t first = cell_begin_[cell];
  return {.packs = cell_begin_[cell + 1] - first,
          .begin = begin_.data() + first,
          .nodes = entry_nodes_.data(),
          .gradients = gradients_.data(),
          .weights = weights_.data() + first,
          .psi = psi_.empty() ? nullptr : psi_.data() + first,
          .fibres = fibres_.empty() ? nullptr : fibres_.data() + first,
          .changed = changed.empty() ? nullptr : changed.data() + first,
          .mu = mu_,
          .lambda = lambda_,
          .averaged = averaged_};
}

FiniteBody::CellView FiniteBody::view(std::size_t cell, const Viscosity& viscosity,
                                      const ChangedTissue& changed,
                                      const Overstress& overstress) const {
  const std::size_t first = cell_begin_[cell];
  CellView view{points_of(cell, changed.packs)};
  view.viscous = viscosity.over_step * mu_;
  if (!viscosity.before.empty()) view.before = viscosity.before.data() + 4 * kOfStrain * first;
  view.over = overstress.over;
  if (overstress.over > 0.0) {
    view.relaxing = overstress.points.data() + Overstress::kOfPack * first;
    view.relaxing_dilatations = overstress.dilatations.data() + kTerms * cell;
  }
  if (!overstress.fibres.empty()) view.relaxing_fibres = overstress.fibres.data() + kLanes * first;
  return view;
}

/// Of a piece's nodes, over its first one: what gradients in single precision act on stays small.
std::vector<double> FiniteBody::gathered(const Piece& piece,
                                         std::span<const double> displacements) const {
  std::vector<double> own(3 * piece.nodes.size());
  const double* first = displacements.data() + 3 * static_cast<std::size_t>(piece.nodes.front());
  for (std::size_t i = 0; i < piece.nodes.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k)
      own[3 * i + k] = displacements[3 * static_cast<std::size_t>(piece.nodes[i]) + k] - first[k];
  return own;
}

double FiniteBody::add_piece(const Piece& piece, std::span<const double> displacements,
                             bool with_forces, const Viscosity& viscosity,
                             const ChangedTissue& changed, const Overstress& overstress,
                             std::vector<double>& forces) const {
  const std::vector<double> own = gathered(piece, displacements);
  if (with_forces) forces.assign(kLanes * own.size(), 0.0);
  std::size_t most = 0;
  for (std::size_t c = piece.first_cell; c < piece.last_cell; ++c)
    most = std::max(most, cell_begin_[c + 1] - cell_begin_[c]);
  std::vector<double> scratch(kScratch * most);
  double energy = 0.0;
  for (std::size_t c = piece.first_cell; c < piece.last_cell; ++c)
    energy += add_cell(view(c, viscosity, changed, overstress), own.data(), scratch.data(),
                       with_forces ? forces.data() : nullptr);
  return energy;
}

double FiniteBody::energy(std::span<const double> displacements, std::span<double> gradient,
                          Workspace& workspace, const Viscosity& viscosity,
                          const ChangedTissue& changed, const Overstress& overstress) const {
  std::vector<double> room;
  double sum = energy_unloaded(from_unloaded(displacements, room), gradient, workspace, viscosity,
                               changed, overstress);
  if (unloaded_.empty()) return sum;
  sum -= image_energy_;
  for (std::size_t i = 0; i < image_forces_.size(); ++i) {
    sum -= image_forces_[i] * displacements[i];
    if (!gradient.empty()) gradient[i] -= image_forces_[i];
  }
  return sum;
}

double FiniteBody::energy_unloaded(std::span<const double> displacements,
                                   std::span<double> gradient, Workspace& workspace,
                                   const Viscosity& viscosity, const ChangedTissue& changed,
                                   const Overstress& overstress) const {
  const bool with_forces = !gradient.empty();
  workspace.forces.resize(pieces_.size());
  workspace.energies.assign(pieces_.size(), 0.0);
  parallel_for_each_index(pieces_.size(), 1, [&](std::size_t p) {
    workspace.energies[p] = add_piece(pieces_[p], displacements, with_forces, viscosity, changed,
                                      overstress, workspace.forces[p]);
  });
  double sum = overstress.constant;
  for (const double energy : workspace.energies) sum += energy;
  if (with_forces) {
    for (std::size_t p = 0; p < pieces_.size(); ++p) {
      const double* force = workspace.forces[p].data();
      for (const int node : pieces_[p].nodes)
        for (std::size_t k = 0; k < 3; ++k, force += kLanes)
          gradient[3 * static_cast<std::size_t>(node) + k] +=
              (force[0] + force[1]) + (force[2] + force[3]);
    }
  }
  add_hold(displacements, gradient, sum, overstress);
  return sum;
}

double FiniteBody::hold_energy(std::span<const double> displacements,
                               std::span<double> gradient) const {
  std::vector<double> room;
  double sum = 0.0;
  add_hold(from_unloaded(displacements, room), gradient, sum, {});
  return sum;
}

FiniteLayout FiniteBody::layout() const {
  FiniteLayout flat;
  flat.nodes = nodes_;
  flat.mu = mu_;
  flat.lambda = lambda_;
  flat.averaged = averaged_;
  flat.fibres = !fibres_.empty();
  flat.was_loaded = !unloaded_.empty();
  const auto word = [](std::size_t value) { return static_cast<std::uint32_t>(value); };
  flat.cell_begin.assign(cell_begin_.begin(), cell_begin_.end());
  flat.pack_begin.assign(begin_.begin(), begin_.end());
  for (const Piece& piece : pieces_) {
    for (std::size_t c = piece.first_cell; c < piece.last_cell; ++c)
      flat.cell_origin.push_back(word(static_cast<std::size_t>(piece.nodes.front())));
    const std::size_t first = begin_[cell_begin_[piece.first_cell]],
                      last = begin_[cell_begin_[piece.last_cell]];
    for (std::size_t e = first; e < last; ++e)
      flat.entry_nodes.push_back(word(static_cast<std::size_t>(piece.nodes[entry_nodes_[e]])));
  }
  for (const auto& entry : gradients_)
    flat.gradients.insert(flat.gradients.end(), entry.begin(), entry.end());
  for (const Lane& lane : weights_)
    flat.weights.insert(flat.weights.end(), lane.begin(), lane.end());
  for (const auto& pack : psi_)
    for (const Lane& lane : pack) flat.psi.insert(flat.psi.end(), lane.begin(), lane.end());
  return flat;
}

void FiniteBody::add_hold(std::span<const double> displacements, std::span<double> gradient,
                          double& energy, const Overstress& overstress) const {
  const std::vector<int>& nodes = hold_.nodes();
  std::vector<double> own(3 * nodes.size()), forces;
  for (std::size_t i = 0; i < nodes.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k)
      own[3 * i + k] = displacements[3 * static_cast<std::size_t>(nodes[i]) + k];
  hold_.multiply(own, forces);
  for (std::size_t i = 0; i < nodes.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      double force = (1.0 + overstress.over) * forces[4 * i + k];
      energy += 0.5 * own[3 * i + k] * force;
      if (overstress.over > 0.0) {
        energy -= own[3 * i + k] * overstress.hold_forces[4 * i + k];
        force -= overstress.hold_forces[4 * i + k];
      }
      if (!gradient.empty()) gradient[3 * static_cast<std::size_t>(nodes[i]) + k] += force;
    }
}

Mat3 FiniteBody::gradient_at(std::size_t pack, std::size_t lane, const Piece& piece,
                             std::span<const double> displacements) const {
  Mat3 f = Mat3::Identity();
  const Vec3 first =
      Vec3::Map(displacements.data() + 3 * static_cast<std::size_t>(piece.nodes.front()));
  each_node(pack, lane, [&](std::size_t number, const Vec3& gradient) {
    const auto node = static_cast<std::size_t>(piece.nodes[number]);
    f += (Vec3::Map(displacements.data() + 3 * node) - first) * gradient.transpose();
  });
  return f;
}

Strains FiniteBody::strains(std::span<const double> displacements) const {
  std::vector<double> room;
  displacements = from_unloaded(displacements, room);
  Strains all(4 * kOfStrain * weights_.size());
  parallel_for_each_index(pieces_.size(), 1, [&](std::size_t p) {
    const std::vector<double> own = gathered(pieces_[p], displacements);
    for (std::size_t c = pieces_[p].first_cell; c < pieces_[p].last_cell; ++c)
      find_strains(view(c, {}, {}, {}), own.data(), all.data() + 4 * kOfStrain * cell_begin_[c]);
  });
  return all;
}

std::vector<PointDeformation> FiniteBody::deformations(
    std::span<const double> displacements) const {
  std::vector<double> room;
  displacements = from_unloaded(displacements, room);
  std::vector<double> all(4 * kOfDeformation * weights_.size());
  parallel_for_each_index(pieces_.size(), 1, [&](std::size_t p) {
    const std::vector<double> own = gathered(pieces_[p], displacements);
    for (std::size_t c = pieces_[p].first_cell; c < pieces_[p].last_cell; ++c)
      find_deformations(view(c, {}, {}, {}), own.data(),
                        all.data() + 4 * kOfDeformation * cell_begin_[c]);
  });
  std::vector<PointDeformation> of_points(points_);
  each_point([&](std::size_t pack, std::size_t lane, std::size_t point) {
    const double* found = all.data() + 4 * kOfDeformation * pack + lane;
    for (Eigen::Index i = 0; i < 3; ++i)
      for (Eigen::Index k = 0; k < 3; ++k) of_points[point].gradient(i, k) = found[4 * (3 * i + k)];
    of_points[point].dilatation = found[4 * kOfF];
  });
  return of_points;
}

std::vector<double> FiniteBody::point_volumes() const {
  std::vector<double> of_points(points_);
  each_point([&](std::size_t pack, std::size_t lane, std::size_t point) {
    of_points[point] = volumes_[pack][lane];
  });
  return of_points;
}

double FiniteBody::volume(std::span<const double> displacements) const {
  std::vector<double> room;
  displacements = from_unloaded(displacements, room);
  double sum = 0.0;
  for (const Piece& piece : pieces_)
    for (std::size_t p = cell_begin_[piece.first_cell]; p < cell_begin_[piece.last_cell]; ++p)
      for (std::size_t lane = 0; lane < kLanes; ++lane)
        if (volumes_[p][lane] > 0.0)
          sum += volumes_[p][lane] * gradient_at(p, lane, piece, displacements).determinant();
  return sum;
}

double FiniteBody::volume() const {
  double sum = 0.0;
  for (const Lane& pack : volumes_)
    for (const double volume : pack) sum += volume;
  return sum;
}

std::vector<Mat3> FiniteBody::mean_gradients(std::span<const double> displacements) const {
  std::vector<Mat3> of_cells(cells(), Mat3::Identity());
  for (std::size_t c = 0; c < cells(); ++c)
    for (std::size_t i = mean_begin_[c]; i < mean_begin_[c + 1]; ++i)
      of_cells[c] +=
          Vec3::Map(displacements.data() + 3 * static_cast<std::size_t>(mean_nodes_[i])) *
          means_[i].transpose();
  std::vector<Mat3> of_nodes(nodes_, Mat3::Zero());
  for (std::size_t node = 0; node < nodes_; ++node)
    for (std::size_t i = share_begin_[node]; i < share_begin_[node + 1]; ++i)
      of_nodes[node] += shares_[i] * of_cells[static_cast<std::size_t>(share_cells_[i])];
  return of_nodes;
}

std::size_t FiniteBody::memory_bytes() const {
  const auto of = [](const auto& v) { return v.size() * sizeof(v[0]); };
  std::size_t sum = of(cell_begin_) + of(weights_) + of(volumes_) + of(psi_) + of(fibres_) +
                    of(begin_) + of(entry_nodes_) + of(gradients_) + hold_.memory_bytes() +
                    of(mean_begin_) + of(mean_nodes_) + of(means_) + of(share_begin_) +
                    of(share_cells_) + of(shares_) + of(order_) + of(unloaded_) + of(image_forces_);
  for (const Piece& piece : pieces_) sum += of(piece.nodes);
  return sum;
}

}  // namespace viscera
