// Which formulations this program holds: its own and, where they are built in, the published ones
// that it is compared with. find_formulation and formulation_names are declared with the interface
// (kernels/paff/elasticity.h) and defined here, where all of them are known.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "kernels/paff/elasticity.h"

namespace viscera {

/// Published formulations that this build leaves out (VISCERA_BASELINES is off, or there was no
/// MUMPS).
std::vector<std::string> left_out_formulations();
/// Said of one of those: what was expected instead.
std::string why_left_out(std::string_view name);

/// Of a name without a formulation: `found "gfdm", expected one of galerkin, ...`, and why if it is
/// one that is left out.
std::string unknown_formulation(std::string_view name);

}  // namespace viscera
