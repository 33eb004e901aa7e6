// Current through hooks, and the heat that it leaves in tissue.
#pragma once

#include <memory>

#include "engine/features/cautery/cautery_keys.h"
#include "engine/simulation/feature.h"
#include "kernels/heat/electrode.h"
#include "kernels/points/surface_tree.h"

namespace viscera {

class EglContext;

/// Organs that a hook can burn.
struct BurnableOrgan {
  static constexpr bool kConstant = true;
  std::shared_ptr<const SurfaceTree> surface;  ///< at rest
  BioheatOptions options;
};

/// Their heat. Until something burns, nothing is kept or computed.
struct OrganBurn {
  static constexpr std::string_view kName = "burns";
  Bioheat heat;               ///< rest frame
  Entity hook;                ///< that burnt it last
  double smoke = 0.0;         ///< given off so far [kg]
  double greatest_hot = 0.0;  ///< volume above 60 C at its greatest [m3]
  static constexpr auto fields() {
    using S = OrganBurn;
    return std::tuple(field("heat", &S::heat), field("hook", &S::hook), field("smoke", &S::smoke),
                      field("greatest_hot", &S::greatest_hot));
  }
};
static_assert(fields_cover<OrganBurn>());

/// A hook's metal, and the end of the trace that it burns, so that the next frame's heat continues
/// it.
struct BurnTrace {
  static constexpr std::string_view kName = "electrodes";
  ElectrodeTip tip;
  Entity organ;              ///< that it is on, or sparks to; a stale one: none
  ElectrodeContact contact;  ///< there
  CurrentReport current;     ///< of this frame
  double generated = 0.0;    ///< by its generator so far [J]
  static constexpr auto fields() {
    using S = BurnTrace;
    return std::tuple(field("tip", &S::tip), field("organ", &S::organ),
                      field("contact", &S::contact), field("current", &S::current),
                      field("generated", &S::generated));
  }
};
static_assert(fields_cover<BurnTrace>());

/// Has the heat of every OrganBurn computed in `context` from now on; how many there are. Where the
/// kernels don't compile it fails, and all stays on the CPU. What goes wrong later,
/// Bioheat::device_failure() says.
Result<std::size_t> move_heat_to_gpu(World& world, std::shared_ptr<EglContext> context);

Feature cautery_feature();

}  // namespace viscera
