// The second derivative of the energy times some vectors, point by point: to put it together takes
// as long as a hundred of them.
#include <algorithm>

#include "kernels/base/parallel.h"
#include "kernels/base/wide.h"
#include "kernels/finite/fibre_law.h"
#include "kernels/finite/finite_body.h"
#include "kernels/finite/point_lanes.h"

namespace viscera {
namespace {

using namespace point_lanes;

constexpr std::size_t kTerms = ElasticRegion::kTerms, kOfF = 9;
/// Of a pack: F, its cofactors, what multiplies their change, and a change of F.
constexpr std::size_t kCofactors = 4 * kOfF, kPressure = 8 * kOfF, kChange = kPressure + 4,
                      kScratch = kChange + 4 * kOfF;

}  // namespace

/// What a cell is read from.
struct FiniteBody::TangentView {
  std::size_t packs;
  const std::size_t* begin;
  const std::uint16_t* nodes;
  const std::array<float, 3 * kLanes>* gradients;
  const Lane* weights;
  const std::array<Lane, 4>* psi;      // null: nothing is averaged
  const FibrePack* fibres;             // null: there are none
  const ChangedTissue::Pack* changed;  // null: nothing has changed
  double mu, lambda, averaged;

  /// Adds to the change of stress by F, over s g^2, what fibres make of a change `d` of F.
  VISCERA_INLINE void add_fibres(std::size_t pack, const Lanes& growth, const Lanes* f,
                                 const Lanes* d, Lanes* stress) const {
    Lanes quarter, bend, a[3], along[3], change[3];
    load(fibres[pack].quarter.data(), quarter);
    load(fibres[pack].bend.data(), bend);
    for (std::size_t k = 0; k < 3; ++k) load(fibres[pack].direction[k].data(), a[k]);
    for (std::size_t i = 0; i < 3; ++i) {
      along[i] = f[3 * i] * a[0] + f[3 * i + 1] * a[1] + f[3 * i + 2] * a[2];
      change[i] = d[3 * i] * a[0] + d[3 * i + 1] * a[1] + d[3 * i + 2] * a[2];
    }
    const Lanes squared = growth * growth;
    const Lanes length = along[0] * along[0] + along[1] * along[1] + along[2] * along[2];
    const Lanes rate = along[0] * change[0] + along[1] * change[1] + along[2] * change[2];
    Lanes slope, curvature;
    for (int lane = 0; lane < 4; ++lane) {
      const FibreLaw law{quarter[lane], bend[lane]};
      const double s = squared[lane] * length[lane] - 1.0;
      slope[lane] = law.slope(s);
      curvature[lane] = law.curvature(s);
    }
    for (std::size_t i = 0; i < 3; ++i) {
      const Lanes pull = 2.0 * slope * change[i] + 4.0 * curvature * squared * rate * along[i];
      for (std::size_t k = 0; k < 3; ++k) stress[3 * i + k] += pull * a[k];
    }
  }

  /// The gradient of `displacements` at a pack's points, added to f.
  VISCERA_INLINE void add_gradient(std::size_t pack, const double* displacements, Lanes* f) const {
    for (std::size_t e = begin[pack]; e < begin[pack + 1]; ++e) {
      Lanes g[3];
      for (std::size_t k = 0; k < 3; ++k) load(gradients[e].data() + kLanes * k, g[k]);
      const double* u = displacements + 3 * static_cast<std::size_t>(nodes[e]);
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t k = 0; k < 3; ++k) f[3 * i + k] += u[i] * g[k];
    }
  }

  /// Its growth g, and s / g^3 times the weights.
  VISCERA_INLINE void load_growth(std::size_t pack, const Lanes& weight, Lanes& growth,
                                  Lanes& stiff) const {
    growth = Lanes{} + 1.0;
    stiff = weight;
    if (changed == nullptr) return;
    Lanes factor;
    load(changed[pack].growth.data(), growth);
    load(changed[pack].factor.data(), factor);
    stiff = weight * factor;
  }

  /// By what is averaged: its second derivative times dilatations (`change`; less constants), or
  /// its first derivative at dilatations.
  VISCERA_INLINE void average(const double* dilatation, bool change, double* derivative) const {
    if (changed == nullptr) {
      for (std::size_t k = 0; k < kTerms; ++k) derivative[k] = averaged * dilatation[k];
      return;
    }
    Lanes by[kTerms] = {};
    for (std::size_t p = 0; p < packs; ++p) {
      Lanes w, growth, stiff, terms[kTerms], volume = {};
      load(weights[p].data(), w);
      load_growth(p, w, growth, stiff);
      for (std::size_t k = 0; k < kTerms; ++k) {
        load(psi[p][k].data(), terms[k]);
        volume += dilatation[k] * terms[k];
      }
      const Lanes cubed = growth * growth * growth;
      volume = change ? cubed * volume : cubed * (1.0 + volume) - 1.0;
      for (std::size_t k = 0; k < kTerms; ++k)
        by[k] += averaged * stiff * cubed * volume * terms[k];
    }
    for (std::size_t k = 0; k < kTerms; ++k) derivative[k] = sum_of(by[k]);
  }
};

/// F, its cofactors and the pressures of a cell, into `scratch`.
VISCERA_WIDE void FiniteBody::find_tangent(const TangentView& cell, const double* displacements,
                                           double* scratch) {
  Lanes theta[kTerms] = {};
  for (std::size_t p = 0; p < cell.packs; ++p) {
    double* kept = scratch + kScratch * p;
    Lanes f[kOfF], c[kOfF], w, growth, stiff;
    for (std::size_t i = 0; i < kOfF; ++i) f[i] = Lanes{} + (i % 4 == 0 ? 1.0 : 0.0);
    cell.add_gradient(p, displacements, f);
    cofactors(f, c);
    for (std::size_t i = 0; i < kOfF; ++i) {
      store(f[i], kept + 4 * i);
      store(c[i], kept + kCofactors + 4 * i);
    }
    load(cell.weights[p].data(), w);
    cell.load_growth(p, w, growth, stiff);
    const Lanes volume = f[0] * c[0] + f[1] * c[1] + f[2] * c[2];
    const Lanes cubed = growth * growth * growth;
    // The law's is by g F, whose cofactors are g^2 times as great, and times g by F.
    store(stiff * cubed * ((cell.lambda + cell.mu) * (cubed * volume - 1.0) - cell.mu),
          kept + kPressure);
    if (cell.psi == nullptr) continue;
    for (std::size_t k = 0; k < kTerms; ++k) {
      Lanes psi;
      load(cell.psi[p][k].data(), psi);
      theta[k] += w * psi * (volume - 1.0);
    }
  }
  if (cell.psi == nullptr) return;
  double dilatation[kTerms], derivative[kTerms];
  for (std::size_t k = 0; k < kTerms; ++k) dilatation[k] = sum_of(theta[k]);
  cell.average(dilatation, false, derivative);
  for (std::size_t p = 0; p < cell.packs; ++p) {
    double* kept = scratch + kScratch * p;
    Lanes w, pressure;
    load(cell.weights[p].data(), w);
    load(kept + kPressure, pressure);
    for (std::size_t k = 0; k < kTerms; ++k) {
      Lanes psi;
      load(cell.psi[p][k].data(), psi);
      pressure += w * derivative[k] * psi;
    }
    store(pressure, kept + kPressure);
  }
}

/// Adds what a cell makes of one vector, a component's four lanes after another's.
VISCERA_WIDE void FiniteBody::add_tangent(const TangentView& cell, const double* direction,
                                          double* scratch, double* forces) {
  Lanes theta[kTerms] = {};
  for (std::size_t p = 0; p < cell.packs; ++p) {
    double* kept = scratch + kScratch * p;
    Lanes d[kOfF] = {};
    cell.add_gradient(p, direction, d);
    for (std::size_t i = 0; i < kOfF; ++i) store(d[i], kept + kChange + 4 * i);
    if (cell.psi == nullptr) continue;
    Lanes w, change = {};
    load(cell.weights[p].data(), w);
    for (std::size_t i = 0; i < kOfF; ++i) {
      Lanes c;
      load(kept + kCofactors + 4 * i, c);
      change += c * d[i];
    }
    for (std::size_t k = 0; k < kTerms; ++k) {
      Lanes psi;
      load(cell.psi[p][k].data(), psi);
      theta[k] += w * psi * change;
    }
  }
  double dilatation[kTerms], derivative[kTerms];
  if (cell.psi != nullptr) {
    for (std::size_t k = 0; k < kTerms; ++k) dilatation[k] = sum_of(theta[k]);
    cell.average(dilatation, true, derivative);
  }
  for (std::size_t p = 0; p < cell.packs; ++p) {
    const double* kept = scratch + kScratch * p;
    Lanes f[kOfF], c[kOfF], d[kOfF], turned[kOfF], w, growth, stiff, pressure, change = {};
    for (std::size_t i = 0; i < kOfF; ++i) {
      load(kept + 4 * i, f[i]);
      load(kept + kCofactors + 4 * i, c[i]);
      load(kept + kChange + 4 * i, d[i]);
      change += c[i] * d[i];
    }
    load(kept + kPressure, pressure);
    load(cell.weights[p].data(), w);
    cell.load_growth(p, w, growth, stiff);
    const Lanes squared = growth * growth;
    Lanes rise = (cell.lambda + cell.mu) * stiff * squared * squared * squared * change;
    if (cell.psi != nullptr)
      for (std::size_t k = 0; k < kTerms; ++k) {
        Lanes psi;
        load(cell.psi[p][k].data(), psi);
        rise += w * derivative[k] * psi;
      }
    change_of_cofactors(f, d, turned);
    const Lanes shear = cell.mu * stiff * squared;
    Lanes stress[kOfF] = {};
    if (cell.fibres != nullptr) {
      cell.add_fibres(p, growth, f, d, stress);
      for (std::size_t i = 0; i < kOfF; ++i) stress[i] *= stiff * squared;
    }
    for (std::size_t i = 0; i < kOfF; ++i)
      stress[i] += shear * d[i] + rise * c[i] + pressure * turned[i];
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
}

MatrixX FiniteBody::tangent_times(std::span<const double> displacements, const MatrixX& directions,
                                  const ChangedTissue& changed) const {
  const auto columns = static_cast<std::size_t>(directions.cols());
  const auto column = [&](std::size_t c) {
    return std::span<const double>(directions.col(static_cast<Eigen::Index>(c)).data(), 3 * nodes_);
  };
  std::vector<std::vector<double>> forces(pieces_.size());
  parallel_for_each_index(pieces_.size(), 1, [&](std::size_t i) {
    const Piece& piece = pieces_[i];
    const std::vector<double> at = gathered(piece, displacements);
    std::vector<std::vector<double>> along;
    for (std::size_t c = 0; c < columns; ++c) along.push_back(gathered(piece, column(c)));
    const std::size_t size = kLanes * at.size();
    forces[i].assign(columns * size, 0.0);
    std::size_t most = 0;
    for (std::size_t c = piece.first_cell; c < piece.last_cell; ++c)
      most = std::max(most, cell_begin_[c + 1] - cell_begin_[c]);
    std::vector<double> scratch(kScratch * most);
    for (std::size_t c = piece.first_cell; c < piece.last_cell; ++c) {
      const std::size_t first = cell_begin_[c];
      const TangentView cell{
          .packs = cell_begin_[c + 1] - first,
          .begin = begin_.data() + first,
          .nodes = entry_nodes_.data(),
          .gradients = gradients_.data(),
          .weights = weights_.data() + first,
          .psi = psi_.empty() ? nullptr : psi_.data() + first,
          .fibres = fibres_.empty() ? nullptr : fibres_.data() + first,
          .changed = changed.packs.empty() ? nullptr : changed.packs.data() + first,
          .mu = mu_,
          .lambda = lambda_,
          .averaged = averaged_};
      find_tangent(cell, at.data(), scratch.data());
      for (std::size_t k = 0; k < columns; ++k)
        add_tangent(cell, along[k].data(), scratch.data(), forces[i].data() + size * k);
    }
  });
  MatrixX product = MatrixX::Zero(directions.rows(), directions.cols());
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    const double* force = forces[i].data();
    for (Eigen::Index c = 0; c < product.cols(); ++c)
      for (const int node : pieces_[i].nodes)
        for (Eigen::Index k = 0; k < 3; ++k, force += kLanes)
          product(3 * node + k, c) += (force[0] + force[1]) + (force[2] + force[3]);
  }
  double energy = 0.0;
  for (std::size_t c = 0; c < columns; ++c)
    add_hold(column(c), {product.col(static_cast<Eigen::Index>(c)).data(), 3 * nodes_}, energy, {});
  return product;
}

}  // namespace viscera
