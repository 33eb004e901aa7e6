// Smoke: what comes from burns and from steady sources, and how it moves.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "engine/features/smoke/smoke_flags.h"
#include "engine/features/smoke/smoke_keys.h"
#include "engine/simulation/feature.h"
#include "kernels/smoke/fog.h"
#include "kernels/smoke/smoke.h"
#include "kernels/smoke/smoke_optics.h"

namespace viscera {

/// A smoke volume and what feeds it; one a volume, on an entity of its own.
struct SmokeSource {
  static constexpr bool kConstant = true;
  struct Emitter {
    EmitterDescription description;
    Entity instrument;  ///< a hook that burns; a stale one: a place
  };
  SmokeDescription description;
  SmokeParameters parameters;
  bool takes_any_hook = false;  ///< its description names no emitters
  std::vector<Emitter> emitters;
};

/// What an emitter owes: carried to the next frame.
struct SmokeDebt {
  double particles_owed = 0.0;
  double mass_owed = 0.0;  ///< [kg]
  static constexpr auto fields() {
    return std::tuple(field("particles_owed", &SmokeDebt::particles_owed),
                      field("mass_owed", &SmokeDebt::mass_owed));
  }
};

struct SmokeBody {
  static constexpr std::string_view kName = "smoke";
  SmokeVolume volume;
  std::vector<SmokeDebt> debts;  ///< one an emitter
  std::uint64_t most_particles = 0;
  static constexpr auto fields() {
    using S = SmokeBody;
    return std::tuple(field("volume", &S::volume), field("debts", &S::debts),
                      field("most_particles", &S::most_particles));
  }
};
static_assert(fields_cover<SmokeBody>());

/// What smoke meets: by the drawn surface that instances share.
struct SmokeScenery {
  static constexpr bool kConstant = true;
  std::map<const TriangleSurface*, std::shared_ptr<const SurfaceTopology>> topologies;
};

/// Of an organ that is cut, in place of SmokeScenery's.
struct CutTopology {
  std::shared_ptr<const SurfaceTopology> topology;
};

/// How smoke looks.
struct SmokeSight {
  static constexpr bool kConstant = true;
  SmokeOptics optics;
  std::optional<FogOptics> fog;  ///< none: not known how it looks
};

/// Shafts, as the last step saw them.
struct SmokeTools {
  static constexpr std::string_view kName = "smoke tools";
  std::vector<SmokeObstacle> tools;
  static constexpr auto fields() { return std::tuple(field("tools", &SmokeTools::tools)); }
};

/// True when something gives smoke to one of the scene's volumes.
bool anything_smokes(const SceneDescription& scene);

/// Of all volumes together: emitted = airborne + background + evacuated + leaked + deposited.
struct SmokeFigures {
  std::uint64_t most_particles = 0;  ///< in one of them
  double emitted = 0.0;              ///< [kg]
  double airborne = 0.0;             ///< carried by particles [kg]
  double background = 0.0;           ///< mixed into the whole cavity's gas [kg]
  double evacuated = 0.0, leaked = 0.0;
  double deposited = 0.0;  ///< on surfaces [kg]
};
SmokeFigures smoke_figures(const World& world);
std::vector<ReportSection> smoke_report(const World& world);  ///< "smoke"
std::vector<std::string> smoke_warnings(const World& world);
std::vector<SkippedReport> smoke_skipped(const SceneDescription& scene);

Feature smoke_feature();

}  // namespace viscera
