// Rows of the hemisphere benchmark that other programs make.
#pragma once

#include <functional>
#include <iosfwd>
#include <vector>

#include "engine/verification/hemisphere_reference.h"
#include "kernels/base/result.h"
#include "tools/peers/hemisphere_case.h"

namespace viscera {

/// Finite elements (rows calculix_t4, calculix_t10) and Bullet (rows bullet, which is corotated,
/// and bullet_linear) on stuck contact of these radii and Poisson's ratios, on meshes that have the
/// contact's rim as edges and on such that know nothing of it; each row is handed to `add` as soon
/// as it is measured. What isn't installed is said, and left out. Fails on Ctrl-C or a full disk.
Result<void> measure_peers(const std::vector<double>& poisson_ratios,
                           const std::vector<double>& radii, bool quick,
                           const std::vector<HemisphereReference>& references,
                           const std::function<void(HemisphereCase)>& add, std::ostream& out);

}  // namespace viscera
