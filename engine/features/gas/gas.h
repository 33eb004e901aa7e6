// The gas of the cavity: one flow for all smoke volumes, its inlets, leaks and evacuators.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "engine/features/gas/gas_keys.h"
#include "engine/simulation/feature.h"
#include "kernels/smoke/cavity.h"
#include "kernels/smoke/gas_grid.h"
#include "kernels/smoke/smoke.h"

namespace viscera {

struct GasSetup {
  static constexpr bool kConstant = true;
  struct Evacuator {
    EvacuatorDescription description;
    Entity instrument;  ///< draws at its tip; a stale one: at its place
  };
  std::optional<GasParameters> parameters;  ///< none: the gas stands still
  std::vector<Evacuator> evacuators;
};

struct GasBody {
  static constexpr std::string_view kName = "gas";
  struct Solid {
    Entity organ;
    std::vector<Vec3f> places;  ///< of some vertices, as its cells were marked last, world [m]
    static constexpr auto fields() {
      return std::tuple(field("organ", &Solid::organ), field("places", &Solid::places));
    }
  };
  std::unique_ptr<GasGrid> grid;  ///< null: the gas stands still
  std::vector<Solid> solids;      ///< empty until smoke is first there
  Cavity cavity;
  double given = 0.0;  ///< volume since the cavity's step, where no grid takes it [m3]
  static constexpr auto fields() {
    return std::tuple(field("grid", &GasBody::grid), field("solids", &GasBody::solids),
                      field("cavity", &GasBody::cavity), field("given", &GasBody::given));
  }
};
static_assert(fields_cover<GasBody>());

/// The box that the flow of the gas has, in a scene with smoke volumes.
Box gas_domain(const SceneDescription& scene);
/// Edge of its cells [m]; none: the gas stands still.
std::optional<double> gas_cell(const SceneDescription& scene);

/// Gas isn't where organs are now: what asks it for a flow, or gives it anything, sees to that
/// itself.
void follow_organs(World& world);
/// Gives it to the gas in this step. What the gas can't take, for there is none in reach, is gone.
void give_to_gas(World& world, const GasSource& source);
/// How far a jet gets from a place on an organ before it meets another: at most so far [m].
double room_for_jet(const World& world, const Vec3& place, const Vec3& direction, double most);

/// The cavity's pressure and what comes in and goes out in the step that ends at `time` [s].
void advance_cavity(World& world, double time, double dt);
/// Evacuators that draw now, and leaks, with what flows out of them. Smoke goes with the gas from
/// as far as the grid spreads an opening.
std::vector<SmokeOutlet> gas_outlets(const World& world, double time);

/// Solids, inlets and outlets as they are now; null: the gas stands still. The flow is stepped by
/// who moves what it carries.
GasGrid* open_gas(World& world, std::span<const SmokeOutlet> outlets, double time);

/// Of the run: "gas", with the cavity's pressure and where its gas went.
std::vector<ReportSection> gas_report(const World& world);

Feature gas_feature();

}  // namespace viscera
