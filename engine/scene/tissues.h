// Tissue values of assets/tissues.json, each with unit, source and its mark: [V] verified in the
// named source, [A] read in its abstract, [R] recalled and to be checked.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "kernels/base/result.h"
#include "kernels/base/types.h"
#include "kernels/heat/tissue_thermal.h"
#include "kernels/hive/hyperelastic_model.h"
#include "kernels/hive/prony.h"
#include "kernels/paff/elasticity.h"

namespace viscera {

/// How the renderer paints a tissue. Colours are linear RGB.
struct TissueLook {
  /// What the surface is made of, as far as one sees it.
  enum class Pattern {
    kCapsule,  ///< a smooth skin over mottled flesh: liver, spleen, bowel
    kLobules,  ///< rounded lobules with furrows between: fat
    kFibres,   ///< bundles of fibres along the organ's x axis: muscle, ligament
  };
  Pattern pattern = Pattern::kCapsule;
  Vec3 colour = Vec3(0.5, 0.2, 0.15);          ///< base
  Vec3 mottle_colour = Vec3(0.4, 0.1, 0.1);    ///< of the spots; between lobules; of the fibres
  double mottle_scale = 8e-3;                  ///< size of the spots; of lobules; of bundles [m]
  double mottle_amount = 0.3;                  ///< 0 ... 1
  Vec3 vessel_colour = Vec3(0.4, 0.03, 0.05);  ///< of arteries
  Vec3 vein_colour = Vec3(0.12, 0.03, 0.06);
  double vessel_amount = 0.0;  ///< 0 ... 1
  double vessel_scale = 2e-2;  ///< between trunks [m]
  double fat_amount = 0.0;     ///< 0 ... 1: how much of it lies under fat
  double bump_height = 1e-4;   ///< [m]
  double bump_scale = 1.5e-3;  ///< [m]
  double roughness = 0.5;      ///< of the surface under its film: 0 a mirror, 1 matte
  double wetness = 0.8;        ///< 0 dry ... 1 wet: sharpness and strength of highlights
  double translucency = 0.5;   ///< 0 ... 1: how far light wraps round the terminator
};

struct Tissue {
  std::string name;
  IsotropicMaterial elastic;  ///< of small strain; with `prony`, the long-term one
  /// Of finite strain, as held tools feel it; a tissue of the file is linear, a scene may say more.
  HyperelasticModel model = HyperelasticModel::kLinear;
  std::vector<PronyTerm> prony;          ///< by which forces on held tools relax; empty: they don't
  Fibres fibres;                         ///< in the organ's frame
  double density = 1050.0;               ///< [kg/m3]
  double fracture_energy = 0.0;          ///< of a cut, of its area [J/m2]; 0: not known
  double ultimate_strain = 0.0;          ///< at which it fails when it's pulled; 0: not known
  std::optional<ThermalTissue> thermal;  ///< none: the file doesn't say enough for heat
  std::vector<std::string> thermal_lacks;  ///< then: the keys that it misses
  TissueLook look;
};

struct SceneDescription;

/// Whether the scene's tissues have what its organs' `material` asks for.
Result<void> check_materials(const SceneDescription& scene,
                             const std::map<std::string, Tissue>& tissues);

/// All tissues of the file by name, or every mistake in it.
Result<std::map<std::string, Tissue>> load_tissues(const std::filesystem::path& file);

}  // namespace viscera
