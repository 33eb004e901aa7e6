#include "engine/features/gas/gas.h"

#include <algorithm>

#include "engine/features/smoke/smoke_keys.h"
#include "kernels/smoke/solid_cells.h"

namespace viscera {
namespace {

/// Cells of the gas are marked afresh when an organ has moved by this share of one.
constexpr double kStaleSolid = 0.25;

/// Organs' cells are solid; marked again when one has moved.
void mark_organs(World& world, GasBody& gas) {
  const double stale = kStaleSolid * gas.grid->spacing().minCoeff();
  const bool first = gas.solids.empty();
  bool moved = first;
  for (const GasBody::Solid& solid : gas.solids) {
    const Pose& pose = pose_of(world, solid.organ);
    moved = moved || (pose.position - solid.pose.position).norm() > stale ||
            pose.orientation.angularDistance(solid.pose.orientation) > 1e-2;
  }
  if (!moved) return;
  const SolidGrid grid{gas.grid->parameters().domain.min(), gas.grid->spacing(), gas.grid->cells()};
  std::vector<std::uint8_t> cells(grid.size(), 0);
  gas.solids.clear();
  for (std::size_t o = 0; o < world.all<OrganBody>().size(); ++o) {
    const Entity organ = world.all<OrganBody>().owner(o);
    const OrganBody& body = world.all<OrganBody>()[o];
    mark_solid(world.find<OrganState>(organ)->positions, body.model->surface.triangles,
               pose_of(world, organ), grid, cells);
    gas.solids.push_back({organ, pose_of(world, organ)});
  }
  gas.grid->set_solids(cells);
}

Result<void> prepare(SceneModel& model) {
  const SceneDescription& scene = model.scene();
  if (smoke_of(scene).empty()) return {};
  const GasDescription& description = gas_of(scene);
  GasSetup setup;
  for (const EvacuatorDescription& evacuator : description.evacuators)
    setup.evacuators.push_back({evacuator, model.instrument_named(evacuator.instrument)});
  if (description.cells > 0) {
    GasParameters& parameters = setup.parameters.emplace();
    if (description.domain) {
      parameters.domain = *description.domain;
    } else {
      for (const SmokeDescription& smoke : smoke_of(scene)) parameters.domain.extend(smoke.domain);
    }
    parameters.cells = description.cells;
    parameters.density = description.density();
    parameters.kinematic_viscosity = SmokeParameters().gas_viscosity / parameters.density;
    parameters.eddy_viscosity = SmokeParameters().eddy_viscosity;
    if (auto sound = check_gas(parameters); !sound) return sound;
  }
  model.constants().all<GasSetup>().add(kWhole, std::move(setup));
  return {};
}

Result<void> start(World& world) {
  const GasSetup* setup = world.one<GasSetup>();
  if (!setup) return {};
  GasBody gas;
  if (setup->parameters) {
    gas.grid = std::make_unique<GasGrid>(*setup->parameters);
    std::vector<GasLeak> leaks;
    for (const LeakDescription& leak : gas_of(world.model().scene()).leaks)
      leaks.push_back({leak.position, leak.radius});
    gas.grid->set_leaks(leaks);
  }
  world.all<GasBody>().add(kWhole, std::move(gas));
  return {};
}

}  // namespace

GasGrid* open_gas(World& world, std::span<const SmokeOutlet> outlets, double time) {
  GasBody& gas = *world.one<GasBody>();
  if (!gas.grid) return nullptr;
  mark_organs(world, gas);
  std::vector<GasInlet> inlets;
  for (const InletDescription& inlet : gas_of(world.model().scene()).inlets)
    inlets.push_back({inlet.position, inlet.direction, inlet.radius,
                      inlet.when.contains(time) ? inlet.flow : 0.0});
  gas.grid->set_inlets(inlets);
  std::vector<GasEvacuator> evacuators;
  for (const SmokeOutlet& outlet : outlets)
    if (!outlet.leak) evacuators.push_back({outlet.position, outlet.radius, outlet.flow});
  gas.grid->set_evacuators(evacuators);
  return gas.grid.get();
}

/// Evacuators that draw now, and leaks with what flows out of them.
std::vector<SmokeOutlet> gas_outlets(const World& world, double time) {
  const GasBody& gas = *world.one<GasBody>();
  const GasSetup& setup = *world.one<GasSetup>();
  const GasDescription& description = gas_of(world.model().scene());
  std::vector<SmokeOutlet> outlets;
  double balance = 0.0;
  for (const InletDescription& inlet : description.inlets)
    if (inlet.when.contains(time)) balance += inlet.flow;
  for (const GasSetup::Evacuator& evacuator : setup.evacuators) {
    const EvacuatorDescription& suction = evacuator.description;
    if (!suction.when.contains(time)) continue;
    const InstrumentState* tool = world.find<InstrumentState>(evacuator.instrument);
    outlets.push_back({tool ? tool->tip : suction.position, suction.radius, suction.flow, false});
    balance -= suction.flow;
  }
  const std::vector<LeakDescription>& leaks = description.leaks;
  for (std::size_t i = 0; i < leaks.size(); ++i) {
    // Without a flow that knows, what comes in and isn't drawn off leaves by all of them alike.
    const bool known = gas.grid && i < gas.grid->report().leaks.size();
    const double flow =
        known ? gas.grid->report().leaks[i] : balance / static_cast<double>(leaks.size());
    outlets.push_back({leaks[i].position, leaks[i].radius, std::max(0.0, flow), true});
  }
  return outlets;
}

Feature gas_feature() {
  return {.name = "gas",
          .keys = gas_keys(),
          .prepare = prepare,
          .start = start,
          .states = {state_type<GasBody>()}};
}

}  // namespace viscera
