#include "engine/verification/changed_body.h"

#include <algorithm>
#include <cmath>

#include "kernels/paff/compliance_columns.h"

namespace viscera {

Result<std::unique_ptr<ChangedBody>> ChangedBody::prepare(NodedBody noded,
                                                          const IsotropicMaterial& material,
                                                          const Where& is_fixed,
                                                          const Where& is_touchable,
                                                          const Where& changes) {
  std::unique_ptr<ChangedBody> body(new ChangedBody);
  body->body_ = std::move(noded);
  auto system =
      GalerkinSystem::assemble(body->body_.problem(material, is_fixed), 1.8, no_progress());
  if (!system) return std::unexpected(system.error());
  body->system_ = std::make_unique<GalerkinSystem>(std::move(*system));
  auto factor = StiffnessFactor::factor(body->system_->stiffness(), body->body_.cloud.positions,
                                        FactorPrecision::kFull);
  if (!factor) return std::unexpected(factor.error());
  body->factor_ = std::make_unique<StiffnessFactor>(std::move(*factor));
  auto places = place_on_surface(body->body_.surface, body->system_->fields());
  if (!places) return std::unexpected(places.error());
  body->places_ = std::move(*places);
  auto touchable = touchable_part(body->places_, is_touchable);
  if (!touchable) return std::unexpected(touchable.error());
  body->touchable_ = std::move(*touchable);
  auto sound = body->compliance(body->places_.fields, body->touchable_.places, no_progress());
  if (!sound) return std::unexpected(sound.error());
  body->sound_ = std::move(*sound);
  auto tissue = body->region(changes);
  if (!tissue) return std::unexpected(tissue.error());
  auto changeable =
      changeable_region(*body, std::move(*tissue), body->places_.fields, no_progress());
  if (!changeable) return std::unexpected(changeable.error());
  body->changeable_ = std::move(*changeable);
  return body;
}

Result<void> ChangedBody::solve(std::span<double> loads, int columns) {
  return factor_->solve(system_->stiffness(), loads, columns);
}

Result<std::vector<double>> ChangedBody::solve_static(const StaticLoads& loads) {
  return system_->solve(loads);
}

Result<SurfaceCompliance> ChangedBody::compliance(const SparseWeights& at,
                                                  std::vector<int> touchable,
                                                  const Progress& progress) {
  return factor_->compliance(at, std::move(touchable), progress);
}

std::vector<double> ChangedBody::factors(double factor, const Where& inside) const {
  std::vector<double> all(changeable_.tissue.size(), 1.0);
  for (std::size_t q = 0; q < all.size(); ++q) {
    if (inside(changeable_.tissue.positions[q])) all[q] = factor;
  }
  return all;
}

SymmetricBlockMatrix ChangedBody::changed(const std::vector<double>& factors) const {
  SymmetricBlockMatrix stiffness = system_->stiffness();
  add_stiffness(changeable_.tissue, factors, stiffness);
  return stiffness;
}

Result<SurfaceCompliance> ChangedBody::recomputed(const std::vector<double>& factors) const {
  const auto factor =
      StiffnessFactor::factor(changed(factors), body_.cloud.positions, FactorPrecision::kFull);
  if (!factor) return std::unexpected(factor.error());
  return factor->compliance(places_.fields, touchable_.places, no_progress());
}

Result<std::vector<float>> ChangedBody::recomputed_shape(const TissueChange& change) const {
  const SymmetricBlockMatrix stiffness = changed(change.stiffness);
  const auto factor =
      StiffnessFactor::factor(stiffness, body_.cloud.positions, FactorPrecision::kFull);
  if (!factor) return std::unexpected(factor.error());
  std::vector<double> strains = change.shrinkage;
  for (double& strain : strains) strain = -strain;
  const VectorX load = eigenstrain_load(changeable_.tissue, change.stiffness, strains);
  std::vector<double> unknowns(3 * body_.cloud.size(), 0.0);
  for (std::size_t i = 0; i < changeable_.tissue.nodes.size(); ++i) {
    Vec3::Map(unknowns.data() + 3 * changeable_.tissue.nodes[i]) =
        load.segment<3>(3 * static_cast<Eigen::Index>(i));
  }
  if (const auto solved = factor->solve(stiffness, unknowns, 1); !solved) {
    return std::unexpected(solved.error());
  }
  std::vector<float> shape(3 * places_.size(), 0.0f);
  read_places(places_.fields, unknowns.data(), shape.data());
  return shape;
}

SurfaceCompliance ChangedBody::updated(const StiffnessUpdate& update) const {
  SurfaceCompliance after = sound_;
  for (std::size_t c = 0; c < 3 * sound_.touchable.size(); ++c) {
    const int place = static_cast<int>(c / 3);
    const Vec3 load = Vec3::Unit(static_cast<int>(c % 3));
    subtract_update(update, {&place, 1}, {&load, 1},
                    std::span(after.columns).subspan(c * after.rows(), after.rows()));
  }
  return after;
}

double compliance_distance(const SurfaceCompliance& one, const SurfaceCompliance& other) {
  double most = 0.0, difference = 0.0;
  for (std::size_t i = 0; i < other.columns.size(); ++i) {
    most = std::max(most, static_cast<double>(std::abs(other.columns[i])));
    difference =
        std::max(difference, static_cast<double>(std::abs(one.columns[i] - other.columns[i])));
  }
  return difference / most;
}

}  // namespace viscera
