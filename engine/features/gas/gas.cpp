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
    parameters.domain = gas_domain(scene);
    parameters.cells = description.cells;
    parameters.mixture = description.mixture();
    parameters.kinematic_viscosity = gas::kViscosity / parameters.mixture.density();
    parameters.heat_diffusivity = parameters.mixture.heat_diffusivity();
    parameters.vapour_diffusivity = parameters.mixture.vapour_diffusivity();
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
  }
  world.all<GasBody>().add(kWhole, std::move(gas));
  return {};
}

}  // namespace

Box gas_domain(const SceneDescription& scene) {
  const GasDescription& description = gas_of(scene);
  if (description.domain) return *description.domain;
  Box domain;
  for (const SmokeDescription& smoke : smoke_of(scene)) domain.extend(smoke.domain);
  return domain;
}

std::optional<double> gas_cell(const SceneDescription& scene) {
  const int cells = gas_of(scene).cells;
  if (cells == 0) return {};
  return gas_domain(scene).sizes().maxCoeff() / cells;
}

void give_to_gas(World& world, const GasSource& source) {
  GasBody& gas = *world.one<GasBody>();
  if (!gas.grid) return;
  mark_organs(world, gas);
  gas.grid->give(source);
}

double room_for_jet(const World& world, const Vec3& place, const Vec3& direction, double most) {
  const GasBody& gas = *world.one<GasBody>();
  if (!gas.grid) return most;
  const GasGrid& grid = *gas.grid;
  const Box& domain = grid.parameters().domain;
  const double step = 0.5 * grid.spacing().minCoeff();
  // Cells are in organs by their middles: where it starts may be in one.
  bool came_out = false;
  for (double way = 0.0; way < most; way += step) {
    const Vec3 at = place + way * direction;
    if (!domain.contains(at)) return most;
    const Vec3 cell = (at - domain.min()).cwiseQuotient(grid.spacing());
    const auto index = [&](int axis) {
      return std::min(static_cast<int>(cell[axis]), grid.cells()[axis] - 1);
    };
    const bool solid = grid.is_solid(index(0), index(1), index(2));
    if (solid && came_out) return way;
    came_out = came_out || !solid;
  }
  return most;
}

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
  std::vector<GasLeak> leaks;
  for (const SmokeOutlet& outlet : outlets)
    if (outlet.leak) leaks.push_back({outlet.position, outlet.radius, outlet.flow});
  gas.grid->set_leaks(leaks);
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
  if (gas.grid) balance += gas.grid->report().swelling;
  // What comes in and isn't drawn off leaves by all of them alike.
  for (const LeakDescription& leak : leaks)
    outlets.push_back(
        {leak.position, leak.radius, balance / static_cast<double>(leaks.size()), true});
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
