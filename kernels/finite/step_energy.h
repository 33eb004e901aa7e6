// What a step of a body at finite strain minimises.
#pragma once

#include <memory>
#include <span>

#include "kernels/base/types.h"
#include "kernels/finite/finite_solver.h"

namespace viscera {

/// E(u) = elastic + time mu / dt |E - E_n|^2 + sum_J m_J (|u_J - u~_J|^2 / (2 dt^2) - a . u_J)
/// - f . u, with u~ = u_n + dt v_n; of one step, that from `state` on.
class StepEnergy {
 public:
  /// `masses` of the nodes [kg]; `load` besides the weight of the options; `strains` of an earlier
  /// one of the same step, or null. All outlive it.
  StepEnergy(const FiniteBody& body, std::span<const double> masses, const FiniteOptions& options,
             const BodyLoad& load, const FiniteState& state, const ChangedTissue& changed,
             const Overstress& overstress, std::shared_ptr<const Strains> strains = nullptr);

  /// Energy [J] at u (3 N), and its derivative [N] unless that is null.
  double at(const VectorX& u, VectorX* gradient);
  int evaluations() const { return evaluations_; }
  /// As the step began; null: nothing asks for them.
  const std::shared_ptr<const Strains>& strains() const { return strains_; }

 private:
  const FiniteBody& body_;
  std::span<const double> masses_;
  const FiniteOptions& options_;
  const ChangedTissue& changed_;
  const Overstress& overstress_;
  const BodyLoad& load_;
  Vec3 acceleration_;
  VectorX aim_;
  std::shared_ptr<const Strains> strains_;
  Viscosity viscosity_;
  FiniteBody::Workspace workspace_;
  int evaluations_ = 0;
};

}  // namespace viscera
