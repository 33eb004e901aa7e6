#include "engine/features/gas/gas.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <span>
#include <utility>

#include "engine/features/smoke/smoke_keys.h"
#include "kernels/smoke/solid_cells.h"

namespace viscera {
namespace {

/// Cells of the gas are marked afresh when an organ has moved by this share of one.
constexpr double kStaleSolid = 0.25;
/// Vertices of an organ that are asked whether it has: what moves alone between them is small
/// beside a cell.
constexpr std::size_t kSamples = 256;
/// Smoke goes with the gas from this far where no grid says [m].
constexpr double kOpeningWithoutGrid = 3e-3;

/// Where some of an organ's vertices are, spread over all of it.
class SampledPlaces {
 public:
  SampledPlaces(const World& world, Entity organ)
      : vertices_(world.find<OrganState>(organ)->positions),
        pose_(pose_of(world, organ)),
        stride_(std::max<std::size_t>(1, vertices_.size() / kSamples)) {}

  std::size_t size() const { return (vertices_.size() + stride_ - 1) / stride_; }
  Vec3f operator[](std::size_t i) const {  // world [m]
    return pose_.to_world(vertices_[i * stride_].cast<double>()).cast<float>();
  }
  std::vector<Vec3f> all() const {
    std::vector<Vec3f> places(size());
    for (std::size_t i = 0; i < places.size(); ++i) places[i] = (*this)[i];
    return places;
  }

 private:
  std::span<const Vec3f> vertices_;
  const Pose& pose_;
  std::size_t stride_;
};

bool has_moved(const World& world, const GasBody::Solid& solid, float stale) {
  const SampledPlaces now(world, solid.organ);
  if (now.size() != solid.places.size()) return true;
  for (std::size_t i = 0; i < now.size(); ++i)
    if ((now[i] - solid.places[i]).norm() > stale) return true;
  return false;
}

/// Organs' cells are solid; marked again when one has moved, or is another shape.
void mark_organs(World& world, GasBody& gas) {
  const auto stale = static_cast<float>(kStaleSolid * gas.grid->spacing().minCoeff());
  if (!gas.solids.empty() && std::ranges::none_of(gas.solids, [&](const auto& one) {
        return has_moved(world, one, stale);
      }))
    return;
  const SolidGrid grid{gas.grid->parameters().domain.min(), gas.grid->spacing(), gas.grid->cells()};
  std::vector<std::uint8_t> cells(grid.size(), 0);
  gas.solids.clear();
  for (std::size_t o = 0; o < world.all<OrganBody>().size(); ++o) {
    const Entity organ = world.all<OrganBody>().owner(o);
    const OrganBody& body = world.all<OrganBody>()[o];
    mark_solid(world.find<OrganState>(organ)->positions, body.model->surface.triangles,
               pose_of(world, organ), grid, cells);
    gas.solids.push_back({organ, SampledPlaces(world, organ).all()});
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
  GasBody gas{.cavity = Cavity(gas_of(world.model().scene()).cavity_parameters())};
  if (setup->parameters) gas.grid = std::make_unique<GasGrid>(*setup->parameters);
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

void follow_organs(World& world) {
  if (GasBody& gas = *world.one<GasBody>(); gas.grid) mark_organs(world, gas);
}

void give_to_gas(World& world, const GasSource& source) {
  GasBody& gas = *world.one<GasBody>();
  if (!gas.grid) {
    gas.given += source.gift.volume;
    return;
  }
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

void advance_cavity(World& world, double time, double dt) {
  GasBody& gas = *world.one<GasBody>();
  const GasSetup& setup = *world.one<GasSetup>();
  const GasDescription& description = gas_of(world.model().scene());
  Cavity::Demand demand;
  for (const InletDescription& inlet : description.inlets)
    if (inlet.when.contains(time)) demand.insufflator += inlet.limit;
  for (const GasSetup::Evacuator& evacuator : setup.evacuators)
    if (evacuator.description.when.contains(time)) demand.evacuators += evacuator.description.flow;
  std::vector<double> areas;
  for (const LeakDescription& leak : description.leaks) areas.push_back(leak.area);
  demand.leaks = areas;
  demand.swelling = gas.grid ? gas.grid->report().swelling : std::exchange(gas.given, 0.0) / dt;
  gas.cavity.step(demand, dt);
}

GasGrid* open_gas(World& world, std::span<const SmokeOutlet> outlets, double time) {
  GasBody& gas = *world.one<GasBody>();
  if (!gas.grid) return nullptr;
  mark_organs(world, gas);
  // Inlets share what comes in by their limits.
  const GasDescription& description = gas_of(world.model().scene());
  double limits = 0.0;
  for (const InletDescription& inlet : description.inlets)
    if (inlet.when.contains(time)) limits += inlet.limit;
  const double share = limits > 0.0 ? gas.cavity.state().insufflation / limits : 0.0;
  std::vector<GasInlet> inlets;
  for (const InletDescription& inlet : description.inlets)
    inlets.push_back({inlet.position, inlet.direction, inlet.radius,
                      inlet.when.contains(time) ? share * inlet.limit : 0.0});
  gas.grid->set_inlets(inlets);
  std::vector<GasEvacuator> evacuators;
  std::vector<GasLeak> leaks;
  for (const SmokeOutlet& outlet : outlets)
    if (outlet.leak)
      leaks.push_back({outlet.position, outlet.radius, outlet.flow});
    else
      evacuators.push_back({outlet.position, outlet.radius, outlet.flow});
  gas.grid->set_evacuators(evacuators);
  gas.grid->set_leaks(leaks);
  return gas.grid.get();
}

std::vector<SmokeOutlet> gas_outlets(const World& world, double time) {
  const GasBody& gas = *world.one<GasBody>();
  const GasSetup& setup = *world.one<GasSetup>();
  const Cavity::State& cavity = gas.cavity.state();
  const double least = gas.grid ? gas.grid->opening_radius() : kOpeningWithoutGrid;
  std::vector<SmokeOutlet> outlets;
  for (const GasSetup::Evacuator& evacuator : setup.evacuators) {
    const EvacuatorDescription& suction = evacuator.description;
    if (!suction.when.contains(time)) continue;
    const InstrumentState* tool = world.find<InstrumentState>(evacuator.instrument);
    outlets.push_back({tool ? tool->tip : suction.position, std::max(suction.radius, least),
                       cavity.drawn * suction.flow, false});
  }
  const std::vector<LeakDescription>& leaks = gas_of(world.model().scene()).leaks;
  for (std::size_t i = 0; i < std::min(leaks.size(), cavity.leaks.size()); ++i)
    outlets.push_back({leaks[i].position,
                       std::max(std::sqrt(leaks[i].area / std::numbers::pi), least),
                       cavity.leaks[i], true});
  return outlets;
}

std::vector<ReportSection> gas_report(const World& world) {
  const GasBody* gas = world.one<GasBody>();
  if (!gas) return {};
  const Cavity::State& cavity = gas->cavity.state();
  const CavityBook& book = cavity.book;
  constexpr double litre = 1e-3;  // [m3]
  return {report_section(
      "gas", {{"pressure_mmHg", cavity.pressure / kPascalPerMillimetreOfMercury},
              {"pressure_least_mmHg", cavity.least / kPascalPerMillimetreOfMercury},
              {"pressure_greatest_mmHg", cavity.greatest / kPascalPerMillimetreOfMercury},
              {"volume_L", gas->cavity.volume() / litre},
              {"insufflated_L", book.insufflated / litre},
              {"swollen_L", book.swollen / litre},
              {"air_L", book.air / litre},
              {"evacuated_L", book.evacuated / litre},
              {"leaked_L", book.leaked / litre}})};
}

Feature gas_feature() {
  return {.name = "gas",
          .keys = gas_keys(),
          .prepare = prepare,
          .start = start,
          .states = {state_type<GasBody>()},
          .report = gas_report};
}

}  // namespace viscera
