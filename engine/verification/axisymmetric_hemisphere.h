// The hemisphere's answer for any contact radius and Poisson's ratio, by axisymmetric finite
// elements: where assets/reference/hemisphere holds no figures. It shares nothing with the
// formulations that it judges.
#pragma once

#include "engine/verification/hemisphere_reference.h"

namespace viscera {

/// Elements over the meridian: nine nodes each, graded towards the contact's edge.
struct AxisymmetricMesh {
  double finest = 1e-4;    ///< element at the contact's edge, over a
  double growth = 1.4;     ///< of elements away from there
  double coarsest = 0.05;  ///< over R
};

/// All three contacts, in units of R and E; held base, depth kHemisphereDepth. Halving `growth -
/// 1`, `finest` and `coarsest` changes forces by less than 0.03 % and the dome by less than 0.3 %
/// up to Poisson 0.49. Takes seconds. Fails for Poisson's ratio outside [0, 0.5) and a / R outside
/// (0, 0.9].
Result<HemisphereReference> solve_axisymmetric_hemisphere(double poisson_ratio, double a_over_R,
                                                          const AxisymmetricMesh& mesh = {});

}  // namespace viscera
