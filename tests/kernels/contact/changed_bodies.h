// Bodies whose tissue changes, prepared in double precision, and the same prepared anew.
#pragma once

#include <functional>
#include <memory>

#include "engine/verification/bodies.h"
#include "kernels/contact/stiffness_update.h"
#include "kernels/paff/galerkin.h"
#include "kernels/paff/stiffness_factor.h"

namespace viscera::test {

/// A galerkin body that keeps its equations, so that they can be changed and factored again.
class ChangedBody final : public ElasticSolver, public RegionSolver {
 public:
  /// Touchable where `is_touchable`; its tissue may change where `changes`.
  ChangedBody(NodedBody body, const IsotropicMaterial& material,
              const std::function<bool(const Vec3&)>& is_fixed,
              const std::function<bool(const Vec3&)>& is_touchable,
              const std::function<bool(const Vec3&)>& changes);

  Result<void> solve(std::span<double> loads, int columns) override;
  Result<std::vector<double>> solve_static(const StaticLoads& loads) override;
  Result<SurfaceCompliance> compliance(const SparseWeights& places, std::vector<int> touchable,
                                       const Progress& progress) override;
  const PreparationFigures& figures() const override { return system_->figures(); }
  Result<ElasticRegion> region(const std::function<bool(const Vec3&)>& wanted) const override {
    return system_->region(wanted);
  }

  /// The compliance of the body with these factors at the region's points, computed anew.
  SurfaceCompliance recomputed(const std::vector<double>& factors) const;
  /// Displacements of all places of that body under an eigenstrain [m].
  std::vector<float> recomputed_shape(const TissueChange& change) const;
  /// Factors by place: `factor` where `inside`, else 1.
  std::vector<double> factors(double factor, const std::function<bool(const Vec3&)>& inside) const;

  bool ready = false;
  NodedBody body;
  SurfacePlaces places;
  TouchableSurface touch;
  SurfaceCompliance sound;
  ChangeableRegion changeable;

 private:
  SymmetricBlockMatrix changed(const std::vector<double>& factors) const;

  std::unique_ptr<GalerkinSystem> system_;
  std::unique_ptr<StiffnessFactor> factor_;
};

/// The compliance less what the update takes, and the greatest difference of two over the greatest
/// entry of the second.
SurfaceCompliance updated(const SurfaceCompliance& sound, const StiffnessUpdate& update);
double distance(const SurfaceCompliance& one, const SurfaceCompliance& other);

}  // namespace viscera::test
