// Whether an elastic problem makes sense, before any work is done on it.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "kernels/base/result.h"
#include "kernels/paff/cut_cells.h"
#include "kernels/paff/elasticity.h"

namespace viscera {

/// Every mistake in words: missing parts, material out of range, too few nodes, numbers that aren't
/// finite, spacings that aren't positive, a surface that encloses no volume. Empty when sound.
std::vector<std::string> problem_mistakes(const ElasticProblem& problem);

/// The first point whose relative modulus isn't one, or is farther from 1 than the arithmetic
/// bears, in words; empty when sound.
std::string modulus_mistake(const VolumeQuadrature& points, std::span<const double> modulus);

/// The same of fibres: a direction that isn't of length 1, a modulus that is none or more than
/// 10,000 times the tissue's.
std::string fibres_mistake(const VolumeQuadrature& points, std::span<const Fibres> fibres,
                           const IsotropicMaterial& material);

/// The material alone: its numbers, and the range that this formulation answers for.
Result<void> accept_material(const Formulation& formulation, const IsotropicMaterial& material);

}  // namespace viscera
