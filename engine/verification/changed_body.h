// Bodies whose tissue changes, and the same bodies factored anew: what an update of the stiffness
// must agree with.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "engine/verification/bodies.h"
#include "kernels/contact/stiffness_update.h"
#include "kernels/paff/galerkin.h"
#include "kernels/paff/stiffness_factor.h"

namespace viscera {

using Where = std::function<bool(const Vec3&)>;

/// A galerkin body in double precision that keeps its equations, so that they can be changed and
/// factored again. Not copied, since its parts point at each other.
class ChangedBody final : public ElasticSolver, public RegionSolver {
 public:
  /// Held where `is_fixed`, touchable where `is_touchable`; its tissue may change where `changes`.
  static Result<std::unique_ptr<ChangedBody>> prepare(NodedBody body,
                                                      const IsotropicMaterial& material,
                                                      const Where& is_fixed,
                                                      const Where& is_touchable,
                                                      const Where& changes);
  ChangedBody(const ChangedBody&) = delete;
  ChangedBody& operator=(const ChangedBody&) = delete;

  Result<void> solve(std::span<double> loads, int columns) override;
  Result<std::vector<double>> solve_static(const StaticLoads& loads) override;
  Result<SurfaceCompliance> compliance(const SparseWeights& places, std::vector<int> touchable,
                                       const Progress& progress) override;
  const PreparationFigures& figures() const override { return system_->figures(); }
  Result<ElasticRegion> region(const Where& wanted) const override {
    return system_->region(wanted);
  }
  Result<SymmetricBlockMatrix> hold() const override { return system_->hold(); }
  const std::vector<TissuePiece>& pieces() const override { return system_->pieces(); }
  std::vector<double> held_loads(
      const std::function<Vec3(const Vec3&)>& displacement) const override {
    return system_->loads({.body_force = {}, .traction = {}, .held_displacement = displacement});
  }

  const NodedBody& body() const { return body_; }
  const SurfacePlaces& places() const { return places_; }
  const TouchableSurface& touchable() const { return touchable_; }
  const SurfaceCompliance& sound() const { return sound_; }
  const ChangeableRegion& changeable() const { return changeable_; }

  /// Factors by place: `factor` where `inside`, else 1.
  std::vector<double> factors(double factor, const Where& inside) const;
  /// The compliance with these factors at the region's points, from a new factorisation.
  Result<SurfaceCompliance> recomputed(const std::vector<double>& factors) const;
  /// Displacements of all places of that body under shrinkage [m].
  Result<std::vector<float>> recomputed_shape(const TissueChange& change) const;
  /// The sound compliance less what the update takes.
  SurfaceCompliance updated(const StiffnessUpdate& update) const;

 private:
  ChangedBody() = default;
  SymmetricBlockMatrix changed(const std::vector<double>& factors) const;

  NodedBody body_;
  SurfacePlaces places_;
  TouchableSurface touchable_;
  SurfaceCompliance sound_;
  ChangeableRegion changeable_;
  std::unique_ptr<GalerkinSystem> system_;
  std::unique_ptr<StiffnessFactor> factor_;
};

/// Greatest difference of two compliances over the greatest entry of the second.
double compliance_distance(const SurfaceCompliance& one, const SurfaceCompliance& other);

}  // namespace viscera
