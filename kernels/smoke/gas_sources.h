// Where gas comes into the cavity and where it leaves.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/base/fields.h"
#include "kernels/smoke/gas_layout.h"
#include "kernels/smoke/gas_mixture.h"

namespace viscera {

/// The trocar's gas port: volume flow, and the momentum that its jet carries.
struct GasInlet {
  Vec3 position = Vec3::Zero();     ///< world [m]
  Vec3 direction = -Vec3::UnitZ();  ///< of the jet; any length
  double radius = 2e-3;             ///< of the opening [m]
  double flow = 0.0;                ///< in [m3/s], not negative

  static constexpr auto fields() {
    return std::tuple(field("position", &GasInlet::position),
                      field("direction", &GasInlet::direction), field("radius", &GasInlet::radius),
                      field("flow", &GasInlet::flow));
  }
};
static_assert(fields_cover<GasInlet>());

/// A suction tip: draws gas from all around.
struct GasEvacuator {
  Vec3 position = Vec3::Zero();  ///< world [m]
  double radius = 2e-3;          ///< of the opening [m]
  double flow = 0.0;             ///< out [m3/s], not negative

  static constexpr auto fields() {
    return std::tuple(field("position", &GasEvacuator::position),
                      field("radius", &GasEvacuator::radius), field("flow", &GasEvacuator::flow));
  }
};
static_assert(fields_cover<GasEvacuator>());

/// A hole to the outside. Where the outside's pressure is the higher, air comes in.
struct GasLeak {
  Vec3 position = Vec3::Zero();  ///< world [m]
  double radius = 2e-3;          ///< of the opening [m]
  double flow = 0.0;             ///< out [m3/s]; negative: of air, in

  static constexpr auto fields() {
    return std::tuple(field("position", &GasLeak::position), field("radius", &GasLeak::radius),
                      field("flow", &GasLeak::flow));
  }
};
static_assert(fields_cover<GasLeak>());

/// What comes out of tissue or a nozzle in a step: gas, with its heat, and the momentum of its jet.
/// The gas takes up all of it along a way of length `reach`, evenly.
struct GasSource {
  Vec3 position = Vec3::Zero();    ///< world [m]
  Vec3 direction = Vec3::UnitZ();  ///< of the jet, unit
  double radius = 1e-3;            ///< of what it comes from [m]
  double reach = 0.0;              ///< of the jet that the grid doesn't resolve [m]
  double impulse = 0.0;            ///< [N s]
  GasGift gift;

  static constexpr auto fields() {
    using S = GasSource;
    return std::tuple(field("position", &S::position), field("direction", &S::direction),
                      field("radius", &S::radius), field("reach", &S::reach),
                      field("impulse", &S::impulse), field("gift", &S::gift));
  }
};
static_assert(fields_cover<GasSource>());

/// Cells that share a source; weights sum to 1.
struct GasSpread {
  std::vector<std::ptrdiff_t> cells;
  std::vector<double> weights;
};

/// Gas cells that faces connect, numbered region by region.
struct GasRegions {
  std::vector<int> of;     ///< a cell's region; -1 outside the gas
  std::vector<int> cells;  ///< in each
};

/// Regions of cells with solid = 0; faces of weight 0 part them.
GasRegions gas_regions(const GasLayout& layout, std::span<const std::uint8_t> solid,
                       const GasFaces& weights);

/// What is smaller is spread as far as this: one and a half cells [m].
double least_spread(const Vec3& spacing);

/// The gas cells within `radius` [m] of a place (in metres from the domain's least corner), or
/// within one and a half cells where the radius is less, more at the middle. Where several regions
/// are in reach the one with the most cells takes all, so that no pocket between organs swallows a
/// source. Twice and four times as far where there is no gas in reach; without cells where there
/// still is none: the source is blocked.
GasSpread spread_source(const GasLayout& layout, const Vec3& spacing, const GasRegions& regions,
                        const Vec3& place, double radius);

}  // namespace viscera
