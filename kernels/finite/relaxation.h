// Tissue at finite strain whose stress relaxes: quasi-linear viscoelasticity by a Prony series, as
// a hand feels it (kernels/hive/prony.h), as terms of a step's energy.
//
// Each term is a network of chains beside the elastic one, c_i times as stiff, whose chains let go
// at the rate 1 / tau_i and take hold again without stress where tissue then is [Green1946],
// [Linder2011]. Chains that took hold under the deformation F_s pull by their energy relative to
// it. Of all that hold, the step needs three means over their pasts: of (F_s^T F_s)^-1, of J_s, and
// of the dilatations theta_s of each cell:
//   W_i = c_i (mu/2 (mean : F^T F) - mu J / mean J + (lambda + mu)/2 (J - mean J)^2
//              + averaged/2 sum (theta - mean theta)^2) and a constant, and so with the hold.
// Fibres (fibre_law.h) take hold by I4 = |F a|^2 alone: they add sum c_i W(I4 - mean I4), the mean
// being that over all terms, so that what is pressed buckles all the same.
// Where strains are small that is the series to the letter: forces under a step fall as
// 1 + sum c_i exp(-t / tau_i). Turned as a whole, tissue feels nothing of it. Means are kept from
// step to step; within one they stand, and what takes hold within it pulls as for a strain that
// grows evenly over the step.
#pragma once

#include <memory>
#include <span>
#include <tuple>
#include <vector>

#include "kernels/base/fields.h"
#include "kernels/base/types.h"

namespace viscera {

/// Green strains of a body's points: of each pack xx, yy, zz, xy, yz, zx of its four   (24 packs)
using Strains = std::vector<double>;

struct RelaxationTerm {
  double share = 0.0;  ///< modulus over the long-term one, c_i
  double time = 0.0;   ///< tau_i [s]
};

/// A term in steps of one length.
struct SteppedTerm {
  double kept = 1.0;  ///< share of the chains that still hold after a step: exp(-dt / tau)
  double over = 0.0;  ///< c_i times the share of a step's rise that is left at its end
};

std::vector<SteppedTerm> stepped(std::span<const RelaxationTerm> terms, double time_step);
/// What they add to the modulus that a step meets, over the long-term one.
double overstiffness(std::span<const SteppedTerm> terms);

/// The means, term after term. Empty: tissue that has been at rest.
struct TissueMemory {
  static constexpr std::size_t kOfPack = 28;
  /// Of each pack's four points: xx, yy, zz, xy, yz, zx of the mean of C^-1; mean of J
  /// (terms x packs x 28).
  std::vector<double> points;
  std::vector<double> dilatations;  ///< of each cell                        (terms x cells x 4)
  std::vector<double> hold;         ///< displacements of its nodes [m]      (terms x nodes x 3)
  /// Of each pack's four points: I4 of their fibres; empty: there are none (terms x packs x 4).
  std::vector<double> fibres;
  /// How far its holds had moved, of each term [m]; empty: they hadn't        (terms x 3 holds).
  std::vector<double> holds;

  bool empty() const { return points.empty(); }
  static constexpr auto fields() {
    using M = TissueMemory;
    return std::tuple(field("points", &M::points), field("dilatations", &M::dilatations),
                      field("hold", &M::hold), field("fibres", &M::fibres),
                      field("holds", &M::holds));
  }
};
static_assert(fields_cover<TissueMemory>());

/// What all terms together do in a step: FiniteBody::relax makes it. Sums over terms, each times
/// its SteppedTerm::over.
struct Overstress {
  static constexpr std::size_t kOfPack = 32;
  double over = 0.0;  ///< of 1; 0: nothing relaxes
  /// Of each pack's four points: of the means of C^-1, of 1 / (mean J), of the mean J (packs x 32).
  std::vector<double> points;
  std::vector<double> dilatations;  ///< of each cell                                    (cells x 4)
  std::vector<double> hold;         ///< of its nodes [m]                                (nodes x 3)
  std::vector<double> hold_forces;  ///< what the hold makes of these [N], 4 a node      (nodes x 4)
  /// Of each pack's four points: mean I4 over all terms; empty: there are no fibres     (packs x 4)
  std::vector<double> fibres;
  double constant = 0.0;                   ///< by which tissue that has relaxed has none [J]
  std::shared_ptr<const Strains> strains;  ///< of the points as the step begins
};

}  // namespace viscera
