// Current through hooks and scissors, and the heat that it leaves in tissue.
#pragma once

#include <memory>
#include <optional>

#include "engine/features/cautery/cautery_flags.h"
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

/// What a hook's generator has done so far.
struct GeneratorBook {
  double generated = 0.0;              ///< [J]; of that:
  double body = 0.0;                   ///< in the body beyond the tissue that is followed [J]
  double metal = 0.0;                  ///< of sparks, in the hook's tip [J]
  double gas = 0.0;                    ///< in gas, steam and fumes [J]
  double sparks = 0.0;                 ///< what tissue got of sparks [J]
  double time = 0.0;                   ///< with current [s]
  double by_current = 0.0;             ///< of that: limited by the generator's current [s]
  double by_voltage = 0.0;             ///< and by its voltage [s]
  double impedance = 0.0;              ///< over the time with current, its integral [Ohm s]
  double least = 0.0, greatest = 0.0;  ///< impedance of a frame; 0: none yet [Ohm]

  void add(const CurrentReport& current, double dt);

  static constexpr auto fields() {
    using S = GeneratorBook;
    return std::tuple(field("generated", &S::generated), field("body", &S::body),
                      field("metal", &S::metal), field("gas", &S::gas), field("sparks", &S::sparks),
                      field("time", &S::time), field("by_current", &S::by_current),
                      field("by_voltage", &S::by_voltage), field("impedance", &S::impedance),
                      field("least", &S::least), field("greatest", &S::greatest));
  }
};
static_assert(fields_cover<GeneratorBook>());

/// A hook's metal, and the end of the trace that it burns, so that the next frame's heat continues
/// it.
struct BurnTrace {
  static constexpr std::string_view kName = "electrodes";
  ElectrodeTip tip;
  Entity organ;              ///< that it is on, or sparks to; a stale one: none
  ElectrodeContact contact;  ///< there
  CurrentReport current;     ///< of this frame
  GeneratorBook book;
  static constexpr auto fields() {
    using S = BurnTrace;
    return std::tuple(field("tip", &S::tip), field("organ", &S::organ),
                      field("contact", &S::contact), field("current", &S::current),
                      field("book", &S::book));
  }
};
static_assert(fields_cover<BurnTrace>());

/// Of an organ that a hook can burn, its surface at rest as it is now: the whole one's, or what
/// cuts have left.
const SurfaceTree& surface_left(const World& world, Entity organ);

/// Has the heat of every OrganBurn computed in `context` from now on; how many there are. Where the
/// kernels don't compile it fails, and all stays on the CPU. What goes wrong later,
/// Bioheat::device_failure() says.
Result<std::size_t> move_heat_to_gpu(World& world, std::shared_ptr<EglContext> context);

/// True when some hook carries current at some time.
bool anything_burns(const SceneDescription& scene);

/// Where the energy of all hooks' generators went: generated = delivered + body + metal + gas, and
/// delivered + metabolic = stored + latent + perfused + lost + what the residual says.
struct CauteryFigures {
  double generated = 0.0;  ///< [J]
  double delivered = 0.0;  ///< heat in tissue that is followed [J]
  double sparks = 0.0;     ///< of that, what sparks from the gap brought [J]
  double body = 0.0;       ///< in the body beyond, and under the return pad [J]
  double metal = 0.0;      ///< of sparks, in the hooks' tips [J]
  double gas = 0.0;        ///< of sparks and of char that took no more, in gas [J]
  double metabolic = 0.0;  ///< [J]
  double stored = 0.0;     ///< in tissue that is still warm [J]
  double latent = 0.0;     ///< of water that left [J]
  double perfused = 0.0;   ///< carried away by blood [J]
  double lost = 0.0;  ///< to gas, instruments, vapour's warmth, char, cold and removed tissue [J]
  double residual = 0.0;  ///< over what was delivered

  double time = 0.0;  ///< with current, of all hooks together [s]
  /// What the generators saw in it [Ohm], and the shares of it in which their current and their
  /// voltage limited them.
  double least_impedance = 0.0, mean_impedance = 0.0, greatest_impedance = 0.0;
  double by_current = 0.0, by_voltage = 0.0;
};
/// None: no hook carries current.
std::optional<CauteryFigures> cautery_figures(const World& world);

/// What heat did to an organ that it is followed in.
struct BurnFigures {
  Entity organ;
  double vaporised = 0.0;             ///< water and solids [kg]
  double smoke = 0.0;                 ///< of that [kg]
  double above_60 = 0.0;              ///< volume above 60 C at its greatest [m3]
  double coagulated = 0.0;            ///< volume that has blanched, Omega at least 1; of what cuts
                                      ///< have left of an organ [m3]
  double dead = 0.0;                  ///< that, or with the lethal dose of heat [m3]
  double greatest_temperature = 0.0;  ///< [K]
};
std::vector<BurnFigures> burn_figures(const World& world);
/// How far below an organ's surface as it is now, walls of cuts among it, dead tissue lies, by
/// voxels' middles: the thermal spread [m].
double dead_depth(const World& world, Entity organ);
std::vector<ReportSection> cautery_report(const World& world);  ///< "cautery", "tissue"
std::vector<std::string> cautery_warnings(const World& world);
std::vector<SkippedReport> cautery_skipped(const SceneDescription& scene);

Feature cautery_feature();

}  // namespace viscera
