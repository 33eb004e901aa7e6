// Smoke: what comes from burns and from steady sources, and how it moves.
#pragma once

#include <map>
#include <memory>
#include <vector>

#include "engine/features/smoke/smoke_keys.h"
#include "engine/simulation/feature.h"
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

/// How smoke looks.
struct SmokeSight {
  static constexpr bool kConstant = true;
  SmokeOptics optics;
};

/// Shafts, as the last step saw them.
struct SmokeTools {
  static constexpr std::string_view kName = "smoke tools";
  std::vector<SmokeObstacle> tools;
  static constexpr auto fields() { return std::tuple(field("tools", &SmokeTools::tools)); }
};

Feature smoke_feature();

}  // namespace viscera
