#include "kernels/finite/step_energy.h"

namespace viscera {

StepEnergy::StepEnergy(const FiniteBody& body, std::span<const double> masses,
                       const FiniteOptions& options, const BodyLoad& load, const FiniteState& state,
                       const ChangedTissue& changed, const Overstress& overstress,
                       std::shared_ptr<const Strains> strains)
    : body_(body),
      masses_(masses),
      options_(options),
      changed_(changed),
      overstress_(overstress),
      load_(load),
      acceleration_(options.gravity + load.acceleration),
      strains_(std::move(strains)) {
  if (!options.dynamic) return;
  const auto n = static_cast<Eigen::Index>(state.displacements.size());
  aim_ = Eigen::Map<const VectorX>(state.displacements.data(), n) +
         options.time_step * Eigen::Map<const VectorX>(state.velocities.data(), n);
  if (options.viscous_time == 0.0) return;
  if (!strains_) strains_ = overstress.strains;
  if (!strains_) strains_ = std::make_shared<const Strains>(body.strains(state.displacements));
  viscosity_ = {options.viscous_time / options.time_step, *strains_};
}

double StepEnergy::at(const VectorX& u, VectorX* gradient) {
  std::span<double> g;
  if (gradient != nullptr) {
    gradient->setZero(u.size());
    g = {gradient->data(), static_cast<std::size_t>(u.size())};
  }
  ++evaluations_;
  double sum = body_.energy({u.data(), static_cast<std::size_t>(u.size())}, g, workspace_,
                            viscosity_, changed_, overstress_);
  sum += load_.energy;
  if (load_.forces.size() > 0) {
    sum -= load_.forces.dot(u);
    if (gradient != nullptr) *gradient -= load_.forces;
  }
  if (!options_.dynamic && acceleration_.isZero(0.0)) return sum;
  const double rate = 1.0 / (options_.time_step * options_.time_step);
  for (std::size_t node = 0; node < masses_.size(); ++node) {
    const double mass = masses_[node];
    const auto at = static_cast<Eigen::Index>(3 * node);
    Vec3 force = -mass * acceleration_;
    sum += force.dot(u.segment<3>(at));
    if (options_.dynamic) {
      const Vec3 away = u.segment<3>(at) - aim_.segment<3>(at);
      sum += 0.5 * mass * rate * away.squaredNorm();
      force += mass * rate * away;
    }
    if (gradient != nullptr) gradient->segment<3>(at) += force;
  }
  return sum;
}

}  // namespace viscera
