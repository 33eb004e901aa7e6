// Two equal half balls whose domes press each other, for the answer of Hertz.
//
// His balls are held infinitely far away, these by their bases, near enough that a ball's pole goes
// back by c F less: at the same force the bases come nearer to each other by 2 c F less than his
// say, and where they touch nothing else changes, since what a base does varies slowly there. c
// follows from a flat punch on the same half ball, which finite elements know: it is what the punch
// misses of a half-space's 1 / (2 E* a).
#pragma once

#include <memory>
#include <vector>

#include "engine/verification/hemisphere_body.h"
#include "kernels/contact/contact_island.h"

namespace viscera {

/// Two equal balls that came this much nearer to each other than they were when they touched.
struct HertzAnswer {
  double force = 0.0;   ///< [N]
  double radius = 0.0;  ///< of the disc where they touch [m]
};
/// Held infinitely far away [Hertz1882].
HertzAnswer hertz(const IsotropicMaterial& material, double radius, double approach);
/// `give`: c of each [m/N].
HertzAnswer hertz_held(const IsotropicMaterial& material, double radius, double approach,
                       double give);
/// c of a half ball, by finite elements (axisymmetric_hemisphere.h); takes seconds.
Result<double> give_of_base(const IsotropicMaterial& material, double radius);

struct TwoBallsOptions {
  std::size_t nodes = 1100;  ///< of each
  int rings = 9;             ///< of cells about the axis
  double reach = 5.5e-3;     ///< of the outermost cells [m]
};

struct TwoBallsAnswer {
  double force = 0.0;             ///< that presses one on the other [N]
  double drag = 0.0;              ///< along each other [N]
  double radius = 0.0;            ///< sqrt(2.5 <r^2>) weighted by pressure [m]
  double unbalanced = 0.0;        ///< sum of both bodies' forces over the greater of them
  double greatest_overlap = 0.0;  ///< of two cells that meet [m]
  IslandFigures island;
};

class TwoBalls {
 public:
  static Result<std::unique_ptr<TwoBalls>> prepare(const TwoBallsOptions& options,
                                                   const Progress& progress);
  /// Bases nearer by this; with friction also moved along each other by `way` [m].
  TwoBallsAnswer press(double approach, double friction = 0.0, double way = 0.0);
  const IsotropicMaterial& material() const { return body_->material(); }

 private:
  TwoBalls() = default;

  std::unique_ptr<HemisphereBody> body_;
  std::unique_ptr<PatchContact> other_;
  std::array<std::vector<ContactCell>, 2> cells_;  // opposite each other, of both
  std::vector<Vec3> forces_;
  ContactIsland island_;
};

}  // namespace viscera
