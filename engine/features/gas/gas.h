// The gas of the cavity: one flow for all smoke volumes, its inlets, leaks and evacuators.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "engine/features/gas/gas_keys.h"
#include "engine/simulation/feature.h"
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
    Pose pose;  ///< where its cells were marked last
    static constexpr auto fields() {
      return std::tuple(field("organ", &Solid::organ), field("pose", &Solid::pose));
    }
  };
  std::unique_ptr<GasGrid> grid;  ///< null: the gas stands still
  std::vector<Solid> solids;      ///< empty until smoke is first there
  static constexpr auto fields() {
    return std::tuple(field("grid", &GasBody::grid), field("solids", &GasBody::solids));
  }
};
static_assert(fields_cover<GasBody>());

/// The box that the flow of the gas has, in a scene with smoke volumes.
Box gas_domain(const SceneDescription& scene);
/// Edge of its cells [m]; none: the gas stands still.
std::optional<double> gas_cell(const SceneDescription& scene);

/// Gives it to the gas in this step. What the gas can't take, for there is none in reach, is gone.
void give_to_gas(World& world, const GasSource& source);
/// How far a jet gets from a place on an organ before it meets another: at most so far [m].
double room_for_jet(const World& world, const Vec3& place, const Vec3& direction, double most);

/// Evacuators that draw now, and leaks with what flows out of them.
std::vector<SmokeOutlet> gas_outlets(const World& world, double time);

/// Solids, inlets and evacuators as they are now; null: the gas stands still. The flow is stepped
/// by who moves what it carries.
GasGrid* open_gas(World& world, std::span<const SmokeOutlet> outlets, double time);

Feature gas_feature();

}  // namespace viscera
