// The second derivative of the energy times some vectors, point by point: to put it together takes
// as long as a hundred of them.
#include <algorithm>

#include "kernels/base/parallel.h"
#include "kernels/base/wide.h"
#include "kernels/finite/cell_points.h"
#include "kernels/finite/fibre_law.h"

namespace viscera {
namespace {

using namespace point_lanes;

constexpr std::size_t kTerms = ElasticRegion::kTerms, kOfF = 9;

/// Of a pack's points for some vectors, one after the other, in single precision: the product errs
/// by what rounding the gradients to that does. A hand asks for three.
struct InPairs {
  static constexpr std::size_t kVectors = 2, kLanes = 4 * kVectors;
  using Batch = float __attribute__((vector_size(32)));
  /// The same numbers for all.
  VISCERA_INLINE static void repeat(const FloatLanes& one, Batch& to) {
    to = __builtin_shufflevector(one, one, 0, 1, 2, 3, 0, 1, 2, 3);
  }
};
/// For registers of 64 bytes alone: in others GCC 12 takes such vectors apart, six times as slow.
struct InFours {
  static constexpr std::size_t kVectors = 4, kLanes = 4 * kVectors;
  using Batch = float __attribute__((vector_size(64)));
  VISCERA_INLINE static void repeat(const FloatLanes& one, Batch& to) {
    InPairs::Batch two;
    InPairs::repeat(one, two);
    to = __builtin_shufflevector(two, two, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  }
};

template <class In>
VISCERA_INLINE void load_for_all(const float* from, typename In::Batch& to) {
  FloatLanes one;
  std::memcpy(&one, from, sizeof one);
  In::repeat(one, to);
}
template <class In>
VISCERA_INLINE void load_for_all(const double* from, typename In::Batch& to) {
  Lanes wide;
  FloatLanes one;
  load(from, wide);
  narrow(wide, one);
  In::repeat(one, to);
}
template <class Batch>
VISCERA_INLINE void load_batch(const float* from, Batch& to) {
  std::memcpy(&to, from, sizeof to);
}
template <class Batch>
VISCERA_INLINE void store_batch(const Batch& from, float* to) {
  std::memcpy(to, &from, sizeof from);
}
VISCERA_INLINE void store_narrow(const Lanes& from, float* to) {
  FloatLanes one;
  narrow(from, one);
  std::memcpy(to, &one, sizeof one);
}

/// Of a pack, as PointTangents has it: F, its cofactors, what multiplies their change, and where
/// fibres have come with what multiplies their change and their stretch.
constexpr std::size_t kCofactors = 4 * kOfF, kPressure = 8 * kOfF, kFibres = kPressure + 4,
                      kOfPack = kFibres + 5 * 4;
/// A change of F for a batch of vectors.
constexpr std::size_t kScratch = InFours::kLanes * kOfF;

}  // namespace

/// What a cell is read from.
struct FiniteBody::TangentView : CellPoints {
  float* kept = nullptr;  // PointTangents of its packs

  /// Of fibres: F a, what multiplies D a in the change of stress by a change D of F, and what
  /// multiplies (F a . D a) F a.
  VISCERA_INLINE void keep_fibres(std::size_t pack, const Lanes& growth, const Lanes& stiff,
                                  const Lanes* f, float* kept) const {
    Lanes quarter, bend, a[3], along[3];
    load(fibres[pack].quarter.data(), quarter);
    load(fibres[pack].bend.data(), bend);
    for (std::size_t k = 0; k < 3; ++k) load(fibres[pack].direction[k].data(), a[k]);
    for (std::size_t i = 0; i < 3; ++i)
      along[i] = f[3 * i] * a[0] + f[3 * i + 1] * a[1] + f[3 * i + 2] * a[2];
    const Lanes squared = growth * growth;
    const Lanes length = along[0] * along[0] + along[1] * along[1] + along[2] * along[2];
    Lanes slope, curvature;
    for (int lane = 0; lane < 4; ++lane) {
      const FibreLaw law{quarter[lane], bend[lane]};
      const double s = squared[lane] * length[lane] - 1.0;
      slope[lane] = law.slope(s);
      curvature[lane] = law.curvature(s);
    }
    for (std::size_t i = 0; i < 3; ++i) store_narrow(along[i], kept + 4 * i);
    store_narrow(2.0 * slope * stiff * squared, kept + 12);
    store_narrow(4.0 * curvature * stiff * squared * squared, kept + 16);
  }
  template <class In>
  VISCERA_INLINE void add_fibres(std::size_t pack, const float* kept, const typename In::Batch* d,
                                 typename In::Batch* stress) const {
    using Batch = typename In::Batch;
    Batch a[3], along[3], change[3], pull, stretch;
    for (std::size_t k = 0; k < 3; ++k) {
      load_for_all<In>(fibres[pack].direction[k].data(), a[k]);
      load_for_all<In>(kept + 4 * k, along[k]);
    }
    load_for_all<In>(kept + 12, pull);
    load_for_all<In>(kept + 16, stretch);
    for (std::size_t i = 0; i < 3; ++i)
      change[i] = d[3 * i] * a[0] + d[3 * i + 1] * a[1] + d[3 * i + 2] * a[2];
    stretch *= along[0] * change[0] + along[1] * change[1] + along[2] * change[2];
    for (std::size_t i = 0; i < 3; ++i) {
      const Batch more = pull * change[i] + stretch * along[i];
      for (std::size_t k = 0; k < 3; ++k) stress[3 * i + k] += more * a[k];
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

/// F, its cofactors, the pressures and fibres of a cell.
VISCERA_WIDE void FiniteBody::find_tangent(const TangentView& cell, const double* displacements) {
  Lanes theta[kTerms] = {};
  for (std::size_t p = 0; p < cell.packs; ++p) {
    float* kept = cell.kept + kOfPack * p;
    Lanes f[kOfF], c[kOfF], w, growth, stiff;
    cell.deform(p, displacements, f);
    cofactors(f, c);
    for (std::size_t i = 0; i < kOfF; ++i) {
      store_narrow(f[i], kept + 4 * i);
      store_narrow(c[i], kept + kCofactors + 4 * i);
    }
    load(cell.weights[p].data(), w);
    cell.load_growth(p, w, growth, stiff);
    if (cell.fibres != nullptr) cell.keep_fibres(p, growth, stiff, f, kept + kFibres);
    const Lanes volume = f[0] * c[0] + f[1] * c[1] + f[2] * c[2];
    const Lanes cubed = growth * growth * growth;
    // The law's is by g F, whose cofactors are g^2 times as great, and times g by F.
    store_narrow(stiff * cubed * ((cell.lambda + cell.mu) * (cubed * volume - 1.0) - cell.mu),
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
    float* kept = cell.kept + kOfPack * p;
    Lanes w, pressure;
    load(cell.weights[p].data(), w);
    load(kept + kPressure, pressure);
    for (std::size_t k = 0; k < kTerms; ++k) {
      Lanes psi;
      load(cell.psi[p][k].data(), psi);
      pressure += w * derivative[k] * psi;
    }
    store_narrow(pressure, kept + kPressure);
  }
}

/// Adds what a cell makes of a batch of vectors: `directions` has each of a node's components four
/// times for each of them, `forces` the four lanes of each.
template <class In>
VISCERA_INLINE void FiniteBody::add_tangent(const TangentView& cell, const float* directions,
                                            float* scratch, float* forces) {
  using Batch = typename In::Batch;
  Batch theta[kTerms] = {};
  for (std::size_t p = 0; p < cell.packs; ++p) {
    const float* kept = cell.kept + kOfPack * p;
    float* change_here = scratch + kScratch * p;
    Batch d[kOfF] = {};
    for (std::size_t e = cell.begin[p]; e < cell.begin[p + 1]; ++e) {
      const float* u = directions + 3 * In::kLanes * static_cast<std::size_t>(cell.nodes[e]);
      Batch g[3], moved;
      __builtin_prefetch(cell.gradients + e + kEntriesAhead);
      for (std::size_t k = 0; k < 3; ++k)
        load_for_all<In>(cell.gradients[e].data() + kLanes * k, g[k]);
      for (std::size_t i = 0; i < 3; ++i) {
        load_batch(u + In::kLanes * i, moved);
        for (std::size_t k = 0; k < 3; ++k) d[3 * i + k] += moved * g[k];
      }
    }
    for (std::size_t i = 0; i < kOfF; ++i) store_batch(d[i], change_here + In::kLanes * i);
    if (cell.psi == nullptr) continue;
    Batch w, change = {};
    load_for_all<In>(cell.weights[p].data(), w);
    for (std::size_t i = 0; i < kOfF; ++i) {
      Batch c;
      load_for_all<In>(kept + kCofactors + 4 * i, c);
      change += c * d[i];
    }
    change *= w;
    for (std::size_t k = 0; k < kTerms; ++k) {
      Batch psi;
      load_for_all<In>(cell.psi[p][k].data(), psi);
      theta[k] += psi * change;
    }
  }
  Batch derivative[kTerms];
  if (cell.psi != nullptr) {
    double one[kTerms], by[In::kVectors][kTerms];
    for (std::size_t v = 0; v < In::kVectors; ++v) {
      for (std::size_t k = 0; k < kTerms; ++k) {
        const Batch& sums = theta[k];
        one[k] = static_cast<double>((sums[4 * v] + sums[4 * v + 1]) +
                                     (sums[4 * v + 2] + sums[4 * v + 3]));
      }
      cell.average(one, true, by[v]);
    }
    for (std::size_t k = 0; k < kTerms; ++k)
      for (std::size_t lane = 0; lane < In::kLanes; ++lane)
        derivative[k][lane] = static_cast<float>(by[lane / 4][k]);
  }
  const auto bulk = static_cast<float>(cell.lambda + cell.mu),
             shear_modulus = static_cast<float>(cell.mu);
  for (std::size_t p = 0; p < cell.packs; ++p) {
    const float* kept = cell.kept + kOfPack * p;
    Lanes weight, growth_of, stiff_of;
    load(cell.weights[p].data(), weight);
    cell.load_growth(p, weight, growth_of, stiff_of);
    double of_points[3][4];
    store(weight, of_points[0]);
    store(stiff_of * growth_of * growth_of, of_points[1]);
    store(growth_of, of_points[2]);
    Batch f[kOfF], c[kOfF], d[kOfF], turned[kOfF], w, stiff, growth, pressure, change = {};
    load_for_all<In>(of_points[0], w);
    load_for_all<In>(of_points[1], stiff);
    load_for_all<In>(of_points[2], growth);
    for (std::size_t i = 0; i < kOfF; ++i) {
      load_for_all<In>(kept + 4 * i, f[i]);
      load_for_all<In>(kept + kCofactors + 4 * i, c[i]);
      load_batch(scratch + kScratch * p + In::kLanes * i, d[i]);
      change += c[i] * d[i];
    }
    load_for_all<In>(kept + kPressure, pressure);
    Batch rise = bulk * stiff * (growth * growth) * (growth * growth) * change;
    if (cell.psi != nullptr)
      for (std::size_t k = 0; k < kTerms; ++k) {
        Batch psi;
        load_for_all<In>(cell.psi[p][k].data(), psi);
        rise += w * derivative[k] * psi;
      }
    change_of_cofactors(f, d, turned);
    const Batch shear = shear_modulus * stiff;
    Batch stress[kOfF];
    for (std::size_t i = 0; i < kOfF; ++i)
      stress[i] = shear * d[i] + rise * c[i] + pressure * turned[i];
    if (cell.fibres != nullptr) cell.add_fibres<In>(p, kept + kFibres, d, stress);
    for (std::size_t e = cell.begin[p]; e < cell.begin[p + 1]; ++e) {
      Batch g[3];
      for (std::size_t k = 0; k < 3; ++k)
        load_for_all<In>(cell.gradients[e].data() + kLanes * k, g[k]);
      float* on_node = forces + 3 * In::kLanes * static_cast<std::size_t>(cell.nodes[e]);
      for (std::size_t i = 0; i < 3; ++i) {
        Batch force;
        load_batch(on_node + In::kLanes * i, force);
        force += stress[3 * i] * g[0] + stress[3 * i + 1] * g[1] + stress[3 * i + 2] * g[2];
        store_batch(force, on_node + In::kLanes * i);
      }
    }
  }
}

VISCERA_WIDE void FiniteBody::add_tangent_in_pairs(const TangentView& cell, const float* directions,
                                                   float* scratch, float* forces) {
  add_tangent<InPairs>(cell, directions, scratch, forces);
}
#if VISCERA_THREE_TARGETS
VISCERA_FOR_AVX512 void FiniteBody::add_tangent_in_fours(const TangentView& cell,
                                                         const float* directions, float* scratch,
                                                         float* forces) {
  add_tangent<InFours>(cell, directions, scratch, forces);
}
#endif

FiniteBody::TangentPass FiniteBody::tangent_pass([[maybe_unused]] bool in_pairs) {
#if VISCERA_THREE_TARGETS
  if (!in_pairs && __builtin_cpu_supports("avx512f"))
    return {InFours::kVectors, add_tangent_in_fours};
#endif
  return {InPairs::kVectors, add_tangent_in_pairs};
}

FiniteBody::TangentView FiniteBody::tangent_view(std::size_t cell,
                                                 const PointTangents& tangents) const {
  TangentView view{points_of(cell, tangents.changed)};
  view.kept = tangents.packs.get() + kOfPack * cell_begin_[cell];
  return view;
}

PointTangents FiniteBody::point_tangents(std::span<const double> displacements,
                                         const ChangedTissue& changed) const {
  std::vector<double> room;
  displacements = from_unloaded(displacements, room);
  PointTangents tangents{std::make_unique_for_overwrite<float[]>(kOfPack * weights_.size()),
                         changed.packs};
  parallel_for_each_index(pieces_.size(), 1, [&](std::size_t i) {
    const std::vector<double> at = gathered(pieces_[i], displacements);
    for (std::size_t c = pieces_[i].first_cell; c < pieces_[i].last_cell; ++c)
      find_tangent(tangent_view(c, tangents), at.data());
  });
  return tangents;
}

MatrixX FiniteBody::tangent_times(const PointTangents& tangents, const MatrixX& directions,
                                  bool in_pairs) const {
  const auto columns = static_cast<std::size_t>(directions.cols());
  const auto column = [&](std::size_t c) {
    return std::span<const double>(directions.col(static_cast<Eigen::Index>(c)).data(), 3 * nodes_);
  };
  const TangentPass pass = tangent_pass(in_pairs);
  const std::size_t vectors = pass.vectors, lanes = 4 * vectors;
  const std::size_t batches = (columns + vectors - 1) / vectors;
  std::vector<std::vector<float>> forces(pieces_.size());
  parallel_for_each_index(pieces_.size(), 1, [&](std::size_t i) {
    const Piece& piece = pieces_[i];
    const std::size_t size = 3 * lanes * piece.nodes.size();
    std::vector<float> along(batches * size, 0.0f);
    for (std::size_t c = 0; c < columns; ++c) {
      const std::vector<double> one = gathered(piece, column(c));
      float* to = along.data() + c / vectors * size + c % vectors * 4;
      for (std::size_t k = 0; k < one.size(); ++k)
        std::fill_n(to + lanes * k, 4, static_cast<float>(one[k]));
    }
    forces[i].assign(batches * size, 0.0f);
    std::size_t most = 0;
    for (std::size_t c = piece.first_cell; c < piece.last_cell; ++c)
      most = std::max(most, cell_begin_[c + 1] - cell_begin_[c]);
    std::vector<float> scratch(kScratch * most);
    for (std::size_t c = piece.first_cell; c < piece.last_cell; ++c)
      for (std::size_t batch = 0; batch < batches; ++batch)
        pass.add(tangent_view(c, tangents), along.data() + size * batch, scratch.data(),
                 forces[i].data() + size * batch);
  });
  MatrixX product = MatrixX::Zero(directions.rows(), directions.cols());
  for (std::size_t i = 0; i < pieces_.size(); ++i)
    for (std::size_t c = 0; c < columns; ++c) {
      const std::size_t size = 3 * lanes * pieces_[i].nodes.size();
      const float* force = forces[i].data() + c / vectors * size + c % vectors * 4;
      double* to = product.col(static_cast<Eigen::Index>(c)).data();
      for (const int node : pieces_[i].nodes)
        for (int k = 0; k < 3; ++k, force += lanes)
          to[3 * node + k] += static_cast<double>((force[0] + force[1]) + (force[2] + force[3]));
    }
  hold_times(directions, product);
  return product;
}

/// What the hold makes of these vectors, added to `product`.
void FiniteBody::hold_times(const MatrixX& directions, MatrixX& product) const {
  const std::vector<int>& nodes = hold_.nodes();
  const auto columns = static_cast<std::size_t>(directions.cols());
  std::vector<double> own, forces;
  own.reserve(3 * nodes.size() * columns);
  for (const auto& column : directions.colwise())
    for (const int node : nodes)
      for (int k = 0; k < 3; ++k) own.push_back(column[3 * node + k]);
  hold_.multiply(own, forces, columns);
  const double* force = forces.data();
  for (auto column : product.colwise())
    for (const int node : nodes) {
      column.segment<3>(3 * node) += Vec3::Map(force);
      force += 4;
    }
}

}  // namespace viscera
