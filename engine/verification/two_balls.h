// Two equal half balls whose domes press each other, for the exact answer of Hertz.
#pragma once

#include <memory>
#include <vector>

#include "engine/verification/hemisphere_body.h"
#include "kernels/contact/contact_island.h"

namespace viscera {

/// Force [N] of two equal balls whose centres came this much nearer to each other than they were
/// when they touched, and radius [m] of the disc where they touch [Hertz1882].
struct HertzAnswer {
  double force = 0.0, radius = 0.0;
};
HertzAnswer hertz(const IsotropicMaterial& material, double radius, double approach);

struct TwoBallsOptions {
  std::size_t nodes = 1100;  ///< of each
  int rings = 9;             ///< of cells about the axis
  double reach = 5.5e-3;     ///< of the outermost cells [m]
};

struct TwoBallsAnswer {
  double force = 0.0;             ///< that presses one on the other [N]
  double radius = 0.0;            ///< sqrt(2.5 <r^2>) weighted by pressure [m]
  double unbalanced = 0.0;        ///< sum of both bodies' forces over the greater of them
  double greatest_overlap = 0.0;  ///< of two cells that meet [m]
  IslandFigures island;
};

class TwoBalls {
 public:
  static Result<std::unique_ptr<TwoBalls>> prepare(const TwoBallsOptions& options,
                                                   const Progress& progress);
  /// Centres nearer by this [m].
  TwoBallsAnswer press(double approach);
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
