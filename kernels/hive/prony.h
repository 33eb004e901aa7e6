// Rate dependence of a pressed tissue's force by a Prony series: quasi-linear viscoelasticity
// [Fung1993] ch. 7.
//
// The elastic force F_e is that of the long-term modulus, which material files name and the scene
// rests at. g_i are shares of the instantaneous modulus, as is usual, sum g < 1: under a step
//   F(t) = F_e (1 + sum_i c_i exp(-t / tau_i)),  c_i = g_i / (1 - sum g),
// so at first the force is F_e / (1 - sum g), and relaxes to F_e. In general
//   F = F_e + sum_i Q_i,   dQ_i/dt = -Q_i / tau_i + c_i dF_e/dt,
// which is integrated exactly for an F_e that is linear in time between ticks, of any length.
//
// What relaxed doesn't pull at a tool that goes away: where F would be negative the surface leaves
// the tool and comes back at its own rate, F = 0 with as much F_e as that needs.
//
// Closed paths give back no energy where F_e rises with depth x. Over a period the work of Q_i is
//   oint Q_i dx = oint x Q_i dt / tau_i  (F_e is a function of x, so oint x dF_e = 0),
// and Q_i = c_i (F_e - its mean over the past, weighted by exp(-s / tau_i) / tau_i). x and F_e rise
// together, so oint x(t) F_e(t - s) dt is largest for s = 0 (rearrangement): what is left isn't
// negative.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "kernels/base/fields.h"

namespace viscera {

struct PronyTerm {
  double g = 0.0;    ///< share of the instantaneous modulus
  double tau = 0.0;  ///< [s]
};

class PronyForce {
 public:
  static constexpr std::size_t kMostTerms = 8;

  PronyForce() = default;
  /// At most kMostTerms; each g > 0 and tau > 0, sum of g below 1.
  explicit PronyForce(std::span<const PronyTerm> terms) : count_(terms.size()) {
    double sum = 0.0;
    for (const PronyTerm& term : terms) sum += term.g;
    for (std::size_t i = 0; i < count_; ++i) {
      share_[i] = terms[i].g / (1.0 - sum);
      tau_[i] = terms[i].tau;
    }
    instantaneous_ = 1.0 / (1.0 - sum);
  }

  bool empty() const { return count_ == 0; }
  /// Instantaneous over long-term modulus.
  double instantaneous() const { return instantaneous_; }
  /// What the force rises by over a tick of `dt` per rise of the elastic one.
  double over(double dt) const {
    double sum = 1.0;
    for (std::size_t i = 0; i < count_; ++i) sum += share_[i] * carried(dt / tau_[i]);
    return sum;
  }

  /// Force after a tick of `dt` [s] at whose end the elastic one is `elastic` [N], >= 0.
  double update(double elastic, double dt) {
    if (count_ == 0) return elastic;
    double kept = 0.0;
    for (std::size_t i = 0; i < count_; ++i) kept += state_.q[i] *= std::exp(-dt / tau_[i]);
    const double slope = over(dt);
    double rise = elastic - state_.elastic, force = state_.elastic + kept + slope * rise;
    if (force < 0.0) {
      rise = -(state_.elastic + kept) / slope;
      force = 0.0;
    }
    state_.elastic += rise;
    for (std::size_t i = 0; i < count_; ++i)
      state_.q[i] += share_[i] * carried(dt / tau_[i]) * rise;
    return force;
  }

  /// Forgets: tissue at rest.
  void reset() { state_ = {}; }

  struct State {
    std::array<double, kMostTerms> q{};  ///< Q_i; 0 beyond the terms [N]
    double elastic = 0.0;                ///< F_e of the last update [N]
    static constexpr auto fields() {
      return std::tuple(field("q", &State::q), field("elastic", &State::elastic));
    }
  };
  const State& state() const { return state_; }
  void restore(const State& state) { state_ = state; }
  bool fits(const State& state) const {
    return std::all_of(state.q.begin() + static_cast<std::ptrdiff_t>(count_), state.q.end(),
                       [](double one) { return one == 0.0; });
  }
  /// Sum of Q_i: what of the force is yet to relax [N].
  double transient() const {
    double sum = 0.0;
    for (std::size_t i = 0; i < count_; ++i) sum += state_.q[i];
    return sum;
  }

 private:
  /// (1 - exp(-x)) / x
  static double carried(double x) { return x > 0.0 ? -std::expm1(-x) / x : 1.0; }

  std::size_t count_ = 0;
  std::array<double, kMostTerms> share_{}, tau_{};
  double instantaneous_ = 1.0;
  State state_;
};
static_assert(fields_cover<PronyForce::State>());

}  // namespace viscera
