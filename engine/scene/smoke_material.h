// Smoke's values of assets/smoke.json, each with unit, source and mark.
#pragma once

#include <filesystem>

#include "kernels/base/result.h"
#include "kernels/smoke/droplet_optics.h"
#include "kernels/smoke/smoke.h"

namespace viscera {

struct SmokeMaterial {
  Droplets droplets;
  double wavelength = 0.55e-6;  ///< of the light for which their optics are found [m]
  SmokeEddies eddies;
  double jet_entrainment = SmokeParameters().jet_entrainment;  ///< [1]
};

/// What the file says, or every mistake in it.
Result<SmokeMaterial> load_smoke_material(const std::filesystem::path& file);

}  // namespace viscera
