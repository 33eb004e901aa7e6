// Whether an elastic problem makes sense, before any work is done on it.
#pragma once

#include <string>
#include <vector>

#include "kernels/base/result.h"
#include "kernels/paff/elasticity.h"

namespace viscera {

/// Every mistake in words: missing parts, material out of range, too few nodes, numbers that aren't
/// finite, spacings that aren't positive, a surface that encloses no volume. Empty when sound.
std::vector<std::string> problem_mistakes(const ElasticProblem& problem);

/// The material alone: its numbers, and the range that this formulation answers for.
Result<void> accept_material(const Formulation& formulation, const IsotropicMaterial& material);

}  // namespace viscera
