#include "tests/kernels/contact/changed_bodies.h"

#include <gtest/gtest.h>

#include <cmath>

#include "kernels/paff/compliance_columns.h"

namespace viscera::test {

ChangedBody::ChangedBody(NodedBody noded, const IsotropicMaterial& material,
                         const std::function<bool(const Vec3&)>& is_fixed,
                         const std::function<bool(const Vec3&)>& is_touchable,
                         const std::function<bool(const Vec3&)>& changes)
    : body(std::move(noded)) {
  auto system = GalerkinSystem::assemble(body.problem(material, is_fixed), 1.8, no_progress());
  if (!system) {
    ADD_FAILURE() << system.error().text();
    return;
  }
  system_ = std::make_unique<GalerkinSystem>(std::move(*system));
  auto factor = StiffnessFactor::factor(system_->stiffness(), body.cloud.positions, FactorPrecision::full);
  auto found = place_on_surface(body.surface, system_->fields());
  if (!factor || !found) {
    ADD_FAILURE() << (factor ? found.error() : factor.error()).text();
    return;
  }
  factor_ = std::make_unique<StiffnessFactor>(std::move(*factor));
  places = std::move(*found);
  auto touchable = touchable_part(places, is_touchable);
  if (!touchable) {
    ADD_FAILURE() << touchable.error().text();
    return;
  }
  touch = std::move(*touchable);
  auto prepared = compliance(places.fields, touch.places, no_progress());
  auto around = changeable_region(*this, *this, places.fields, changes, no_progress());
  if (!prepared || !around) {
    ADD_FAILURE() << (prepared ? around.error() : prepared.error()).text();
    return;
  }
  sound = std::move(*prepared);
  changeable = std::move(*around);
  ready = true;
}

Result<void> ChangedBody::solve(std::span<double> loads, int columns) {
  return factor_->solve(system_->stiffness(), loads, columns);
}

Result<std::vector<double>> ChangedBody::solve_static(const StaticLoads& loads) {
  return system_->solve(loads);
}

Result<SurfaceCompliance> ChangedBody::compliance(const SparseWeights& at, std::vector<int> touchable,
                                                  const Progress& progress) {
  return factor_->compliance(at, std::move(touchable), progress);
}

SymmetricBlockMatrix ChangedBody::changed(const std::vector<double>& factors) const {
  SymmetricBlockMatrix stiffness = system_->stiffness();
  add_stiffness(changeable.tissue, factors, stiffness);
  return stiffness;
}

SurfaceCompliance ChangedBody::recomputed(const std::vector<double>& factors) const {
  auto factor =
      StiffnessFactor::factor(changed(factors), body.cloud.positions, FactorPrecision::full);
  if (!factor) {
    ADD_FAILURE() << factor.error().text();
    return sound;
  }
  auto compliance = factor->compliance(places.fields, touch.places, no_progress());
  if (!compliance) {
    ADD_FAILURE() << compliance.error().text();
    return sound;
  }
  return std::move(*compliance);
}

std::vector<float> ChangedBody::recomputed_shape(const TissueChange& change) const {
  const SymmetricBlockMatrix stiffness = changed(change.stiffness);
  const auto factor =
      StiffnessFactor::factor(stiffness, body.cloud.positions, FactorPrecision::full);
  std::vector<double> strains = change.shrinkage;
  for (double& strain : strains) strain = -strain;
  const VectorX load = eigenstrain_load(changeable.tissue, change.stiffness, strains);
  std::vector<double> unknowns(3 * body.cloud.size(), 0.0);
  for (std::size_t i = 0; i < changeable.tissue.nodes.size(); ++i) {
    Vec3::Map(unknowns.data() + 3 * changeable.tissue.nodes[i]) =
        load.segment<3>(3 * static_cast<Eigen::Index>(i));
  }
  std::vector<float> shape(3 * places.size(), 0.0f);
  if (!factor || !factor->solve(stiffness, unknowns, 1)) {
    ADD_FAILURE() << "the changed body can't be solved";
    return shape;
  }
  read_places(places.fields, unknowns.data(), shape.data());
  return shape;
}

std::vector<double> ChangedBody::factors(double factor,
                                         const std::function<bool(const Vec3&)>& inside) const {
  std::vector<double> all(changeable.tissue.size(), 1.0);
  for (std::size_t q = 0; q < all.size(); ++q) {
    if (inside(changeable.tissue.positions[q])) all[q] = factor;
  }
  return all;
}

SurfaceCompliance updated(const SurfaceCompliance& sound, const StiffnessUpdate& update) {
  SurfaceCompliance after = sound;
  for (std::size_t c = 0; c < 3 * sound.touchable.size(); ++c) {
    subtract_update(update, std::vector<int>{static_cast<int>(c / 3)},
                    std::vector<Vec3>{Vec3::Unit(static_cast<int>(c % 3))},
                    std::span(after.columns).subspan(c * after.rows(), after.rows()));
  }
  return after;
}

double distance(const SurfaceCompliance& one, const SurfaceCompliance& other) {
  double most = 0.0, difference = 0.0;
  for (std::size_t i = 0; i < other.columns.size(); ++i) {
    most = std::max(most, static_cast<double>(std::abs(other.columns[i])));
    difference = std::max(difference, static_cast<double>(std::abs(one.columns[i] - other.columns[i])));
  }
  return difference / most;
}

}  // namespace viscera::test
