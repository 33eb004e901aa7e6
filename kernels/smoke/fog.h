// Condensed steam as it is seen: white droplets, which grow with how much has condensed on each
// nucleus.
#pragma once

#include <vector>

#include "kernels/smoke/gas_grid.h"
#include "kernels/smoke/gas_mixture.h"
#include "kernels/smoke/splat.h"

namespace viscera {

/// What droplets of water do to light, by how much of them there is: from Mie's series, tabulated.
class FogOptics {
 public:
  /// For droplets on the mixture's nuclei, at one wavelength [m]. Water absorbs nothing there.
  FogOptics(const GasMixture& mixture, double wavelength);

  double extinction(double load) const;  ///< of so many droplets by volume [kg/m3]: [1/m]
  double asymmetry(double load) const;   ///< mean cosine of what they scatter

 private:
  struct Entry {
    double extinction, asymmetry;
  };
  double place(double load) const;
  std::vector<Entry> table_;  // even in the logarithm of the load
};

/// The droplets of a gas: a grid over their box alone, as the density of a smoke of that mass
/// extinction [m2/kg] that takes as much light. Without cells where there are none. `asymmetry`:
/// their mean, by what they take.
SmokeGrid fog_of(const GasGrid& gas, const FogOptics& optics, double mass_extinction,
                 double& asymmetry);

}  // namespace viscera
